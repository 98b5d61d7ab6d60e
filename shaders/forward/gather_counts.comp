// SPDX-License-Identifier: MIT
// Brings the intersection counts into depth order, ready for their scan.
// Place: after the depth sort.
// Work: one thread per visible splat. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { SplatArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Status { FrameStatus status; };
layout(set = 0, binding = 1, scalar) readonly buffer SplatFromDepth { uint splat_from_depth[]; };
layout(set = 0, binding = 2, scalar) readonly buffer IntersectionCount { uint intersection_count[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer CountByDepth { uint count_by_depth[]; };

void main() {
    const uint rank = linear_id();
    if (rank >= min(status.visible, args.splat_count)) return;
    count_by_depth[rank] = intersection_count[splat_from_depth[rank]];
}
