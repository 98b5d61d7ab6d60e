// SPDX-License-Identifier: MIT
// A run in blocks: a coarse model of the whole, then one part of the ground after the other in
// bounded memory, each with frozen surroundings, and one scene of all. In OUT:
//   blocks/manifest.json  blocks/coarse/  blocks/COLUMNxROW/   runs of their own
//   point_cloud/iteration_N/point_cloud.ply  cameras.json  cfg_args   as any run leaves them
#pragma once

#include <atomic>
#include <functional>
#include <memory>

#include "engine/ranks/ranks.h"
#include "trainer/blocks/manifest.h"
#include "trainer/run/run.h"

namespace darb {

struct BlocksJob {
    const Dataset& dataset;  // the whole data set; each part loads its own photos
    TrainOptions options;    // for each block, except max_splats: for all together
    RunOptions run;          // output, quiet, report, checkpoint_interval, command, effects
    Grid asked{0, 0};        // 0: as many as max_memory_bytes, or the device, calls for
    bool resume = false;
    Ranks& ranks;  // processes that train blocks in turn
    /// Makes a new device for each part, so that its memory peak is that part's.
    std::function<std::unique_ptr<Device>()> device;
    /// Evaluates the joined scene on the held-out views; the result is empty where there are none.
    std::function<Evaluation(const SplatModel& scene)> evaluate;
};

struct BlocksSummary {
    BlocksManifest manifest;
    std::filesystem::path scene;  // on the first rank; empty where the run was interrupted
    bool interrupted = false;
};

/// Throws Error where the data cannot be trained in blocks, where the manifest to resume belongs to
/// something else, and, after the others are done, naming each block that failed. The caller holds
/// the RunLock of the folder.
BlocksSummary run_blocks(const BlocksJob& job, const std::atomic<bool>& stop);

/// The fewest blocks that each fit into the bytes, by the forecast for the whole. Throws Error
/// where no number does.
Grid blocks_for_memory(Device& device, const Dataset& dataset, const TrainOptions& options,
                       const GroundPlane& plane, std::uint64_t bytes);

/// A line for each part: cameras, splats, peak of device memory beside the bound, seconds.
std::string blocks_table(const BlocksManifest& manifest);

}  // namespace darb
