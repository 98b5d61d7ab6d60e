// SPDX-License-Identifier: MIT
// Counts the intersections of each tile in a block of LIST_BLOCK of them: step 1 of 4 of the tiles' lists.
// Place: after the emission, in place of the first pass of the radix sort.
// Work: one workgroup per block; those beyond the last intersection do nothing. Shared memory: a counter for each tile.
// Reads the tiles of the intersections; writes [blocks][tiles] counts.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/list_args.h"

layout(local_size_x = LIST_THREADS) in;
layout(constant_id = 1) const uint BINS = 4096;  // at least args.tile_count

layout(push_constant, scalar) uniform Push { ListArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer IntersectionsInUse { uint intersections_in_use; };
layout(set = 0, binding = 1, scalar) readonly buffer TileFromIntersection { uint tile_from_intersection[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Counts { uint counts[]; };

shared uint counters[BINS];

void main() {
    const uint begin = gl_WorkGroupID.x * LIST_BLOCK, thread = gl_LocalInvocationID.x;
    if (begin >= intersections_in_use) return;
    const uint end = min(begin + LIST_BLOCK, intersections_in_use);
    for (uint tile = thread; tile < args.tile_count; tile += LIST_THREADS) counters[tile] = 0u;
    barrier();
    for (uint j = begin + thread; j < end; j += LIST_THREADS) {
        const uint tile = tile_from_intersection[j];
        if (tile < args.tile_count) atomicAdd(counters[tile], 1u);
    }
    barrier();
    const uint row = gl_WorkGroupID.x * args.tile_count;
    for (uint tile = thread; tile < args.tile_count; tile += LIST_THREADS) counts[row + tile] = counters[tile];
}
