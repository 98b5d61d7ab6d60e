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

// What mesh_shade.comp shows of a mesh.
#define MESH_COLOURS 0  // the colours of its vertices, or its shape where it has none
#define MESH_SHAPE 1    // grey, by the slope of each face
#define MESH_EDGES 2    // the same with the edges of the faces

// A face over more pixels than this is drawn by MESH_PARTS workgroups, not by one thread.
#define MESH_SMALL 1024u
#define MESH_LARGE_GROUPS 64u  // workgroups that share all large faces, each for a part
#define MESH_PARTS 8u

// Colours of a heat map from 0 to 1, evenly apart, as values of this type.
#define HEAT_STOPS(v)                                                                 \
    v(0.0, 0.0, 0.02), v(0.34, 0.06, 0.43), v(0.73, 0.21, 0.33), v(0.98, 0.56, 0.04), \
        v(0.99, 1.0, 0.75)

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

// mesh_raster, mesh_raster_large, mesh_shade: a triangle mesh seen by a pinhole.
struct MeshDrawArgs {
    vec3 row0, row1, row2;  // of the turn from the mesh's frame to the camera's
    vec3 shift;             // added then
    vec2 focal;             // px
    vec2 principal;         // px
    uint width, height;     // px
    float near_plane;       // world units along z
    uint faces;
    uint step;         // rasters: 0 for depths, 1 for the faces that have them
    uint look;         // mesh_shade: MESH_COLOURS, MESH_SHAPE or MESH_EDGES
    uint has_colours;  // 1: of vertices
    float background_r, background_g, background_b;
};

// mesh_blend: splats before the surface of a mesh.
struct MeshBlendArgs {
    uint width, height;  // px
    uint tiles_x;
    float nearer;   // share of the depth by which the mesh counts as nearer
    uint segment;   // which segment of every list this dispatch takes, where SEGMENT > 0
    uint segments;  // how many segments there are
};

#ifdef __cplusplus
static_assert(sizeof(MeshDrawArgs) == 104);
static_assert(sizeof(MeshBlendArgs) == 24);
static_assert(sizeof(DisplayArgs) == 56);
static_assert(sizeof(PaneArgs) == 24);
static_assert(sizeof(DepthLightArgs) == 12);
}  // namespace darb::gpu
#endif
#endif
