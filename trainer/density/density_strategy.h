// DensityStrategy: how splats come, go and move while a run goes on. A strategy is one file, which
// defines its row (strategy_row.h) and what a run makes of it, and its name in strategy_list.h.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "engine/raster/loss.h"
#include "trainer/density/density_control.h"
#include "trainer/density/step_frame.h"
#include "trainer/schedule.h"
#include "trainer/strategy.h"

namespace darb {

/// What a round of density control works on.
struct DensityRound {
    GpuSplats& splats;
    DensityControl& control;
    const Buffer& gradient_sum;  // [N][2] of Backward
    gpu::DensifyArgs args;       // as the schedule has them
    int iteration;
    std::uint32_t limit;  // no more splats than these, whatever it is that sets it
};

/// What a run makes of a row. The queue is idle in round(), state() and restore().
class DensityStrategy {
  public:
    virtual ~DensityStrategy() = default;

    /// Recorded between a picture and its loss. Not while a probe tries something out.
    virtual void record_before_loss(const StepFrame&) {}
    /// After a batch: what record_before_loss left in StepFrame::scores of its views, added up,
    /// goes to the strategy's own sums. Of a strategy whose row scores views.
    virtual void record_scores(Commands&, const Buffer& /*scores*/, const Buffer& /*status*/,
                               std::uint32_t /*splats*/) {}
    /// Recorded after the optimizer's step. A frame that overflowed must change nothing.
    virtual void record_after_update(const StepFrame&) {}

    /// One round. Parameters, moments and the count of splats follow.
    virtual DensityResult round(const DensityRound& round) = 0;

    /// What a checkpoint holds of it: some floats a splat, or nothing.
    virtual std::vector<float> state(std::uint32_t /*splats*/) const { return {}; }
    /// Begins anew for so many splats, with what state() gave, where that is not empty.
    virtual void restore(std::uint32_t /*splats*/, const std::vector<float>& /*state*/) {}
};

/// What a strategy is made with.
struct StrategySetup {
    Device& device;
    const TrainOptions& options;
    const Schedule& schedule;
    LossOptions photos;    // how the loss reads them
    double extent;         // of the scene, world units
    std::uint32_t splats;  // at the start
};

}  // namespace darb
