// SPDX-License-Identifier: MIT
// Adds up the sums of splats with more than SUM_CHUNK intersections, so that one thread of project_backward need not
// walk them all: the sum of each chunk of SUM_CHUNK neighbouring intersections goes to the slot of its first one.
// Place: between the backward blend and project_backward, which then reads every SUM_CHUNK-th slot of such splats.
// Work: a workgroup of SUM_CHUNK threads adds up the chunks that begin at its SUM_CHUNK slots, of which there are two at
// most. Every eighth slot is added by one thread, in their order, and then the eight sums in theirs, so that the order
// depends on nothing but the splat's number of intersections. Shared memory: a sum for each thread. Does nothing when the
// frame overflowed, because the host repeats it.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x = SUM_CHUNK) in;
const uint THREADS = SUM_CHUNK;

#include "kernels/kernel.glsl"
#include "lib/depth_sum.glsl"
#include "lib/linear_id.glsl"

layout(set = 0, binding = 0, scalar) readonly buffer Status { FrameStatus status; };
layout(set = 0, binding = 1, scalar) readonly buffer IntersectionsInUse { uint intersections_in_use; };
layout(set = 0, binding = 2, scalar) readonly buffer SplatFromIntersection { uint splat_from_intersection[]; };
layout(set = 0, binding = 3, scalar) readonly buffer IntersectionCount { uint intersection_count[]; };
layout(set = 0, binding = 4, scalar) readonly buffer FirstIntersection { uint first_intersection[]; };
#define PARTIALS_BINDING 5
#define PARTIALS_PUT =
#define PARTIALS_GET
#include "lib/partials.glsl"
layout(set = 0, binding = 10, scalar) buffer PartialRest { float partial_rest[]; };          // [K][RESTS]
layout(set = 0, binding = 11, scalar) buffer PartialExponent { float partial_exponent[]; };  // [K] where SHAPED

const uint OTHERS = RESTS + (SHAPED ? 1u : 0u);  // sums of an intersection besides its partials
const uint ROWS = SUM_CHUNK / PARTIALS;          // threads that share a sum

shared uint chunks, chunk_first[2], chunk_count[2];
shared float sums[SUM_CHUNK], other_sums[3u * ROWS];

float other(uint slot, uint i) {
    return i < RESTS ? partial_rest[RESTS * slot + i] : partial_exponent[slot];
}

// The chunk that begins at a slot, if one does: 0 or the number of its intersections.
uint chunk_at(uint slot) {
    const uint splat = splat_from_intersection[slot] & INTERSECTION_SPLAT_MASK;
    const uint count = intersection_count[splat], place = slot - first_intersection[splat];
    return count > SUM_CHUNK && place % SUM_CHUNK == 0u ? min(count - place, SUM_CHUNK) : 0u;
}

void add_chunk(uint first, uint count) {
    const uint thread = gl_LocalInvocationID.x;
    float sum = 0.0;
    for (uint row = thread / PARTIALS; row < count; row += ROWS) sum += get_partial(first + row, thread % PARTIALS);
    sums[thread] = sum;
    if (thread < OTHERS * ROWS) {
        sum = 0.0;
        for (uint row = thread % ROWS; row < count; row += ROWS) sum += other(first + row, thread / ROWS);
        other_sums[thread] = sum;
    }
    barrier();
    if (thread < PARTIALS) {
        sum = sums[thread];
        for (uint row = 1u; row < ROWS; ++row) sum += sums[row * PARTIALS + thread];
        put_partial(first, thread, sum);
    }
    if (thread < OTHERS) {
        sum = other_sums[thread * ROWS];
        for (uint row = 1u; row < ROWS; ++row) sum += other_sums[thread * ROWS + row];
        if (thread < RESTS) partial_rest[RESTS * first + thread] = sum;
        else partial_exponent[first] = sum;
    }
    barrier();
}

void main() {
    const uint slot = linear_id();
    if (slot - gl_LocalInvocationID.x >= intersections_in_use || status.overflow != 0u) return;
    if (gl_LocalInvocationID.x == 0u) chunks = 0u;
    barrier();
    const uint count = slot < intersections_in_use ? chunk_at(slot) : 0u;
    if (count > 0u) {
        const uint at = atomicAdd(chunks, 1u);
        chunk_first[at] = slot;
        chunk_count[at] = count;
    }
    barrier();
    for (uint i = 0u; i < chunks; ++i) add_chunk(chunk_first[i], chunk_count[i]);
}
