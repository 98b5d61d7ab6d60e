// SPDX-License-Identifier: MIT
// Brings an image of half the size to full size by linear interpolation: the accuracy setting "resolution 1/2". Pixel
// centres are at +0.5 in both; outside the outermost centres the nearest one counts.
// Place: after blend.
// Work: one thread per pixel of the result. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { UpsampleArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Small { float small[]; };      // [3][small height][small width]
layout(set = 0, binding = 1, scalar) writeonly buffer Result { float result[]; };  // [3][H][W]

void main() {
    const uint i = linear_id();
    const uint plane = args.width * args.height;
    if (i >= plane) return;
    const vec2 size = vec2(args.small_width, args.small_height);
    const vec2 at = vec2(i % args.width, i / args.width) + 0.5;
    const vec2 p = clamp(at * size / vec2(args.width, args.height) - 0.5, vec2(0.0), size - 1.0);
    const uvec2 low = uvec2(p), high = min(low + 1u, uvec2(size) - 1u);
    const vec2 t = p - vec2(low);
    for (uint c = 0u; c < 3u; ++c) {
        const uint base = c * args.small_width * args.small_height;
        const uint top = base + low.y * args.small_width, bottom = base + high.y * args.small_width;
        result[c * plane + i] = mix(mix(small[top + low.x], small[top + high.x], t.x),
                                    mix(small[bottom + low.x], small[bottom + high.x], t.x), t.y);
    }
}
