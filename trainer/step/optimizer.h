// SPDX-License-Identifier: MIT
// Optimizer: the schedule's rates and the regularisers of an iteration as the step of Adam that the
// backward pass makes, in the units of the scene.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "engine/raster/backward.h"
#include "engine/raster/gpu_splats.h"
#include "trainer/options/schedule.h"

namespace darb {

class Optimizer {
  public:
    /// extent, reach: scene_extent() and scene_reach(), world units. photos: how many are trained
    /// on.
    Optimizer(const Schedule& schedule, double extent, double reach, std::size_t photos);

    /// The step of an iteration, from 1, or of the batch that ends with it. The caller sets its
    /// clearance, which depends on the view.
    AdamStep step(int iteration) const;
    /// The same in a trial of a few iterations: all rates times `share`, and all bands of colour
    /// take a step in each.
    AdamStep trial_step(int iteration, float share) const;

    /// The rates of another schedule of the same run from now on.
    void set_schedule(const Schedule& schedule) { schedule_ = schedule; }

    /// Factor for lengths that options give for a Gaussian as shares of the scene extent.
    double length() const { return schedule_.length_scale * extent_; }

  private:
    AdamStep rates(int iteration) const;
    AdamStep of_batch(AdamStep step) const;
    AdamStep with_regularisers(AdamStep step, int iteration) const;

    Schedule schedule_;
    float opacity_weight_, scale_weight_;
    double extent_, reach_;
    std::size_t photos_;
};

// IterateAverage: the mean of the splats over iterations of a run (Polyak and Juditsky 1992). Steps
// that are too large to settle scatter around where they lead; their mean does not.

class IterateAverage {
  public:
    /// Holds no memory of splats before the first add().
    explicit IterateAverage(Device& device);

    /// Adds the splats as they are now; their count and degree may change only after clear(). The
    /// queue must be idle. Throws Error where the device has no room for the first mean; call
    /// clear() then.
    void add(const GpuSplats& splats);
    /// How many calls of add() the mean is over.
    std::uint32_t count() const { return count_; }
    /// Swaps the parameters and their mean; a second call swaps them back. Does nothing where
    /// count() is 0.
    void swap(GpuSplats& splats);
    void clear();

    /// [attribute][N stride], or empty; a checkpoint holds this and count().
    std::vector<std::vector<float>> state(const GpuSplats& splats) const;
    /// splats: with the same count and degree.
    void restore(const std::vector<std::vector<float>>& state, std::uint32_t count,
                 const GpuSplats& splats);

  private:
    Device* device_;
    Commands commands_;
    Pipeline average_;
    std::uint32_t count_ = 0;
    std::array<Buffer, kAttributeCount> mean_;
};

}  // namespace darb
