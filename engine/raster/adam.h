// SPDX-License-Identifier: MIT
// What one step of the optimiser needs: Adam's rates for each attribute, and what goes with Adam.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <map>

#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "engine/raster/frame_view.h"
#include "engine/raster/gradient_buffers.h"
#include "engine/scene/splat_model.h"
#include "shaders/shared/optim_args.h"

namespace darb {

struct AdamStep {
    /// Learning rates by the number of the attribute, as adam_step() leaves them: divided by 1 -
    /// Splats that left the run and still count in these means, so that the others go on as before.
    std::uint32_t splats_gone = 0;
    /// beta1^t.
    std::array<float, kAttributeCount> rate{};
    float inverse_sqrt_correction2 = 1;
    // Weights in the loss of the mean opacity and the mean scale, over the splats that the frame
    // shows or over all.
    float opacity_weight = 0, scale_weight = 0;
    float flatness_weight = 0;  // and that of the mean of each splat's smallest scale
    // Share of the step's views in which they also act on splats that the view does not show.
    float regularise_unseen = 0;
    float largest_log_scale = std::numeric_limits<float>::max();  // no scale grows beyond it
    float clearance = 0;  // world: splats nearer to the camera fade
    // Harmonics above the first band take one step in so many iterations, by the mean gradient over
    // these; more than 1 needs splats that hold such means.
    int rest_every = 1;
    int rest = REST_EACH;  // what they do in this iteration, REST_*
    /// Only AdamUpdate takes other values: the step within the backward pass has these built in.
    double beta1 = 0.9, beta2 = 0.999;
    double rest_beta1 = 0.9, rest_beta2 = 0.999;  // for the harmonics above the first band
};

/// rates: plain learning rates; t: the number of this step, from 1.
AdamStep adam_step(const AdamStep& rates, int t);

/// Throws Error where a rate, weight or limit is no number or negative, or a beta is not below 1.
void check_step(const AdamStep& step);

class GpuSplats;
/// Throws Error where splats lack what the step needs: moments, a sum of harmonics' gradients.
void check_trainable(const GpuSplats& splats, const AdamStep& step);

// AdamUpdate: the optimiser's step from gradients in buffers, which may come from several views,
// from other processes or from a caller. For one view it is the step that Backward::record makes,
// to rounding: Adam with bias correction (Kingma and Ba 2015), the regularisers, the largest scale,
// the fading of what stands too near to a camera, and the harmonics' step in every so many
// iterations.

class AdamUpdate {
  public:
    explicit AdamUpdate(Device& device);

    /// splats must have moments, and the gradients must be theirs. status: gpu::FrameStatus of the
    /// frames; where one overflowed nothing happens. scale: factor of the gradients, 1 / views for
    /// the mean of the views' losses. Only record_fading() uses step.clearance. Throws Error for
    /// what check_step refuses and for gradients of other splats.
    void record(Commands& commands, GpuSplats& splats, const GradientBuffers& gradients,
                const Buffer& status, int sh_degree, const AdamStep& step, float scale = 1);

    /// After record(), once for each view of the step: splats nearer to the camera than the
    /// clearance (world units) fade. Records nothing where that is 0.
    void record_fading(Commands& commands, GpuSplats& splats, const GradientBuffers& gradients,
                       const Buffer& status, const FrameView& view, float clearance);

    /// Adds what the views showed to sums [N][2] such as Backward::gradient_sum().
    void record_sums(Commands& commands, const GradientBuffers& gradients, const Buffer& status,
                     const Buffer& gradient_sum);

  private:
    const Pipeline& pipeline(int attribute, std::uint32_t floats, int rest, bool flatness);

    Device* device_;
    std::map<std::array<int, 4>, Pipeline> pipelines_;  // by what pipeline() takes
    Pipeline fade_, add_views_;
};

}  // namespace darb
