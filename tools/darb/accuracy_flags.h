// --accuracy and one flag for each accuracy setting, as the table of engine/plan names them.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <string>

#include "engine/plan/accuracy.h"

namespace darb {

struct AccuracyFlags {
    std::string preset;                              // empty: balanced
    std::array<std::string, kAccuracyCount> choice;  // empty: the preset's
};

/// training: leaves --sh-degree out, which `darb train` has of its own.
void add_accuracy_flags(CLI::App& command, AccuracyFlags& flags, bool training = false);

/// The preset with what single flags change. Throws Error on names that do not exist and, in
/// training, on choices for pictures only.
Accuracy chosen_accuracy(const AccuracyFlags& flags, bool training = false);

/// A note where a choice that was given changes nothing of this kernel.
void note_unused_choices(const AccuracyFlags& flags, int kernel);

}  // namespace darb
