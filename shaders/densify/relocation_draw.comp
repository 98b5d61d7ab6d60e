// SPDX-License-Identifier: MIT
// Draws one live splat for each dead and each new one, in proportion to the weights, and counts how often each was
// drawn.
// Place: mcmc, after the scan of the weights. Source: 3DGS-MCMC (arXiv 2404.09591) section 3.
// Work: one thread per draw. Shared memory: none. The counts are integer sums, so they are the same in any order.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/strategy_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"
#include "lib/random.glsl"

layout(push_constant, scalar) uniform Push { RelocationArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Offset { uint offset[]; };  // exclusive sums of weights
layout(set = 0, binding = 1, scalar) writeonly buffer Drawn { uint drawn[]; };
layout(set = 0, binding = 2, scalar) buffer Copies { uint copies[]; };

void main() {
    const uint draw = linear_id();
    if (draw >= args.dead_count + (args.splats_after - args.splat_count)) return;
    uint at, ignored;  // at: uniform in [0, weight_total)
    umulExtended(random_hash(random_seed(args.seed, draw)), args.weight_total, at, ignored);
    // Finds the last splat whose sum does not exceed `at`. Its weight is not 0, or the next one would have the same
    // sum.
    uint first = 0u, count = args.splat_count;
    while (count > 1u) {
        const uint half_count = count / 2u;
        if (offset[first + half_count] <= at) first += half_count;
        count -= half_count;
    }
    drawn[draw] = first;
    atomicAdd(copies[first], 1u);
}
