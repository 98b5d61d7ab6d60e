// SPDX-License-Identifier: MIT
// What `darb train` prints at the end of a run.
#pragma once

#include <filesystem>
#include <string>

#include "engine/gpu/device.h"
#include "trainer/job/job.h"
#include "trainer/run/run.h"

namespace darb {

/// How the command shows a run.
struct RunShown {
    bool quiet = false, verbose = false;  // less and more on the terminal
    bool view = false;                    // in a window
};

/// A quiet run prints only the paths. An interrupted one also prints the command that goes on with
/// it in its folder `output`.
std::string summary_text(const TrainResult& summary, const RunShown& shown,
                         const std::filesystem::path& output, const RankGroup& ranks);

/// Writes the scene as a web page with the photos' cameras as bookmarks; also for a run that was
/// finished before, where there is no page yet. publishes: the user stopped the run for it. Returns
/// whether it did.
bool leave_page(Device& device, const TrainJob& job, const TrainResult& result, bool publishes);

}  // namespace darb
