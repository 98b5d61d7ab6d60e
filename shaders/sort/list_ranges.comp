// SPDX-License-Identifier: MIT
// Sums the lengths of the tiles' lists into their ranges, and finds the longest of them: step 3 of 4. Tiles without
// intersections get (0, 0).
// Work: one workgroup, each thread a stretch of tiles. Shared memory: a word for each thread. Reads the lengths in .y of
// the ranges and writes the ranges.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/list_args.h"
#include "shared/render_args.h"

layout(local_size_x = LIST_THREADS) in;

layout(push_constant, scalar) uniform Push { ListArgs args; };
layout(set = 0, binding = 0, scalar) buffer TileRange { uvec2 tile_range[]; };
layout(set = 0, binding = 1, scalar) buffer Status { FrameStatus status; };

shared uint sums[LIST_THREADS];  // of the stretches up to and with each

void main() {
    const uint thread = gl_LocalInvocationID.x;
    const uint stretch = (args.tile_count + LIST_THREADS - 1u) / LIST_THREADS;
    const uint first = min(thread * stretch, args.tile_count), last = min(first + stretch, args.tile_count);
    uint own = 0u, longest = 0u;
    for (uint tile = first; tile < last; ++tile) {
        own += tile_range[tile].y;
        longest = max(longest, tile_range[tile].y);
    }
    sums[thread] = own;
    barrier();
    for (uint step = 1u; step < LIST_THREADS; step *= 2u) {
        const uint before = thread >= step ? sums[thread - step] : 0u;
        barrier();
        sums[thread] += before;
        barrier();
    }
    uint begin = sums[thread] - own;
    for (uint tile = first; tile < last; ++tile) {
        const uint length = tile_range[tile].y;
        tile_range[tile] = length == 0u ? uvec2(0u) : uvec2(begin, begin + length);
        begin += length;
    }
    if (longest > status.longest_list) atomicMax(status.longest_list, longest);
    if (longest > args.list_capacity) atomicOr(status.overflow, OVERFLOW_LISTS);
}
