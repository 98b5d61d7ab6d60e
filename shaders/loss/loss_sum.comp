// SPDX-License-Identifier: MIT
// Adds the partial sums of the strips in a fixed order, so that every run gives the same bits.
// Place: after loss.
// Work: one workgroup; each thread adds every LOSS_SUM_THREADS-th strip, and then a tree in shared memory
// (LOSS_SUM_THREADS vec4) adds the threads. Reads the partial sums; writes one LossResult.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/loss_args.h"

layout(local_size_x = LOSS_SUM_THREADS) in;

layout(push_constant, scalar) uniform Push { LossSumArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer PartialIn { vec4 partial[]; };  // [works]
layout(set = 0, binding = 1, scalar) writeonly buffer ResultOut { LossResult result[]; };

shared vec4 sums[LOSS_SUM_THREADS];

void main() {
    const uint thread = gl_LocalInvocationID.x;
    vec4 sum = vec4(0.0);
    for (uint work = thread; work < args.works; work += LOSS_SUM_THREADS) sum += partial[work];
    sums[thread] = sum;
    for (uint half_size = LOSS_SUM_THREADS / 2; half_size > 0; half_size /= 2) {
        barrier();
        if (thread < half_size) sums[thread] += sums[thread + half_size];
    }
    if (thread == 0) {
        sum = sums[0] * args.scale;
        result[args.result_index] = LossResult(sum.x, sum.y, sum.z, sum.w);
    }
}
