// SPDX-License-Identifier: MIT
// Finds where each splat of the next generation comes from. A live splat stays in its place; a dead one's place and the
// places behind the last go to the splats that were drawn. A drawn splat counts as new itself, because it changes, too.
// Place: mcmc, after the draws and the scan of the dead.
// Work: one thread per new splat. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/optim_args.h"
#include "shared/strategy_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { RelocationArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Dead { uint dead[]; };
layout(set = 0, binding = 1, scalar) readonly buffer DeadOffset { uint dead_offset[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Drawn { uint drawn[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Copies { uint copies[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Sources { uvec2 sources[]; };  // old index, DENSIFY_*

void main() {
    const uint i = linear_id();
    if (i >= args.splats_after) return;
    uvec2 source = uvec2(i, DENSIFY_CLONE);
    if (i >= args.splat_count) {
        source.x = drawn[args.dead_count + i - args.splat_count];
    } else if (dead[i] == 1u) {
        source.x = drawn[dead_offset[i]];
    } else if (copies[i] == 0u) {
        source.y = DENSIFY_KEEP;
    }
    sources[i] = source;
}
