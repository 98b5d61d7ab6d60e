// SPDX-License-Identifier: MIT
// Argument structs of the loss passes, read by C++ and GLSL alike (scalar layout).
#ifndef DARB_LOSS_ARGS_H
#define DARB_LOSS_ARGS_H

#include "types.h"

#define LOSS_HALO 10  // px on each side that a strip reads: 5 for the window forward, 5 backward
#define LOSS_TILE 16  // px, the side of a tile
#define LOSS_SIDE 26  // px, side of what a tile reads: 5 more on each side
#define LOSS_SUM_THREADS 64  // threads of the one workgroup that adds the partial sums

// Differences of depths in a pixel, as a share of its depth, beyond which they count as those of
// two surfaces.
#define DISTORTION_WIDTH 0.05

#ifdef __cplusplus
namespace darb::gpu {
#endif

struct LossArgs {
    uint width;        // px
    uint height;       // px
    uint rows;         // px of one strip; unused, like strips, where the loss goes by tiles
    uint strips;       // side by side, each LANES * COLUMNS - 2 * LOSS_HALO px wide
    uint works;        // strips * ceil(height / rows) * 3 channels
    float l1_scale;    // (1 - lambda) / (3 H W): dL/d|x - y|
    float ssim_scale;  // -lambda / (3 H W): dL/dSSIM
    float background_r, background_g, background_b;
};

struct DepthLossArgs {
    uint pixels;    // H W
    uint measured;  // 1: the photo has depths behind its colours
    float scale;    // factor of the absolute difference: weight / (H W times the usual depth)
    float distortion_scale;  // weight of the distortion / (H W)
};

struct LossSumArgs {
    uint works;
    uint result_index;
    float scale;  // 1 / (3 H W)
};

// Means over the 3 H W values of one photo.
struct LossResult {
    float l1;      // |x - y|
    float ssim;    // the SSIM map
    float mse;     // (clamp(x, 0, 1) - y)^2, for the PSNR of the training batch
    float weight;  // share of pixels that count: 1, or less where USE_MASK leaves some out
};

#ifdef __cplusplus
static_assert(sizeof(LossArgs) == 40);
static_assert(sizeof(LossSumArgs) == 12);
static_assert(sizeof(LossResult) == 16);
}  // namespace darb::gpu
#endif
#endif
