// SPDX-License-Identifier: MIT
// The gradient of what a loss says of depths. w is the weight of each splat in a pixel, z its depth along the optical
// axis, D = sum w z / sum w the pixel's depth.
// Measured depths (MEASURED): the absolute difference between D and the depth that was measured there, in world units.
// It counts where there is one and the splats cover at least half of the pixel; with less there is no surface to
// compare.
// Distortion (DEPTH_SPREAD): p / (p + k^2), with p the sum over pairs of w_i w_j ((z_i - z_j) / D)^2, in which D is a
// constant, and k the DISTORTION_WIDTH. p is 2 (W sum(w z z) - sum(w z)^2) / D^2 whatever z is counted from;
// lib/depth_sum.glsl says from what.
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
layout(constant_id = 3) const int MEASURED = 1;

#include "lib/depth_sum.glsl"
#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { DepthLossArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer ImageIn { float image[]; };  // [4][H W], [6] with DEPTH_SPREAD
layout(set = 0, binding = 1, scalar) readonly buffer FinalT { float final_transmittance[]; };
layout(set = 0, binding = 2, scalar) readonly buffer PhotoIn { uint photo[]; };  // [H W] R G B A, then [H W] depths
layout(set = 0, binding = 3, scalar) buffer Gradient { float d_image[]; };       // [5][H W], [7] with DEPTH_SPREAD

const float LEAST_COVER = 0.5;

void main() {
    const uint p = linear_id();
    if (p >= args.pixels) return;
    const float cover = 1.0 - final_transmittance[p];
    const bool known = USE_ALPHA == 0 || photo[p] >= 0x80000000u;
    float measured = 0.0, d_sum = 0.0, d_cover = 0.0, d_square = 0.0, first = 0.0;
    if (DEPTH_SPREAD == 1) first = image[FIRST_DEPTH_PLANE * args.pixels + p];
    if (MEASURED == 1 && args.measured == 1u) measured = uintBitsToFloat(photo[args.pixels + p]);
    if (MEASURED == 1 && measured > 0.0 && cover >= LEAST_COVER && known) {
        const float depth = image[DEPTH_PLANE * args.pixels + p] / cover;
        d_sum = args.scale * sign(first + depth - measured) / cover;
        d_cover = -d_sum * depth;
    }
    if (DEPTH_SPREAD == 1 && cover > 0.0 && known) {
        const float sum = image[DEPTH_PLANE * args.pixels + p];
        const float depth = first + sum / cover;
        const float square = image[SQUARE_PLANE * args.pixels + p];
        const float pairs = 2.0 * max(cover * square - sum * sum, 0.0) / (depth * depth);
        const float width = float(DISTORTION_WIDTH * DISTORTION_WIDTH), near = width / (pairs + width);
        const float share = 2.0 * args.distortion_scale * near * near / (width * depth * depth);
        d_cover += share * square;
        d_sum -= 2.0 * share * sum;
        d_square = share * cover;
    }
    const uint cover_at = 3u * args.pixels + p;
    d_image[cover_at] = ADD == 1 ? d_image[cover_at] + d_cover : d_cover;
    d_image[DEPTH_GRADIENT_PLANE * args.pixels + p] = d_sum;
    if (DEPTH_SPREAD == 1) {
        d_image[SQUARE_GRADIENT_PLANE * args.pixels + p] = d_square;
        d_image[FIRST_DEPTH_GRADIENT_PLANE * args.pixels + p] = first;
    }
}
