// SPDX-License-Identifier: MIT
// Finds where each tile's run begins and ends in the sorted intersections; tiles without intersections keep (0, 0).
// Place: after the tile sort.
// Work: one thread per intersection. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { IntersectionArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer IntersectionsInUse { uint intersections_in_use; };
layout(set = 0, binding = 1, scalar) readonly buffer TileFromIntersection { uint tile_from_intersection[]; };  // sorted
layout(set = 0, binding = 2, scalar) writeonly buffer TileRange { uvec2 tile_range[]; };

void main() {
    const uint j = linear_id();
    if (j >= intersections_in_use) return;
    const uint tile = tile_from_intersection[j];
    if (tile >= args.tile_count) return;
    if (j == 0u || tile_from_intersection[j - 1u] != tile) tile_range[tile].x = j;
    if (j + 1u == intersections_in_use || tile_from_intersection[j + 1u] != tile) tile_range[tile].y = j + 1u;
}
