// SPDX-License-Identifier: MIT
// The gradient of the depth loss, which is the absolute difference between a pixel's depth D = sum w z / sum w (w the
// weight of each splat, z its depth along the optical axis) and the depth that was measured there, in world units. It
// counts where there is a measured depth and the splats cover at least half of the pixel; with less there is no surface
// to compare.
// Place: after the loss of the colours, before blend_backward.
// Work: one thread per pixel. Shared memory: none. Reads the picture, transmittance and photo; writes the planes of
// d_image behind the colours. With ADD it adds to that of 1 - transmittance.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/loss_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;
// 1: no depth counts where the photo is masked or shows the background
layout(constant_id = 1) const int USE_ALPHA = 1;
layout(constant_id = 2) const int ADD = 0;

#include "lib/depth_sum.glsl"
#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { DepthLossArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer ImageIn { float image[]; };  // [4][H W]
layout(set = 0, binding = 1, scalar) readonly buffer FinalT { float final_transmittance[]; };
layout(set = 0, binding = 2, scalar) readonly buffer PhotoIn { uint photo[]; };  // [H W] R G B A, then [H W] depths
layout(set = 0, binding = 3, scalar) buffer Gradient { float d_image[]; };       // [5][H W]

const float LEAST_COVER = 0.5;

void main() {
    const uint p = linear_id();
    if (p >= args.pixels) return;
    const float cover = 1.0 - final_transmittance[p];
    float measured = 0.0;
    if (args.measured == 1u) measured = uintBitsToFloat(photo[args.pixels + p]);
    const bool counts = measured > 0.0 && cover >= LEAST_COVER && (USE_ALPHA == 0 || photo[p] >= 0x80000000u);
    float d_sum = 0.0, d_cover = 0.0;
    if (counts) {
        const float depth = image[DEPTH_PLANE * args.pixels + p] / cover;
        d_sum = args.scale * sign(depth - measured) / cover;
        d_cover = -d_sum * depth;
    }
    const uint cover_at = 3u * args.pixels + p;
    d_image[cover_at] = ADD == 1 ? d_image[cover_at] + d_cover : d_cover;
    d_image[DEPTH_GRADIENT_PLANE * args.pixels + p] = d_sum;
}
