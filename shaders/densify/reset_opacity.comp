// SPDX-License-Identifier: MIT
// Resets opacities: lowers every opacity to at most the given one and sets its moments to zero.
// Place: between iterations.
// Work: one thread per splat. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/optim_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { ResetOpacityArgs args; };
layout(set = 0, binding = 0, scalar) buffer Opacity { float opacity_logit[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Moments { vec2 moments[]; };

void main() {
    const uint i = linear_id();
    if (i >= args.splat_count) return;
    opacity_logit[i] = min(opacity_logit[i], args.logit_max);
    moments[i] = vec2(0.0);
}
