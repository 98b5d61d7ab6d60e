// SPDX-License-Identifier: MIT
// Radix sort, step 1 of 3 of a pass: counts how often each digit occurs in each block. One workgroup per block of
// THREADS * ITEMS keys. Shared memory: DIGITS counters. Reads keys [n]; writes histograms [digits][blocks] and adds
// to the totals [digits] of the pass.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shaders/shared/radix_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 32;
layout(constant_id = 1) const uint ITEMS = 256;
layout(constant_id = 4) const uint DIGITS = RADIX_MAX_DIGITS;  // the most that a digit has

layout(push_constant, scalar) uniform Push { RadixPassArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Plan { RadixPlan plan; };
layout(set = 0, binding = 1, scalar) readonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Histograms { uint histograms[]; };
layout(set = 0, binding = 3, scalar) buffer Totals { uint totals[]; };

shared uint counters[DIGITS];

void main() {
    const uint thread = gl_LocalInvocationID.x;
    for (uint d = thread; d < args.digits; d += THREADS) counters[d] = 0;
    barrier();
    const uint begin = gl_WorkGroupID.x * THREADS * ITEMS;
    const uint end = min(begin + THREADS * ITEMS, plan.count);
    const uint mask = args.digits - 1;
    for (uint i = begin + thread; i < end; i += THREADS)
        atomicAdd(counters[(keys[i] >> args.shift) & mask], 1);
    barrier();
    for (uint d = thread; d < args.digits; d += THREADS) {
        histograms[d * gl_NumWorkGroups.x + gl_WorkGroupID.x] = counters[d];
        atomicAdd(totals[args.first + d], counters[d]);
    }
}
