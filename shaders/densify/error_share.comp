// Adds a splat's share of one photo's error, summed over its intersections, to what it has of the other photos.
// Place: budget, after blend_backward of the error image. Work: one thread a splat. Shared memory: none.
// Does nothing when the frame overflowed its intersection buffers: the host repeats it.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/render_args.h"
#include "shared/strategy_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { ErrorShareArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer IntersectionCount { uint intersection_count[]; };
layout(set = 0, binding = 1, scalar) readonly buffer FirstIntersection { uint first_intersection[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Status { FrameStatus status; };
layout(set = 0, binding = 8, scalar) buffer Share { vec2 share[]; };  // of the mean errors; 1: seen at all

#define PARTIALS_BINDING 2
#include "lib/partials.glsl"

void main() {
    const uint i = linear_id();
    if (i >= args.splat_count || status.overflow != 0u || intersection_count[i] == 0u) return;
    const uint begin = first_intersection[i], end = begin + intersection_count[i];
    float sum = 0.0;
    for (uint block = begin; block < end; block += 32768u)  // some drivers end loops at 65,535
        for (uint e = block; e < min(block + 32768u, end); ++e) sum += load_partial(e, 1u).y;
    share[i] = vec2(share[i].x + args.scale * sum, 1.0);
}
