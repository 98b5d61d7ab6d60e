// SPDX-License-Identifier: MIT
// The photo of a camera where it lies in a frame, as 8-bit pixels, with alpha 0 outside it.
// Place: beside the pictures of kernels in the viewer.
// Work: one thread per pixel. Shared memory: none. Reads the photo, writes B8G8R8A8.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/view_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

layout(push_constant, scalar) uniform Push { DisplayArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Photo { uint photo[]; };  // R in the low byte
layout(set = 0, binding = 1, scalar) writeonly buffer Pixels { uint pixels[]; };

#include "lib/linear_id.glsl"
#include "view/photo.glsl"

void main() {
    const uint i = linear_id();
    if (i >= args.width * args.height) return;
    const vec2 centre = vec2(i % args.width, i / args.width) + 0.5;
    vec3 colour;
    const bool inside =
        photo_at(centre, vec3(args.background_r, args.background_g, args.background_b), colour);
    pixels[i] = inside ? packUnorm4x8(vec4(colour.bgr, 1.0)) : 0u;
}
