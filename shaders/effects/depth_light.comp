// SPDX-License-Identifier: MIT
// Replaces the colour of each projected splat by (depth, 1, 0). Blended again over black, the picture then holds sum w
// z and sum w, whose quotient is the expected depth.
// Place: after a frame, before blend runs once more.
// Work: one thread per splat. Shared memory: none. Reads depths; writes the colours of the projected splats.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { SplatArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer SplatBound { vec4 splat_bound[]; };  // l22, reach, depth, 0
layout(set = 0, binding = 1, scalar) buffer SplatLight { vec4 splat_light[]; };           // rgb, opacity

void main() {
    const uint i = linear_id();
    if (i >= args.splat_count) return;
    splat_light[i].rgb = vec3(splat_bound[i].z, 1.0, 0.0);
}
