// SPDX-License-Identifier: MIT
// A first plane for each pixel: the best of several that face the camera, at inverse depths drawn from as many parts of
// the range.
// Place: once for each photo, before the sweeps.
// Work: one thread per pixel. Shared memory: none. Reads greys and sources; writes planes.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/stereo_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;
layout(constant_id = 1) const uint STARTS = 16;

#include "lib/linear_id.glsl"
#include "lib/random.glsl"

layout(push_constant, scalar) uniform Push { StereoArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer GreyIn { uint grey[]; };
layout(set = 0, binding = 1, scalar) readonly buffer SourceIn { StereoSource source[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer PlaneOut { vec4 planes[]; };  // [H][W] plane, cost

#include "stereo/stereo_cost.glsl"

void main() {
    const uint at = linear_id();
    if (at >= args.width * args.height) return;
    const ivec2 pixel = ivec2(at % args.width, at / args.width);
    vec4 best = vec4(args.farthest, 0.0, 0.0, STEREO_NO_COST);
    const StereoWindow window = stereo_window(pixel);
    if ((grey[at] & 255u) != 0u && shows_something(window)) {
        uint state = random_seed(args.seed, at);
        for (uint i = 0u; i < STARTS; ++i) {
            const float share = (float(i) + random_uniform(state)) / float(STARTS);
            const vec3 plane = vec3(mix(args.farthest, args.nearest, share), 0.0, 0.0);
            const float cost = stereo_cost(plane, window);
            if (cost < best.w) best = vec4(plane, cost);
        }
    }
    planes[at] = best;
}
