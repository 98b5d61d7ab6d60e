// SPDX-License-Identifier: MIT
// Finds which splats are dead, and the integer weights with which the others are drawn, in proportion to their opacity.
// The weights are integers so that their scan is exact and a draw does not depend on the order of sums.
// Place: mcmc, before the scans. Source: 3DGS-MCMC (arXiv 2404.09591) section 3.
// Work: one thread per splat. Shared memory: none. Writes dead (0, 1) and weight, and sets copies to 0.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/strategy_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { RelocationArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Opacity { float opacity_logit[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Dead { uint dead[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Weight { uint weight[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Copies { uint copies[]; };

void main() {
    const uint i = linear_id();
    if (i >= args.splat_count) return;
    const float opacity = 1.0 / (1.0 + exp(-opacity_logit[i]));
    const bool lives = opacity > args.dead_opacity;  // false for NaN
    dead[i] = lives ? 0u : 1u;
    weight[i] = lives ? max(uint(opacity * args.weight_scale), 1u) : 0u;
    copies[i] = 0u;
}
