// SPDX-License-Identifier: MIT
// Gathers the visible splats in file order: their depth as a sortable key, and their index.
// Place: after the scan of the visible flags.
// Work: one thread per splat. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;
layout(constant_id = 1) const int SHORT_KEYS = 0;  // 1: of SHORT_DEPTH_BITS; deeper ones raise a flag

#include "lib/depth.glsl"
#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { CompactArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Visible { uint visible[]; };
layout(set = 0, binding = 1, scalar) readonly buffer VisibleOffset { uint visible_offset[]; };
layout(set = 0, binding = 2, scalar) readonly buffer SplatBound { vec4 splat_bound[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer DepthKey { uint depth_key[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer SplatFromDepth { uint splat_from_depth[]; };
layout(set = 0, binding = 5, scalar) buffer Status { FrameStatus status; };  // with SHORT_KEYS

void main() {
    const uint i = linear_id();
    if (i >= args.splat_count || visible[i] == 0u) return;
    const uint slot = visible_offset[i];
    const uint key = SHORT_KEYS == 1 ? short_sort_key(splat_bound[i].z, args.near_plane)
                                     : sort_key(splat_bound[i].z, args.near_plane);
    if (SHORT_KEYS == 1 && key >= 1u << SHORT_DEPTH_BITS) atomicOr(status.overflow, OVERFLOW_DEPTHS);
    depth_key[slot] = key;
    splat_from_depth[slot] = i;
}
