// SPDX-License-Identifier: MIT
// Arguments of the effects' passes, read by C++ and GLSL alike (scalar layout).
#ifndef DARB_EFFECT_ARGS_H
#define DARB_EFFECT_ARGS_H

#include "types.h"

#define EXPOSURE_THREADS 64      // threads per group of exposure_backward
#define EXPOSURE_MAX_GROUPS 128  // most groups of it; the update adds their partial sums
#define EXPOSURE_TERMS 12        // a 3 x 4 map of colours, row-major

// A bilateral grid of maps, with vertices across the picture, down, and along the luminance.
#define EXPOSURE_GRID_X 8
#define EXPOSURE_GRID_Y 8
#define EXPOSURE_GRID_L 4
#define EXPOSURE_GRID_VERTICES 256
#define EXPOSURE_GRID_THREADS 32        // threads per group of exposure_grid_gradient
#define EXPOSURE_GRID_SMOOTHNESS 0.001  // weight of half the squared differences between neighbours

#ifdef __cplusplus
namespace darb::gpu {
#endif

struct ExposureArgs {
    uint pixels;  // H W
    uint view;    // the view whose map it is
    uint groups;  // groups of exposure_backward
    float background_r, background_g, background_b;
    uint width;  // width of the picture, px
};

struct ExposureUpdateArgs {
    uint view;
    uint views;   // views whose mean is held
    uint groups;  // partial sums of each term
    uint terms;   // terms per view: those of one map or of a grid
    float rate;   // lr / (1 - beta1^t), t being the visits of this view
    float inverse_sqrt_correction2;
};

struct SmoothingArgs {
    uint splat_count;
    uint camera_count;
};

#ifdef __cplusplus
static_assert(sizeof(ExposureArgs) == 28);
static_assert(sizeof(ExposureUpdateArgs) == 24);
static_assert(EXPOSURE_GRID_VERTICES == EXPOSURE_GRID_X * EXPOSURE_GRID_Y * EXPOSURE_GRID_L);
}  // namespace darb::gpu
#endif
#endif
