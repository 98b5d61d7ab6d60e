// Moves one attribute to the next generation's order; new splats copy their source, or start at zero (moments).
// Place: after densify_sources, once an attribute. Work: one thread a float. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/optim_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { GatherArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Sources { uvec2 sources[]; };
layout(set = 0, binding = 1, scalar) readonly buffer From { float from[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer To { float to[]; };

void main() {
    const uint at = linear_id();
    const uint splat = at / args.stride;
    if (splat >= args.out_count) return;
    const uvec2 source = sources[splat];
    const bool zero = args.clear_new == 1u && source.y != DENSIFY_KEEP;
    to[at] = zero ? 0.0 : from[source.x * args.stride + at % args.stride];
}
