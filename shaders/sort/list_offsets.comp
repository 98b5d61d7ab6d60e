// SPDX-License-Identifier: MIT
// Turns the counts of each block into those of all blocks before it, and finds the length of each tile's list: step 2
// of 4 of the tiles' lists.
// Work: a workgroup has LIST_COLUMNS tiles, and LIST_PARTS threads share the blocks of each. Neighbouring threads read
// neighbouring words. Shared memory: a sum for each thread. Writes [blocks][tiles] counts, and the lengths into .y of
// the ranges.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require

#include "shared/list_args.h"

layout(local_size_x = LIST_COLUMNS, local_size_y = LIST_PARTS) in;

layout(push_constant, scalar) uniform Push { ListArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer IntersectionsInUse { uint intersections_in_use; };
layout(set = 0, binding = 1, scalar) buffer Counts { uint counts[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer TileRange { uvec2 tile_range[]; };

shared uint sums[LIST_PARTS][LIST_COLUMNS];

const uint TOGETHER = 8u;  // blocks whose counts are loaded at once

void main() {
    const uint tile = gl_GlobalInvocationID.x, part = gl_LocalInvocationID.y, column = gl_LocalInvocationID.x;
    const uint stride = args.tile_count, blocks = (intersections_in_use + LIST_BLOCK - 1u) / LIST_BLOCK;
    const uint of_part = (blocks + LIST_PARTS - 1u) / LIST_PARTS;
    const uint first = tile < args.tile_count ? min(part * of_part, blocks) : blocks;
    const uint last = min(first + of_part, blocks);
    uint sum = 0u;
    for (uint block = first; block < last; block += TOGETHER) {
        uint own[TOGETHER];
        [[unroll]] for (uint i = 0u; i < TOGETHER; ++i)
            own[i] = block + i < last ? counts[(block + i) * stride + tile] : 0u;
        [[unroll]] for (uint i = 0u; i < TOGETHER; ++i) sum += own[i];
    }
    sums[part][column] = sum;
    barrier();
    uint before = 0u;
    for (uint p = 0u; p < part; ++p) before += sums[p][column];
    if (part + 1u == LIST_PARTS && tile < args.tile_count) tile_range[tile].y = before + sum;
    for (uint block = first; block < last; block += TOGETHER) {
        uint own[TOGETHER];
        [[unroll]] for (uint i = 0u; i < TOGETHER; ++i)
            own[i] = block + i < last ? counts[(block + i) * stride + tile] : 0u;
        [[unroll]] for (uint i = 0u; i < TOGETHER; ++i) {
            if (block + i < last) counts[(block + i) * stride + tile] = before;
            before += own[i];
        }
    }
}
