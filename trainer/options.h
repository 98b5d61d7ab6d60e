// TrainOptions: everything that decides a training run, with the defaults of 3DGS (graphdeco).
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "engine/kernels/kernel_family.h"

namespace darb {

struct TrainOptions {
    int iterations = 30'000;
    std::uint64_t seed = 0;

    int kernel = KERNEL_GAUSSIAN;
    Footprint footprint = Footprint::psi;
    int evaluation = EVALUATION_POLYNOMIAL;
    int sh_degree = 3;  // one more every sh_interval iterations
    int sh_interval = 1'000;
    bool white_background = false;
    float lambda_dssim = 0.2f;

    // Learning rates of Adam; position is log-linear over the run and in units of the scene extent.
    float position_lr_init = 1.6e-4f, position_lr_final = 1.6e-6f;
    float scale_lr = 5e-3f, rotation_lr = 1e-3f, opacity_lr = 0.025f;
    float sh_dc_lr = 2.5e-3f, sh_rest_lr = 1.25e-4f;

    // Density control (adc). densify_until -1: half of the run, at most 15,000.
    int densify_from = 500, densify_until = -1, densify_interval = 100;
    float densify_grad_threshold = 2e-4f;  // NDC units
    float clone_split_extent = 0.01f;      // share of the scene extent
    float prune_opacity = 0.005f;
    float prune_extent = 0.1f;  // share of the scene extent, after the first opacity reset
    int opacity_reset_interval = 3'000;
    float opacity_reset_to = 0.01f;
    std::uint32_t max_splats = std::numeric_limits<std::uint32_t>::max();

    // Start.
    float initial_opacity = 0.1f;
    std::uint32_t random_points = 0;  // without a point cloud; 0: from the number of pixels

    int densify_end() const {
        return densify_until >= 0 ? densify_until : std::min(iterations / 2, 15'000);
    }
};

}  // namespace darb
