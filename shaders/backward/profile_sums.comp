// SPDX-License-Identifier: MIT
// Adds up what profile_gradient.comp leaves of each tile, in a fixed order, and adds the result to the sums of earlier
// iterations. Does nothing when a frame overflowed its intersection buffers.
// Work: one workgroup, PROFILE_ADD_STRANDS threads for each sum: a thread adds every so-many-th row, a tree in shared
// memory the threads.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/profile_args.h"
#include "shared/render_args.h"

layout(local_size_x = PROFILE_SUMS * PROFILE_ADD_STRANDS) in;

layout(push_constant, scalar) uniform Push { ProfileSumArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Rows { float rows[]; };  // [rows][PROFILE_SUMS]
layout(set = 0, binding = 1, scalar) readonly buffer Status { FrameStatus status; };
layout(set = 0, binding = 2, scalar) buffer Sums { float sums[]; };  // [PROFILE_SUMS]

shared float part[PROFILE_SUMS * PROFILE_ADD_STRANDS];

void main() {
    const uint thread = gl_LocalInvocationID.x, k = thread % PROFILE_SUMS;
    float sum = 0.0;
    for (uint row = thread / PROFILE_SUMS; row < args.rows; row += PROFILE_ADD_STRANDS)
        sum += rows[row * PROFILE_SUMS + k];
    part[thread] = sum;
    for (uint half_size = PROFILE_ADD_STRANDS / 2u; half_size > 0u; half_size /= 2u) {
        barrier();
        if (thread < half_size * PROFILE_SUMS) part[thread] += part[thread + half_size * PROFILE_SUMS];
    }
    barrier();
    if (thread < PROFILE_SUMS && status.overflow == 0u) sums[thread] += part[thread];
}
