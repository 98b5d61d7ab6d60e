// SPDX-License-Identifier: MIT
// The longest of the tiles' lists, and whether it is longer than the blend dispatches take on.
// Place: after tile_ranges. Work: one thread a tile. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { IntersectionArgs args; };
layout(set = 0, binding = 0, scalar) buffer Status { FrameStatus status; };
layout(set = 0, binding = 1, scalar) readonly buffer TileRange { uvec2 tile_range[]; };

void main() {
    const uint tile = linear_id();
    if (tile >= args.tile_count) return;
    const uint intersections = tile_range[tile].y - tile_range[tile].x;
    if (intersections > status.longest_list) atomicMax(status.longest_list, intersections);  // seldom: most are shorter
    if (intersections > args.list_capacity) atomicOr(status.overflow, OVERFLOW_LISTS);
}
