// SPDX-License-Identifier: MIT
// Adds noise to positions, the covariance times a normal vector, for splats that are nearly transparent, so that they
// find places where something is missing.
// Place: mcmc, after every step of the optimiser. Source: 3DGS-MCMC (arXiv 2404.09591) equation 8; the gate
// sigmoid(-100 (opacity - 0.005)) is its authors' choice.
// Work: one thread per splat. Shared memory: none. Does nothing when the frame overflowed its intersection buffers.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/render_args.h"
#include "shared/strategy_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/covariance.glsl"
#include "lib/linear_id.glsl"
#include "lib/random.glsl"

layout(push_constant, scalar) uniform Push { NoiseArgs args; };
layout(set = 0, binding = 0, scalar) buffer Position { vec3 position[]; };
layout(set = 0, binding = 1, scalar) readonly buffer LogScale { vec3 log_scale[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Rotation { vec4 rotation[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Opacity { float opacity_logit[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Status { FrameStatus status; };

const float GATE_SLOPE = 100.0;

// Two normal numbers (Box and Muller 1958).
vec2 random_normals(inout uint state) {
    const float radius = sqrt(-2.0 * log(1.0 - random_uniform(state)));
    const float angle = 6.28318530718 * random_uniform(state);
    return radius * vec2(cos(angle), sin(angle));
}

void main() {
    const uint i = linear_id();
    if (i >= args.splat_count || status.overflow != 0u) return;
    uint state = random_seed(args.seed, i);
    const vec2 first = random_normals(state);
    const vec3 normal = vec3(first, random_normals(state).x);
    const float opacity = 1.0 / (1.0 + exp(-opacity_logit[i]));
    const float gate = 1.0 / (1.0 + exp(GATE_SLOPE * (opacity - args.dead_opacity)));
    vec4 unit;
    float norm;
    if (!normalise_rotation(rotation[i], unit, norm)) return;
    const mat3 axes = rotation_matrix(unit);
    const vec3 s = exp(clamp(log_scale[i], -LOG_SCALE_LIMIT, LOG_SCALE_LIMIT));
    const vec3 offset = args.rate * gate * (axes * (s * s * (normal * axes)));
    if (magnitude_below(dot(offset, offset), 1e30)) position[i] += offset;
}
