// SPDX-License-Identifier: MIT
// Replaces the colour of every projected splat by its depth, so that the blend that follows gives the mean depth of a
// pixel as the ratio of its first two channels.
// Place: between tile ranges and blend, only in the viewer.
// Work: one thread per splat; later passes do not read the values of splats that are not visible. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/view_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

layout(push_constant, scalar) uniform Push { DepthLightArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer SplatBound { vec4 splat_bound[]; };  // l22, reach, depth, 0
layout(set = 0, binding = 1, scalar) buffer SplatLight { vec4 splat_light[]; };           // rgb, opacity

#include "lib/linear_id.glsl"

void main() {
    const uint i = linear_id();
    if (i >= args.splat_count) return;
    const float share = (splat_bound[i].z - args.near_depth) / (args.far_depth - args.near_depth);
    splat_light[i].rgb = vec3(clamp(share, 0.0, 1.0), 1.0, 0.0);
}
