// SPDX-License-Identifier: MIT
// DensityStrategy: how splats come, go and move while a run goes on. A strategy is one file, which
// defines its row (strategy_row.h) and what a run makes of it, and its name in strategy_list.h.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/raster/gpu_splats.h"
#include "trainer/growth/density_control.h"
#include "trainer/options/schedule.h"
#include "trainer/options/strategy.h"

namespace darb {

struct StepFrame {
    Commands& commands;
    GpuSplats& splats;
    const Buffer& status;  // gpu::FrameStatus
    int iteration;
};

/// What a round of density control works on.
struct DensityRound {
    GpuSplats& splats;
    DensityControl& control;
    const Buffer& gradient_sum;  // [N][2] of Backward
    gpu::DensifyArgs args;       // as the schedule has them
    int iteration;
    std::uint32_t limit;                   // no more splats than these, whatever it is that sets it
    std::vector<std::uint8_t> fixed = {};  // [N], 1 for those that do not grow; empty: none
};

/// What a run makes of a row. It keeps nothing from round to round. The queue is idle in round().
class DensityStrategy {
  public:
    virtual ~DensityStrategy() = default;

    /// Recorded after the optimizer's step. A frame that overflowed must change nothing.
    virtual void record_after_update(const StepFrame&) {}

    /// The splats are of another kernel from now on. The queue is idle.
    virtual void set_kernel(int) {}

    /// One round. Parameters, moments and the count of splats follow.
    virtual DensityResult round(const DensityRound& round) = 0;
};

/// What a strategy is made with.
struct StrategySetup {
    Device& device;
    const Schedule& schedule;
    double extent;  // extent of the scene, world units
};

}  // namespace darb
