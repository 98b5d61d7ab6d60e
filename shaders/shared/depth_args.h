// SPDX-License-Identifier: MIT
// Arguments of the passes that find the depth at which half of a pixel's light is left.
#ifndef DARB_DEPTH_ARGS_H
#define DARB_DEPTH_ARGS_H

#include "types.h"

// How a splat takes light along a ray (docs/math.md, Depth of a surface).
#define DEPTH_READING_FRONT 0  // by its own alpha up to its middle, nothing behind it
#define DEPTH_READING_SOLID 1  // a half before its middle, a half behind, as a cloud does
#define DEPTH_READING_PLANE 2  // all at once, in the plane of its middle

#define MEDIAN_SAMPLES 8u  // depths that a walk over a list tests, at most
// Intersections of a tile's list that a dispatch takes: the pixels of a block walk it a subgroup at
// a time, and a driver's rounds are those of LIST_SEGMENT.
#define MEDIAN_SEGMENT 2048u

#ifdef __cplusplus
namespace darb::gpu {
#endif

struct DepthPlaneArgs {
    uint splat_count;
    uint camera_index;
    float low_pass;  // px^2
};

struct MedianDepthArgs {
    uint width, height;  // px
    uint tiles_x;
    float level;       // share of the light that is left at the surface
    float near_plane;  // world units along z: no surface is before it
    uint segment;      // which MEDIAN_SEGMENT of every list this dispatch takes
    uint segments;     // in all
};

struct PointLightArgs {
    uint items;
    uint segment;  // as above
};

#ifdef __cplusplus
static_assert(sizeof(DepthPlaneArgs) == 12);
static_assert(sizeof(MedianDepthArgs) == 28);
static_assert(sizeof(PointLightArgs) == 8);
}  // namespace darb::gpu
#endif
#endif
