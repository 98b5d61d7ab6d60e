// SPDX-License-Identifier: MIT
// Radix sort, step 2 of 3 of a pass: finds where the keys of each digit and block go, by an exclusive sum over all
// digits and, within a digit, over the blocks. One workgroup per digit: it sums the totals of the lower digits and
// walks its row THREADS blocks at a time. With TEAM_IS_THREAD, one thread per digit: see scan_team.glsl. Shared memory:
// one word per subgroup. Reads totals [digits] of the pass; reads and writes histograms [digits][blocks].
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "shaders/shared/radix_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 32;
layout(constant_id = 2) const bool TEAM_IS_THREAD = false;

layout(push_constant, scalar) uniform Push { RadixPassArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Plan { RadixPlan plan; };
layout(set = 0, binding = 1, scalar) readonly buffer Totals { uint totals[]; };
layout(set = 0, binding = 2, scalar) buffer Histograms { uint histograms[]; };

shared uint subgroup_sums[THREADS];  // the largest possible number of subgroups

// Returns the sum of the values of the threads before this one; sum gets that of all.
uint sum_before(uint value, out uint sum) {
    const uint inclusive = subgroupInclusiveAdd(value);
    barrier();  // other threads may still read the sums
    if (gl_SubgroupInvocationID == gl_SubgroupSize - 1) subgroup_sums[gl_SubgroupID] = inclusive;
    barrier();
    uint before = inclusive - value;
    sum = 0;
    for (uint s = 0; s < gl_NumSubgroups; ++s) {
        if (s == gl_SubgroupID) before += sum;
        sum += subgroup_sums[s];
    }
    return before;
}

void walk_row(uint digit) {
    uint place = 0;
    for (uint d = 0; d < digit; ++d) place += totals[args.first + d];
    for (uint at = digit * plan.groups_x; at < (digit + 1) * plan.groups_x; ++at) {
        const uint count = histograms[at];
        histograms[at] = place;
        place += count;
    }
}

void walk_row_together(uint digit) {
    // gl_LocalInvocationID would not do, because its order need not be that of the subgroups.
    const uint thread = gl_SubgroupID * gl_SubgroupSize + gl_SubgroupInvocationID;
    const uint blocks = plan.groups_x;
    uint smaller = 0, place;
    for (uint d = thread; d < digit; d += THREADS) smaller += totals[args.first + d];
    sum_before(smaller, place);
    for (uint row = 0; row < blocks; row += THREADS) {
        const uint block = row + thread, at = digit * blocks + block;
        const uint count = block < blocks ? histograms[at] : 0;
        uint sum;
        const uint before = sum_before(count, sum);
        if (block < blocks) histograms[at] = place + before;
        place += sum;
    }
}

void main() {
    if (!TEAM_IS_THREAD)
        walk_row_together(gl_WorkGroupID.x);
    else if (gl_GlobalInvocationID.x < args.digits)
        walk_row(gl_GlobalInvocationID.x);
}
