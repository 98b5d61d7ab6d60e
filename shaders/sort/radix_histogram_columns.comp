// SPDX-License-Identifier: MIT
// Radix sort, step 1 of 3 of a pass, for lavapipe: counts how often each digit occurs in each block. One workgroup,
// which is one subgroup, per block of THREADS * ITEMS keys, with columns as in radix_scatter_columns.comp. Reads keys
// [n]; writes histograms [digits][blocks] and adds to the totals [digits] of the pass.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
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

void main() {
    const uint begin = min((gl_WorkGroupID.x * THREADS + gl_LocalInvocationID.x) * ITEMS, plan.count);
    const uint end = min(begin + ITEMS, plan.count);
    uint column[DIGITS];
    for (uint d = 0; d < DIGITS; ++d) column[d] = 0;
    for (uint i = begin; i < end; ++i) column[(keys[i] >> args.shift) & (args.digits - 1)] += 1;
    for (uint d = 0; d < args.digits; ++d) {
        const uint count = subgroupAdd(column[d]);
        if (gl_LocalInvocationID.x == 0) {
            histograms[d * gl_NumWorkGroups.x + gl_WorkGroupID.x] = count;
            atomicAdd(totals[args.first + d], count);
        }
    }
}
