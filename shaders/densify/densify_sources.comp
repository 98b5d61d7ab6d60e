// SPDX-License-Identifier: MIT
// Finds where each splat of the next generation comes from. Kept splats close up in order; a clone's copy and a split's
// second child go behind them.
// Place: after the scans of keep and grow.
// Work: one thread per old splat. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/optim_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { DensifyArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Action { uint action[]; };
layout(set = 0, binding = 1, scalar) readonly buffer KeepOffset { uint keep_offset[]; };
layout(set = 0, binding = 2, scalar) readonly buffer GrowOffset { uint grow_offset[]; };
layout(set = 0, binding = 3, scalar) readonly buffer KeepTotal { uint keep_total; };
layout(set = 0, binding = 4, scalar) writeonly buffer Sources { uvec2 sources[]; };  // old index, DENSIFY_*

void main() {
    const uint i = linear_id();
    if (i >= args.splat_count) return;
    const uint what = action[i];
    if (what == DENSIFY_PRUNE) return;
    const bool grows = what != DENSIFY_KEEP;
    const bool splits = grows && what == DENSIFY_SPLIT;
    sources[keep_offset[i]] = uvec2(i, splits ? DENSIFY_SPLIT : DENSIFY_KEEP);
    if (grows) sources[keep_total + grow_offset[i]] = uvec2(i, what);
}
