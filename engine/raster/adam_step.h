// What one step of the optimiser takes: Adam's rates of each attribute and what is beside Adam.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "engine/scene/splat_attributes.h"
#include "shaders/shared/optim_args.h"

namespace darb {

struct AdamStep {
    /// Of each attribute, by its number; as adam_step() leaves them, divided by 1 - beta1^t.
    std::array<float, kAttributeCount> rate{};
    float inverse_sqrt_correction2 = 1;
    // Weights of the mean opacity and the mean scale in the loss; of the splats that the frame
    // shows, or of all.
    float opacity_weight = 0, scale_weight = 0;
    /// Splats that left the run and still count in these means, so that the others go on as before.
    std::uint32_t splats_gone = 0;
    // Share of the step's views at which they act on what a view does not show, too.
    float regularise_unseen = 0;
    float largest_log_scale = std::numeric_limits<float>::max();  // none grows beyond it
    float clearance = 0;  // world: splats nearer to the camera fade
    // Harmonics above the first band make a step in every so many iterations, of the mean gradient
    // of these; more than 1 takes splats that hold such means.
    int rest_every = 1;
    int rest = REST_EACH;  // what that is in this iteration, REST_*
    /// Others than these are AdamUpdate's alone: the step within the backward pass has them built
    /// in.
    double beta1 = 0.9, beta2 = 0.999;
    double rest_beta1 = 0.9, rest_beta2 = 0.999;  // of the harmonics above the first band
};

/// rates: plain learning rates; t: the number of this step, from 1.
AdamStep adam_step(const AdamStep& rates, int t);

/// Throws Error where a rate, weight or limit is no number or negative, or a beta is not below 1.
void check_step(const AdamStep& step);

class GpuSplats;
/// Throws Error where splats lack what the step needs: moments, a sum of harmonics' gradients.
void check_trainable(const GpuSplats& splats, const AdamStep& step);

}  // namespace darb
