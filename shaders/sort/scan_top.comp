// SPDX-License-Identifier: MIT
// Scan, step 3 of 4: the exclusive prefix sum of the chunk sums, in place, and the total. One workgroup; every thread
// owns a contiguous run of chunks. Shared memory: one word per subgroup.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "shaders/shared/scan_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 32;

layout(push_constant, scalar) uniform Push { ScanTopArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Plan { ScanPlan plan; };
layout(set = 0, binding = 1, scalar) buffer ChunkSums { uint chunk_sums[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Total { uint total_out[]; };

shared uint subgroup_sums[THREADS];  // the largest possible number of subgroups

void main() {
    const uint chunks = plan.chunks;
    const uint run = (chunks + THREADS - 1) / THREADS;
    // gl_LocalInvocationID would not do, because its order need not be that of the subgroups.
    const uint thread = gl_SubgroupID * gl_SubgroupSize + gl_SubgroupInvocationID;
    const uint begin = min(thread * run, chunks);
    const uint end = min(begin + run, chunks);
    uint sum = 0;
    for (uint i = begin; i < end; ++i) sum += chunk_sums[i];
    const uint inclusive = subgroupInclusiveAdd(sum);
    if (gl_SubgroupInvocationID == gl_SubgroupSize - 1) subgroup_sums[gl_SubgroupID] = inclusive;
    barrier();
    uint prefix = inclusive - sum;
    for (uint s = 0; s < gl_SubgroupID; ++s) prefix += subgroup_sums[s];
    if (thread == THREADS - 1) total_out[args.total_word] = prefix + sum;
    for (uint i = begin; i < end; ++i) {
        const uint value = chunk_sums[i];
        chunk_sums[i] = prefix;
        prefix += value;
    }
}
