// --tune and --retune, and the choice of passes for commands that have neither.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "engine/gpu/device.h"

namespace darb {

struct TuneFlags {
    std::string choice;
    bool retune = false;
};

void add_tune_flags(CLI::App& command, TuneFlags& flags);

/// engine/plan/tuner.h, with its lines on stderr. Before anything is made for the device. Throws
/// Error for names that are not known.
void settle_tuning(Device& device, const TuneFlags& flags = {});

/// What would run on a device that is only listed, and why.
std::string tuning_of_listed(const DeviceInfo& info);

}  // namespace darb
