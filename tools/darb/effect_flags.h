// --effects and what goes with it, for render, view, eval and plan; of training they are rows of
// trainer/job/request_options.h.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "engine/data/dataset.h"

namespace darb {

/// Adds --effects.
void add_effects_flag(CLI::App& command, std::string& text);

/// Adds --lens.
void add_lens_flag(CLI::App& command, DatasetOptions& data);

}  // namespace darb
