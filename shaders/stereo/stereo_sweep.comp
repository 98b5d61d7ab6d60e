// SPDX-License-Identifier: MIT
// PatchMatch on a chessboard (Barnes et al. 2009; Galliani et al. 2015): each pixel of one colour tries the planes of
// the better of two pixels of the other colour at each of four distances, and then random changes of its best plane.
// Place: several times for each photo, for each colour.
// Work: one thread per pixel of the colour. Shared memory: none. Reads greys, sources and the planes of the other
// colour; writes those of its own.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/stereo_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"
#include "lib/random.glsl"

layout(push_constant, scalar) uniform Push { StereoArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer GreyIn { uint grey[]; };
layout(set = 0, binding = 1, scalar) readonly buffer SourceIn { StereoSource source[]; };
layout(set = 0, binding = 2, scalar) buffer Planes { vec4 planes[]; };  // [H][W] plane, cost

#include "stereo/stereo_cost.glsl"

const ivec2 PAIRS[4] = ivec2[](ivec2(1, 0), ivec2(0, 1), ivec2(5, 0), ivec2(0, 5));

void main() {
    const uint half_width = (args.width + 1u) / 2u, id = linear_id();
    if (id >= half_width * args.height) return;
    const int y = int(id / half_width), x = 2 * int(id % half_width) + int((uint(y) + args.colour) & 1u);
    if (x >= int(args.width)) return;
    const uint at = uint(y) * args.width + uint(x);
    const StereoWindow window = stereo_window(ivec2(x, y));
    if ((grey[at] & 255u) == 0u || !shows_something(window)) return;
    vec4 best = planes[at];
    for (int pair = 0; pair < 4; ++pair) {
        vec4 better = vec4(0.0, 0.0, 0.0, STEREO_NO_COST);
        for (int side = -1; side <= 1; side += 2) {
            const ivec2 by = side * PAIRS[pair], p = ivec2(x, y) + by;
            if (p.x < 0 || p.y < 0 || p.x >= int(args.width) || p.y >= int(args.height)) continue;
            const vec4 other = planes[p.y * int(args.width) + p.x];
            if (other.w < better.w) better = vec4(other.x - dot(other.yz, vec2(by)), other.yzw);
        }
        if (better.w >= STEREO_NO_COST) continue;
        const float cost = stereo_cost(better.xyz, window);
        if (cost < best.w) best = vec4(better.xyz, cost);
    }
    uint state = random_seed(args.seed, at);
    for (int k = 0; k < 2; ++k) {
        vec3 plane = best.xyz;
        const float depth = 2.0 * random_uniform(state) - 1.0, a = 2.0 * random_uniform(state) - 1.0,
                    b = 2.0 * random_uniform(state) - 1.0;
        plane.x += args.reach * depth * (args.nearest - args.farthest);
        if (k == 1) plane.yz += 8.0 * args.reach * args.steepest * plane.x * vec2(a, b);
        const float cost = stereo_cost(plane, window);
        if (cost < best.w) best = vec4(plane, cost);
    }
    planes[at] = best;
}
