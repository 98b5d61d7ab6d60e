// SPDX-License-Identifier: MIT
// Packs the intersections of a stretch of the tile's list that touch the subgroup's area, so that the loop over them
// has neither gaps nor branches. Needs the constants THREADS, SUBGROUP_SIZE and CHUNK (how many intersections are
// looked at before those found are blended) and the buffers intersection_from_sorted and splat_from_intersection.
// HIT_MATTERS, where it is defined, says of a splat whether it is wanted.
#include "lib/lockstep.glsl"

shared uint hit_splat[THREADS / SUBGROUP_SIZE * CHUNK];
shared uint hit_index[THREADS / SUBGROUP_SIZE * CHUNK];

uint hits_base() {
    return gl_SubgroupID * CHUNK;
}

// Fills the subgroup's lists with those of the intersections [begin, end), at least one and at most CHUNK of them, that
// have one of the bits. Returns how many.
uint collect_hits(uint begin, uint end, uint bits) {
    order_within_subgroup();  // other lanes may still read the lists
    uint count = 0u, batch = begin;
    do {  // tested at the bottom: see emit_cells
        const uint j = batch + gl_SubgroupInvocationID;
        uint intersection = 0u;
        if (j < end) intersection = splat_from_intersection[intersection_from_sorted[j]];
        bool hit = (intersection & bits) != 0u;
#ifdef HIT_MATTERS
        if (hit) hit = HIT_MATTERS(intersection & INTERSECTION_SPLAT_MASK);
#endif
        const uvec4 hits = subgroupBallot(hit);
        if (hit) {
            const uint at = hits_base() + count + subgroupBallotExclusiveBitCount(hits);
            hit_splat[at] = intersection & INTERSECTION_SPLAT_MASK;
            hit_index[at] = j;
        }
        count += subgroupBallotBitCount(hits);
        batch += SUBGROUP_SIZE;
    } while (batch < end);
    order_within_subgroup();
    return count;
}
