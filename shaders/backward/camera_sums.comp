// SPDX-License-Identifier: MIT
// Adds dL/d(camera) and dL/d(position) up over the splats in a fixed order, so that every run gives the same bits.
// Place: after project_backward with CAMERA_GRADIENT.
// Work: CAMERA_SUM_THREADS threads per group; each thread adds every groups * CAMERA_SUM_THREADS-th splat, and then a
// tree in shared memory adds the threads. Reads shares and positions' gradients; writes CAMERA_SUMS floats per group,
// which the host adds in double.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/optim_args.h"

layout(local_size_x = CAMERA_SUM_THREADS) in;

layout(push_constant, scalar) uniform Push { CameraSumArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Shares { float shares[]; };          // [N][CAMERA_SHARES]
layout(set = 0, binding = 1, scalar) readonly buffer DPosition { float d_position[]; };   // [N][3]
layout(set = 0, binding = 2, scalar) writeonly buffer Sums { float sums[]; };             // [groups][CAMERA_SUMS]

shared float part[CAMERA_SUMS * CAMERA_SUM_THREADS];

void main() {
    const uint thread = gl_LocalInvocationID.x, step = gl_NumWorkGroups.x * CAMERA_SUM_THREADS;
    float sum[CAMERA_SUMS];
    for (uint k = 0u; k < CAMERA_SUMS; ++k) sum[k] = 0.0;
    for (uint i = gl_WorkGroupID.x * CAMERA_SUM_THREADS + thread; i < args.splat_count; i += step) {
        for (uint k = 0u; k < CAMERA_SHARES; ++k) sum[k] += shares[CAMERA_SHARES * i + k];
        for (uint k = 0u; k < 3u; ++k) sum[CAMERA_SHARES + k] += d_position[3u * i + k];
    }
    for (uint k = 0u; k < CAMERA_SUMS; ++k) part[k * CAMERA_SUM_THREADS + thread] = sum[k];
    for (uint half_size = CAMERA_SUM_THREADS / 2u; half_size > 0u; half_size /= 2u) {
        barrier();
        if (thread < half_size)
            for (uint k = 0u; k < CAMERA_SUMS; ++k)
                part[k * CAMERA_SUM_THREADS + thread] += part[k * CAMERA_SUM_THREADS + thread + half_size];
    }
    barrier();
    if (thread < CAMERA_SUMS)
        sums[gl_WorkGroupID.x * CAMERA_SUMS + thread] = part[thread * CAMERA_SUM_THREADS];
}
