// SPDX-License-Identifier: MIT
// Changes a splat where several take its place and the picture should stay the same: each transmits the count-th root
// of what the one transmitted, and is scaled by a factor of the kernel's.
// Place: mcmc, after the gathers. Source: 3DGS-MCMC (arXiv 2404.09591) equation 9; docs/math.md and
// engine/kernels/relocation_table.h have it for any kernel.
// Work: one thread per new splat. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/kernel_forms.h"
#include "shared/limits.h"
#include "shared/optim_args.h"
#include "shared/strategy_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"
#include "densify/shape_rows.glsl"

layout(push_constant, scalar) uniform Push { RelocationArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Sources { uvec2 sources[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Copies { uint copies[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Table { float scale_table[]; };  // [SHAPES][counts][opacities]
layout(set = 0, binding = 3, scalar) buffer LogScale { vec3 log_scale[]; };
layout(set = 0, binding = 4, scalar) buffer Opacity { float opacity_logit[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Shape { float shape[]; };  // with SHAPES > 1

// -log(1 - opacity), exact to the last bits for small opacities, too.
float absorption(float logit) {
    if (logit > 10.0) return logit + exp(-logit);
    const float e = exp(logit);
    return e < 0.01 ? e * (1.0 - e * (0.5 - e / 3.0)) : log(1.0 + e);
}

// The inverse: log(exp(a) - 1) = log(a) + a/2 + log(sinh(a/2) / (a/2)), a series where exp(a) - 1 would cancel.
float logit_of(float a) {
    return a > 0.5 ? log(exp(a) - 1.0) : log(a) + 0.5 * a + a * a * (1.0 / 24.0 - a * a / 2880.0);
}

// Interpolates between the columns, which are at (k + 1/2) / RELOCATION_OPACITIES, and takes 1 at opacity 0.
float scale_factor(float opacity, uint count, uint shape) {
    const uint row = (shape * RELOCATION_COUNTS + count - 1u) * RELOCATION_OPACITIES;
    const float at = opacity * float(RELOCATION_OPACITIES) - 0.5;
    if (at < 0.0) return mix(1.0, scale_table[row], opacity * 2.0 * float(RELOCATION_OPACITIES));
    const uint k = min(uint(at), RELOCATION_OPACITIES - 2u);
    return mix(scale_table[row + k], scale_table[row + k + 1u], min(at - float(k), 1.0));
}

void main() {
    const uint i = linear_id();
    if (i >= args.splats_after || sources[i].y == DENSIFY_KEEP) return;
    const uint count = min(copies[sources[i].x] + 1u, RELOCATION_COUNTS);
    const float limit = log(ALPHA_MAX / (1.0 - ALPHA_MAX));  // a larger opacity is never blended
    const float logit = min(opacity_logit[i], limit);
    const float opacity = 1.0 / (1.0 + exp(-logit));
    float factor, part;
    if (SHAPES > 1u) {
        const uint row = shape_row(shape[i], part);
        factor = mix(scale_factor(opacity, count, row), scale_factor(opacity, count, row + 1u), part);
    } else {
        factor = scale_factor(opacity, count, 0u);
    }
    opacity_logit[i] = logit_of(absorption(logit) / float(count));
    log_scale[i] += log(factor);
}
