// SPDX-License-Identifier: MIT
// Orders the tiles of a picture by the lengths of their lists, the longest first, so that the blends do not end with
// one long list while most of the device waits. Lists whose lengths differ by less than a sixteenth may come in any
// order: no result depends on it.
// Place: after tile_ranges.
// Work: one workgroup; a counting sort by a length's power of two and the four bits below it. Shared memory: a counter
// for each of these classes. Reads the ranges of the tiles; writes their order behind them, into the same buffer.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/render_args.h"

const uint CLASSES = 256u;
layout(local_size_x = TILE_ORDER_THREADS) in;

layout(push_constant, scalar) uniform Push { IntersectionArgs args; };
layout(set = 0, binding = 0, scalar) buffer TileRange { uvec2 tile_range[]; };  // [T], then .x is the order [T]

shared uint counters[CLASSES];  // lists of a class; then where the next one of the class goes

// 0 for the longest lists; the lengths below 16 have a class each.
uint class_of(uint tile) {
    const uint length = tile_range[tile].y - tile_range[tile].x;
    const uint power = uint(max(findMSB(length), 4));
    return CLASSES - 1u - min((power - 4u) * 16u + (length >> (power - 4u)), CLASSES - 1u);
}

void main() {
    const uint thread = gl_LocalInvocationID.x;
    for (uint i = thread; i < CLASSES; i += TILE_ORDER_THREADS) counters[i] = 0u;
    barrier();
    for (uint tile = thread; tile < args.tile_count; tile += TILE_ORDER_THREADS)
        atomicAdd(counters[class_of(tile)], 1u);
    barrier();
    if (thread == 0u) {
        uint sum = 0u;
        for (uint i = 0u; i < CLASSES; ++i) {
            const uint count = counters[i];
            counters[i] = sum;
            sum += count;
        }
    }
    barrier();
    for (uint tile = thread; tile < args.tile_count; tile += TILE_ORDER_THREADS)
        tile_range[args.tile_count + atomicAdd(counters[class_of(tile)], 1u)].x = tile;
}
