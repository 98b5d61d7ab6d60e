// SPDX-License-Identifier: MIT
// Optimizer: the schedule's rates and the regularisers of an iteration as the step of Adam that the
// backward pass makes, in the units of the scene.
#pragma once

#include <cstddef>

#include "engine/raster/backward.h"
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

}  // namespace darb
