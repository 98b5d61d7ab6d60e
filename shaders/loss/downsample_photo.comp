// SPDX-License-Identifier: MIT
// Makes a smaller photo: every pixel is the mean of the area that it covers, with colours weighted by their alpha. With
// DEPTHS the depths follow, each taken from the measured pixel nearest to the middle of the area, because a mean of two
// surfaces lies on neither.
// Place: the resolution ramp, once for each photo and step.
// Work: one thread per pixel of the result. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/strategy_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;
layout(constant_id = 1) const int DEPTHS = 0;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { DownsampleArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer PhotoIn { uint photo[]; };   // [H][W] R G B A
layout(set = 0, binding = 1, scalar) writeonly buffer PhotoOut { uint smaller[]; };

float nearest_depth(uvec2 first, uvec2 last, vec2 middle) {
    float depth = 0.0, least = 1e30;
    for (uint y = first.y; y < last.y; ++y)
        for (uint x = first.x; x < last.x; ++x) {
            const vec2 away = vec2(x, y) + 0.5 - middle;
            const float measured = uintBitsToFloat(photo[args.width * args.height + y * args.width + x]);
            if (!(measured > 0.0) || dot(away, away) >= least) continue;
            least = dot(away, away);
            depth = measured;
        }
    return depth;
}

void main() {
    const uint at = linear_id();
    if (at >= args.out_width * args.out_height) return;
    const vec2 size = vec2(args.width, args.height) / vec2(args.out_width, args.out_height);
    const vec2 begin = vec2(at % args.out_width, at / args.out_width) * size, end = begin + size;
    const uvec2 first = uvec2(begin), last = min(uvec2(ceil(end)), uvec2(args.width, args.height));
    vec4 sum = vec4(0.0);
    float area = 0.0;
    for (uint y = first.y; y < last.y; ++y) {
        const float height = min(end.y, float(y + 1u)) - max(begin.y, float(y));
        for (uint x = first.x; x < last.x; ++x) {
            const float covered = max(height * (min(end.x, float(x + 1u)) - max(begin.x, float(x))), 0.0);
            const vec4 rgba = unpackUnorm4x8(photo[y * args.width + x]);
            sum += covered * vec4(rgba.rgb * rgba.a, rgba.a);
            area += covered;
        }
    }
    const vec3 colour = sum.a > 0.0 ? sum.rgb / sum.a : vec3(0.0);
    smaller[at] = packUnorm4x8(vec4(colour, sum.a / area));
    if (DEPTHS == 1)
        smaller[args.out_width * args.out_height + at] =
            floatBitsToUint(nearest_depth(first, last, 0.5 * (begin + end)));
}
