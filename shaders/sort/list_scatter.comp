// SPDX-License-Identifier: MIT
// Writes each intersection to its place in the list of its tile: step 4 of 4 of the tiles' lists. Those of a tile stay
// in their order, which is that of the depth.
// Work: one workgroup per block of LIST_BLOCK intersections; those beyond the last intersection do nothing. It walks the
// block step by step, an intersection for each thread. Lanes with the same tile find each other by one ballot per bit of
// the tile. Then the subgroups, of any size, take turns in their order, and the first lane of each tile moves the tile's
// counter on. Shared memory: a counter for each tile, which holds the place of its next intersection.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_shuffle : require

#include "shared/list_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 256;  // full subgroups
layout(constant_id = 1) const uint BINS = 4096;    // 4096 or 8192, at least args.tile_count

layout(push_constant, scalar) uniform Push { ListArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer IntersectionsInUse { uint intersections_in_use; };
layout(set = 0, binding = 1, scalar) readonly buffer TileFromIntersection { uint tile_from_intersection[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Counts { uint counts[]; };  // of the blocks before
layout(set = 0, binding = 3, scalar) readonly buffer TileRange { uvec2 tile_range[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer IntersectionFromSorted { uint intersection_from_sorted[]; };

shared uint places[BINS];

const uint BITS = BINS == 4096u ? 12u : 13u;

// The valid lanes with the same tile.
uvec4 peers_of(uint tile, bool valid) {
    uvec4 peers = subgroupBallot(valid);
    [[unroll]] for (uint bit = 0u; bit < BITS; ++bit) {
        const bool set = ((tile >> bit) & 1u) != 0u;
        const uvec4 vote = subgroupBallot(set);
        peers &= set ? vote : ~vote;
    }
    return peers;
}

void main() {
    const uint begin = gl_WorkGroupID.x * LIST_BLOCK;
    // gl_LocalInvocationID would not do, because its order need not be that of the subgroups.
    const uint thread = gl_SubgroupID * gl_SubgroupSize + gl_SubgroupInvocationID;
    if (begin >= intersections_in_use) return;
    const uint end = min(begin + LIST_BLOCK, intersections_in_use);
    const uint row = gl_WorkGroupID.x * args.tile_count;
    for (uint tile = thread; tile < args.tile_count; tile += THREADS)
        places[tile] = tile_range[tile].x + counts[row + tile];
    barrier();
    for (uint first = begin; first < end; first += THREADS) {
        const uint j = first + thread;
        uint tile = 0xFFFFFFFFu;
        if (j < end) tile = tile_from_intersection[j];
        const bool valid = tile < args.tile_count;
        tile = valid ? tile : 0u;
        const uvec4 peers = peers_of(tile, valid);
        const uint before = subgroupBallotExclusiveBitCount(peers), count = subgroupBallotBitCount(peers);
        uint place = 0u;
        for (uint turn = 0u; turn < gl_NumSubgroups; ++turn) {
            if (valid && gl_SubgroupID == turn && before == 0u) {
                place = places[tile];
                places[tile] = place + count;
            }
            barrier();
        }
        place = subgroupShuffle(place, subgroupBallotFindLSB(peers));
        if (valid) intersection_from_sorted[place + before] = j;
    }
}
