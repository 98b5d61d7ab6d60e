// SPDX-License-Identifier: MIT
// Radix sort, once per sort: turns the pair count on the device into a block count and sets the totals to 0. One
// workgroup. Reads the count; writes the plan, whose head is an indirect dispatch command, and the totals.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shaders/shared/radix_args.h"

layout(local_size_x = RADIX_THREADS) in;

layout(push_constant, scalar) uniform Push { RadixPrepareArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Count { uint count_in[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Plan { RadixPlan plan; };
layout(set = 0, binding = 2, scalar) writeonly buffer Totals { uint totals[]; };  // [passes][digits]

void main() {
    const uint thread = gl_LocalInvocationID.x;
    for (uint i = thread; i < args.totals; i += RADIX_THREADS) totals[i] = 0;
    if (thread != 0) return;
    const uint count = min(count_in[args.count_word], args.capacity);
    plan.groups_x = count / args.block + uint(count % args.block != 0);
    plan.groups_y = 1;
    plan.groups_z = 1;
    plan.count = count;
}
