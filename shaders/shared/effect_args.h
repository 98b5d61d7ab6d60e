// Arguments of the effects' passes, read by C++ and GLSL alike (scalar layout).
#ifndef DARB_EFFECT_ARGS_H
#define DARB_EFFECT_ARGS_H

#include "types.h"

#define EXPOSURE_THREADS 64      // of a group of exposure_backward
#define EXPOSURE_MAX_GROUPS 128  // of exposure_backward: partial sums that the update adds
#define EXPOSURE_TERMS 12        // a 3 x 4 map of colours, row-major

#ifdef __cplusplus
namespace darb::gpu {
#endif

struct ExposureArgs {
    uint pixels;  // H W
    uint view;    // whose map
    uint groups;  // of exposure_backward
    float background_r, background_g, background_b;
};

struct ExposureUpdateArgs {
    uint view;
    uint views;   // that share the mean
    uint groups;  // of exposure_backward
    float rate;   // lr / (1 - beta1^t), t the visits of this view
    float inverse_sqrt_correction2;
};

struct SmoothingArgs {
    uint splat_count;
    uint camera_count;
};

#ifdef __cplusplus
static_assert(sizeof(ExposureArgs) == 24);
static_assert(sizeof(ExposureUpdateArgs) == 20);
}  // namespace darb::gpu
#endif
#endif
