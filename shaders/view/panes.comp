// SPDX-License-Identifier: MIT
// Writes one strip of pictures side by side: a picture, or its difference from another one as heat.
// Place: after the pictures were drawn, in the viewer.
// Work: one thread per pixel of the strip. Shared memory: none. Reads two pictures, B8G8R8A8, with alpha 0 where a
// picture has nothing (a photo's camera sees less than the window); writes B8G8R8A8.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/view_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

layout(push_constant, scalar) uniform Push { PaneArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Picture { uint picture[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Other { uint other[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Pixels { uint pixels[]; };

#include "lib/linear_id.glsl"
#include "view/heat.glsl"

// The share of a picture's light where there is no photo or error to show; it must not be mistaken for one.
const float BESIDE = 0.35;

void main() {
    const uint i = linear_id();
    const uint columns = args.right - args.left;
    if (i >= columns * args.height) return;
    const uint at = i / columns * args.width + args.left + i % columns;
    const vec4 own = unpackUnorm4x8(picture[at]);
    const vec4 second = unpackUnorm4x8(other[at]);
    const bool both = own.a > 0.5 && second.a > 0.5;
    vec3 bgr = own.rgb;
    if (own.a <= 0.5)
        bgr = BESIDE * second.rgb;
    else if (args.difference == 1)
        bgr = both ? heat(dot(abs(own.rgb - second.rgb), vec3(1.0 / 3.0)) / args.heat_max).bgr : BESIDE * own.rgb;
    pixels[at] = packUnorm4x8(vec4(bgr, 1.0));
}
