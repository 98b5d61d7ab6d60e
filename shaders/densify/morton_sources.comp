// SPDX-License-Identifier: MIT
// The sorted order in the form that gather_attribute reads: every splat is kept and none is new.
// Place: after the sort by morton_key.
// Work: one thread per splat. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/optim_args.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { SplatArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Order { uint order[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Sources { uvec2 sources[]; };

void main() {
    const uint i = linear_id();
    if (i < args.splat_count) sources[i] = uvec2(order[i], DENSIFY_KEEP);
}
