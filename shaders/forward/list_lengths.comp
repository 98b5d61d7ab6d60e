// SPDX-License-Identifier: MIT
// Finds the longest of the tiles' lists, and whether it is too long for the blend dispatches.
// Place: after tile_ranges.
// Work: one thread per tile. Shared memory: none.
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
    if (intersections > status.longest_list) atomicMax(status.longest_list, intersections);  // rarely: most are shorter
    if (intersections > args.list_capacity) atomicOr(status.overflow, OVERFLOW_LISTS);
}
