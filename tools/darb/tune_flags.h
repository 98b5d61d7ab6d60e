// SPDX-License-Identifier: MIT
// --tune and --retune, and the choice of passes for commands without these options.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "engine/gpu/device.h"
#include "engine/plan/tuner.h"

namespace darb {

struct TuneFlags {
    std::string choice;
    bool retune = false;
};

void add_tune_flags(CLI::App& command, TuneFlags& flags);
/// Adds --retune alone.
void add_retune_flag(CLI::App& command, bool& retune);

/// Applies what the flags ask for; see engine/plan/tuner.h.
inline void settle_tuning(Device& device, const TuneFlags& flags) {
    settle_tuning(device, flags.choice, flags.retune);
}

/// Which choices a listed device would run with, and why.
std::string tuning_of_listed(const DeviceInfo& info);

}  // namespace darb
