// Arguments of the passes that find depth by comparing photos.
#ifndef DARB_STEREO_ARGS_H
#define DARB_STEREO_ARGS_H

#include "types.h"

#define STEREO_SOURCES 8            // photos that one is compared with, at most
#define STEREO_RADIUS 3             // px, of the window
#define STEREO_SAMPLES 25           // every other pixel of it, as on a chess board
#define STEREO_GREY_SPREAD 0.15     // of the weights, in greys
#define STEREO_PLACE_SPREAD 3.0     // of the weights, px
#define STEREO_LEAST_VARIANCE 4e-5  // of greys; below it a window shows nothing
#define STEREO_NO_COST 2.0          // of a plane that too few photos show

#ifdef __cplusplus
namespace darb::gpu {
#endif

// A pixel p = (x, y, 1) of the reference at inverse depth v is at (toward p + v shift), divided by
// its third, in the source.
struct StereoSource {
    mat3 toward;
    vec3 shift;
    uint width, height, first;  // px; of its pixels in the buffer of greys
};

struct StereoArgs {
    uint width, height;  // px, of the reference, whose greys are the first
    uint sources;
    uint seed;
    float farthest, nearest;  // inverse depths, farthest < nearest
    float steepest;           // |slope| over inverse depth, at most; 1 / px
    uint colour;              // of the chess board, 0 or 1: these pixels change
    float reach;              // of the random changes, as a share of the whole range
};

#ifdef __cplusplus
static_assert(sizeof(StereoSource) == 60);
static_assert(sizeof(StereoArgs) == 36);
}  // namespace darb::gpu
#endif
#endif
