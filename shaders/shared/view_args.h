// SPDX-License-Identifier: MIT
// Argument structs of the passes that only the viewer runs (shaders/view), read by C++ and GLSL.
#ifndef DARB_VIEW_ARGS_H
#define DARB_VIEW_ARGS_H

#include "types.h"

#define VIEW_GROUP 64

// What display.comp shows of a frame.
#define VIEW_COLOUR 0  // the picture
#define VIEW_ERROR 1   // mean absolute difference from the photo, as heat
// mean depth of what was blended, as heat; the background where there was nothing
#define VIEW_DEPTH 2
#define VIEW_COUNT 3  // intersections of the tile's list that the pixel walked through, as heat

#ifdef __cplusplus
namespace darb::gpu {
#endif

struct DisplayArgs {
    uint width;   // px of the frame
    uint height;  // px
    uint tiles_x;
    float heat_max;                  // error or count that gets the hottest colour
    float photo_x, photo_y;          // px of the frame at the photo's top left corner
    float photo_scale;               // px of the frame per photo px
    uint photo_width, photo_height;  // px
    float background_r, background_g, background_b;
    uint before_width, before_height;  // px of the previous picture; 0: there is none
};

// view_depth: replaces each visible splat's colour by (depth between near and far, 1, 0).
struct DepthLightArgs {
    uint splat_count;  // N
    float near_depth;  // world units
    float far_depth;
};

// panes: one strip of several pictures side by side.
struct PaneArgs {
    uint width, height;  // px of the frame
    uint left, right;    // px, first column and end of the columns that are written
    uint difference;     // 1: the difference from the other picture, as heat
    float heat_max;      // value that gets the hottest colour
};

#ifdef __cplusplus
static_assert(sizeof(DisplayArgs) == 56);
static_assert(sizeof(PaneArgs) == 24);
static_assert(sizeof(DepthLightArgs) == 12);
}  // namespace darb::gpu
#endif
#endif
