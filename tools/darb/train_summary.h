// SPDX-License-Identifier: MIT
// What `darb train` says at the end of a run.
#pragma once

#include <filesystem>
#include <string>

#include "trainer/run/run.h"

namespace darb {

/// How the command shows a run.
struct RunShown {
    bool quiet = false, verbose = false;  // less and more on the terminal
    bool view = false;                    // in a window
};

/// For a quiet run only the paths, and where it was interrupted, the command that goes on with it
/// in its folder `output`.
std::string summary_text(const TrainResult& summary, const RunShown& shown,
                         const std::filesystem::path& output, const RankGroup& ranks);

}  // namespace darb
