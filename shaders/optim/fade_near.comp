// SPDX-License-Identifier: MIT
// Lowers the opacity of splats that stand nearer to a camera than the scene does, as project_backward.comp does after
// its own step.
// Place: after adam_update, once for each view.
// Work: one thread per splat. Shared memory: none. Does nothing when a frame overflowed its intersection buffers, nor
// to a splat with a gradient that was not finite.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/optim_args.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

layout(push_constant, scalar) uniform Push { FadeNearArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Cameras { CameraData cameras[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Position { vec3 position[]; };
layout(set = 0, binding = 2, scalar) buffer OpacityLogit { float opacity_logit[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Views { vec2 views[]; };  // [N] sum of norms, views
layout(set = 0, binding = 4, scalar) readonly buffer Status { FrameStatus status; };

#include "shared/limits.h"
#include "lib/covariance.glsl"
#include "lib/linear_id.glsl"
#include "optim/fading.glsl"

void main() {
    const uint i = linear_id();
    if (i >= args.splat_count || status.overflow != 0u || views[i].y < 0.0) return;
    if (stands_near(cameras[args.camera_index], i, args.clearance)) opacity_logit[i] -= FADING;
}
