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

/// Of pictures; of training they are rows of trainer/job/request_options.h.
void add_accuracy_flags(CLI::App& command, AccuracyFlags& flags);

/// The preset with what single flags change. Throws Error on names that do not exist.
Accuracy chosen_accuracy(const AccuracyFlags& flags);

/// A note where a choice that was given changes nothing of this kernel.
void note_unused_choices(const AccuracyFlags& flags, int kernel);

}  // namespace darb
