// SPDX-License-Identifier: MIT
// Moves and shrinks the children of split splats: their offset is drawn from the kernel's own radial density in the
// parent's frame, and their scale is the parent's / 1.6.
// Place: after the gathers. Source: docs/math.md, Density control; 3DGS section 5.
// Work: one thread per new splat. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/kernel_forms.h"
#include "shared/limits.h"
#include "shared/optim_args.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;
layout(constant_id = 1) const uint QUANTILES = 256;

#include "lib/covariance.glsl"
#include "lib/linear_id.glsl"
#include "lib/random.glsl"
#include "densify/shape_rows.glsl"

layout(push_constant, scalar) uniform Push { DensifyArgs args; };  // splat_count: the count after
layout(set = 0, binding = 0, scalar) readonly buffer Sources { uvec2 sources[]; };
layout(set = 0, binding = 1, scalar) buffer Position { vec3 position[]; };
layout(set = 0, binding = 2, scalar) buffer LogScale { vec3 log_scale[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Rotation { vec4 rotation[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Quantile { float radius_quantile[]; };  // [SHAPES][QUANTILES]
layout(set = 0, binding = 5, scalar) readonly buffer Shape { float shape[]; };  // with SHAPES > 1

const float SPLIT_SHRINK = 1.6;

// Draws a radius by linear interpolation between the quantiles at (k + 0.5) / QUANTILES.
float draw_radius(float u, uint row) {
    const float at = clamp(u * float(QUANTILES) - 0.5, 0.0, float(QUANTILES - 1u));
    const uint k = min(uint(at), QUANTILES - 2u);
    return mix(radius_quantile[row * QUANTILES + k], radius_quantile[row * QUANTILES + k + 1u], at - float(k));
}

void main() {
    const uint i = linear_id();
    if (i >= args.splat_count || sources[i].y != DENSIFY_SPLIT) return;
    uint state = random_seed(args.seed, i);
    const float z = 2.0 * random_uniform(state) - 1.0;
    const float angle = 6.28318530718 * random_uniform(state);
    const float across = sqrt(max(1.0 - z * z, 0.0));
    const float u = random_uniform(state);
    float radius, part;
    if (SHAPES > 1u) {
        const uint row = shape_row(shape[i], part);
        radius = mix(draw_radius(u, row), draw_radius(u, row + 1u), part);
    } else {
        radius = draw_radius(u, 0u);
    }
    const vec3 offset = radius * vec3(across * cos(angle), across * sin(angle), z);
    vec4 unit;
    float norm;
    normalise_rotation(rotation[i], unit, norm);
    const vec3 s = exp(clamp(log_scale[i], -LOG_SCALE_LIMIT, LOG_SCALE_LIMIT));
    position[i] += rotation_matrix(unit) * (offset * s);
    log_scale[i] -= log(SPLIT_SHRINK);
}
