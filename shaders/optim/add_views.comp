// SPDX-License-Identifier: MIT
// Adds what the views of a step show of each splat to the sums that density control reads.
// Place: after adam_update.
// Work: one thread per splat. Shared memory: none. Does nothing when a frame overflowed its intersection buffers; a
// splat with a gradient that was not finite adds nothing.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/optim_args.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { SplatArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Views { vec2 views[]; };        // [N] sum of norms, views
layout(set = 0, binding = 1, scalar) buffer GradientSum { vec2 gradient_sum[]; };  // [N] the same
layout(set = 0, binding = 2, scalar) readonly buffer Status { FrameStatus status; };

void main() {
    const uint i = linear_id();
    if (i >= args.splat_count || status.overflow != 0u || views[i].y <= 0.0) return;
    gradient_sum[i] += views[i];
}
