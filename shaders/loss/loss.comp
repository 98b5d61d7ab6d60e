// SPDX-License-Identifier: MIT
// (1 - lambda) L1 + lambda (1 - SSIM) and its gradient, forward and backward in one walk.
// Place: after blend. Source: 3DGS equation 7; SSIM of Wang et al. 2004 with an 11x11 Gaussian window of sigma 1.5 and
// zero padding. With a = x + y and b = x - y (x rendered, y photo), SSIM needs four blurred maps: a, b, a^2, b^2. Its
// gradient needs three: those of dS/dmean, dS/dE[a^2] and dS/dE[b^2].
// Work: LANES neighbouring lanes own a strip of LANES * COLUMNS columns of one channel and walk down its rows. Each
// lane keeps COLUMNS columns of the last 11 rows in registers and gets the 5 columns beside its own from its
// neighbours. LOSS_HALO columns and rows on each side are computed twice. There is no intermediate image, no shared
// memory and no barrier; loss_maps.comp is the other way. Reads image and photo; writes d_image and a partial sum for
// each strip.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_shuffle : require

#include "shared/loss_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 8;
layout(constant_id = 1) const int LANES = 8;    // a power of two, at most the subgroup size
layout(constant_id = 2) const int COLUMNS = 8;  // LANES * COLUMNS > 2 * LOSS_HALO
layout(constant_id = 3) const int USE_MASK = 0;  // 1: alpha < 128 makes x = y = 0; otherwise alpha blends y
layout(constant_id = 4) const int USE_ALPHA = 1; // 0: photos are opaque, neither alpha nor background is read

layout(push_constant, scalar) uniform Push { LossArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer ImageIn { float image[]; };  // [3][H][W]
layout(set = 0, binding = 1, scalar) readonly buffer PhotoIn { uint photo[]; };   // [H][W] R G B A
layout(set = 0, binding = 2, scalar) writeonly buffer GradientOut { float d_image[]; };  // [3][H][W]
layout(set = 0, binding = 3, scalar) writeonly buffer PartialOut { vec4 partial[]; };    // [works]

#include "loss/pixel.glsl"
#include "loss/window.glsl"
#include "loss/strip.glsl"

struct Strip {
    int channel;
    int first, last;  // rows [first, last) are this strip's
    int left;         // column of this lane's slot 0
    int slot;         // where this lane's slot 0 lies in the strip
};

Strip strip_of(uint work, int lane) {
    const int index = int(work / 3u), across = int(args.strips);
    Strip s;
    s.channel = int(work % 3u);
    s.first = index / across * int(args.rows);
    s.last = min(s.first + int(args.rows), int(args.height));
    s.slot = lane * COLUMNS;
    s.left = index % across * (LANES * COLUMNS - 2 * LOSS_HALO) - LOSS_HALO + s.slot;
    return s;
}

// Columns that this strip alone owns.
bool owns(Strip s, int k) {
    return s.slot + k >= LOSS_HALO && s.slot + k < LANES * COLUMNS - LOSS_HALO;
}

// SSIM of one row and its derivatives, 0 outside the image. Returns the sum over owned columns.
float ssim_row(Strip s, int row, float mean_a[COLUMNS], float mean_b[COLUMNS], float mean_aa[COLUMNS],
               float mean_bb[COLUMNS], out float d_mean[COLUMNS], out float d_aa[COLUMNS],
               out float d_bb[COLUMNS]) {
    float sum = 0.0;
    [[unroll]] for (int k = 0; k < COLUMNS; ++k) {
        const bool inside = in_image(s.left + k, row);
        vec3 d;
        const float value = ssim(mean_a[k], mean_b[k], mean_aa[k], mean_bb[k], d);
        d_mean[k] = inside ? d.x : 0.0;
        d_aa[k] = inside ? d.y : 0.0;
        d_bb[k] = inside ? d.z : 0.0;
        sum += inside && owns(s, k) && row >= s.first && row < s.last ? value : 0.0;
    }
    return sum;
}

void main() {
    const uint clusters = gl_SubgroupSize / uint(LANES);
    const uint work = (gl_WorkGroupID.x * gl_NumSubgroups + gl_SubgroupID) * clusters +
                      gl_SubgroupInvocationID / uint(LANES);
    if (work >= args.works) return;
    const Strip s = strip_of(work, int(gl_SubgroupInvocationID) & (LANES - 1));

    float a[11][COLUMNS], b[11][COLUMNS], past[3][10][COLUMNS];
    [[unroll]] for (int k = 0; k < COLUMNS; ++k) {
        [[unroll]] for (int j = 0; j < 11; ++j) a[j][k] = b[j][k] = 0.0;
        [[unroll]] for (int j = 0; j < 10; ++j) past[0][j][k] = past[1][j][k] = past[2][j][k] = 0.0;
    }
    vec4 sums = vec4(0.0);
    // Rows above the image are 0, as are the sums at the start.
    for (int row = max(s.first - LOSS_HALO, 0); row < s.last + LOSS_HALO; ++row) {
        float mean_a[COLUMNS], mean_b[COLUMNS], mean_aa[COLUMNS], mean_bb[COLUMNS];
        [[unroll]] for (int k = 0; k < COLUMNS; ++k) {
            [[unroll]] for (int j = 0; j < 10; ++j) {
                a[j][k] = a[j + 1][k];
                b[j][k] = b[j + 1][k];
            }
            const vec2 ab = sum_and_difference(s.channel, s.left + k, row);
            a[10][k] = ab.x;
            b[10][k] = ab.y;
            blur_down(a, k, mean_a[k], mean_aa[k]);
            blur_down(b, k, mean_b[k], mean_bb[k]);
        }
        blur_across(mean_a);
        blur_across(mean_b);
        blur_across(mean_aa);
        blur_across(mean_bb);
        float d_mean[COLUMNS], d_aa[COLUMNS], d_bb[COLUMNS];
        sums.y += ssim_row(s, row - 5, mean_a, mean_b, mean_aa, mean_bb, d_mean, d_aa, d_bb);
        blur_across(d_mean);
        blur_across(d_aa);
        blur_across(d_bb);
        const int out_row = row - LOSS_HALO;
        [[unroll]] for (int k = 0; k < COLUMNS; ++k) {
            const float g = step_down(past[0], k, d_mean[k]) + a[0][k] * step_down(past[1], k, d_aa[k]) +
                            b[0][k] * step_down(past[2], k, d_bb[k]);
            if (owns(s, k) && out_row >= s.first && s.left + k < int(args.width)) {
                const uint at = uint(out_row) * args.width + uint(s.left + k);
                const bool counts = is_compared(at);
                sums += counts ? pixel_sums(vec2(a[0][k], b[0][k])) : vec4(0.0);
                d_image[uint(s.channel) * args.width * args.height + at] =
                    counts ? args.l1_scale * sign(b[0][k]) + args.ssim_scale * g : 0.0;
            }
        }
    }
    for (uint other = uint(LANES) / 2u; other > 0u; other /= 2u) sums += subgroupShuffleXor(sums, other);
    if (s.slot == 0) partial[work] = sums;
}
