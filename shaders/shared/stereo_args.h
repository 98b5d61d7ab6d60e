// SPDX-License-Identifier: MIT
// Arguments of the passes that find depth by comparing photos.
#ifndef DARB_STEREO_ARGS_H
#define DARB_STEREO_ARGS_H

#include "types.h"

#define STEREO_SOURCES 8            // photos with which one is compared, at most
#define STEREO_RADIUS 3             // half the side of the window, px
#define STEREO_SAMPLES 25           // every other pixel of the window, as on a chessboard
#define STEREO_GREY_SPREAD 0.15     // spread of the weights over greys
#define STEREO_PLACE_SPREAD 3.0     // spread of the weights over distance, px
#define STEREO_LEAST_VARIANCE 4e-5  // with less variance of greys a window shows nothing
#define STEREO_NO_COST 2.0          // cost of a plane that too few photos show

#ifdef __cplusplus
namespace darb::gpu {
#endif

// A pixel p = (x, y, 1) of the reference at inverse depth v appears in the source at (toward p + v
// shift), divided by its third coordinate.
struct StereoSource {
    mat3 toward;
    vec3 shift;
    uint width, height, first;  // size, px, and where its pixels begin in the buffer of greys
};

struct StereoArgs {
    uint width, height;  // size of the reference, px; its greys come first
    uint sources;
    uint seed;
    float farthest, nearest;  // inverse depths, farthest < nearest
    float steepest;           // |slope| over inverse depth, at most; 1 / px
    uint colour;              // colour on the chessboard, 0 or 1, of the pixels that change
    float reach;              // largest random change, as a share of the whole range
};

#ifdef __cplusplus
static_assert(sizeof(StereoSource) == 60);
static_assert(sizeof(StereoArgs) == 36);
}  // namespace darb::gpu
#endif
#endif
