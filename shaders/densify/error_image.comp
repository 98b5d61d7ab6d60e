// How far the picture is from the photo: the mean over the channels of |x - y|, in the first of three planes.
// In place of dL/dimage it makes blend_backward sum, for each splat, the error weighted as the splat is blended.
// Place: budget, before the loss, in some iterations. Work: one thread a pixel. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/strategy_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;
layout(constant_id = 1) const int USE_MASK = 0;   // as in loss.comp
layout(constant_id = 2) const int USE_ALPHA = 1;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { ErrorImageArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer ImageIn { float image[]; };  // [3][H][W]
layout(set = 0, binding = 1, scalar) readonly buffer PhotoIn { uint photo[]; };   // [H][W] R G B A
layout(set = 0, binding = 2, scalar) writeonly buffer ErrorOut { float error[]; };  // [3][H][W]

void main() {
    const uint at = linear_id(), plane = args.width * args.height;
    if (at >= plane) return;
    const vec4 rgba = unpackUnorm4x8(photo[at]);
    vec3 y = rgba.rgb;
    if (USE_ALPHA == 1 && USE_MASK == 0)
        y = mix(vec3(args.background_r, args.background_g, args.background_b), y, rgba.a);
    const vec3 x = vec3(image[at], image[plane + at], image[2u * plane + at]);
    const vec3 apart = abs(clamp(x, 0.0, 1.0) - y);
    const bool counts = USE_ALPHA == 0 || USE_MASK == 0 || photo[at] >= 0x80000000u;
    error[at] = counts ? (apart.r + apart.g + apart.b) / 3.0 : 0.0;
    error[plane + at] = 0.0;
    error[2u * plane + at] = 0.0;
}
