// SPDX-License-Identifier: MIT
// Evaluates the kernel contract on an array of q (and of opacities, for the reach); tests and `darb check` compare the
// result with double. One thread per entry. Reads q and opacity; writes value, slope and reach.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/kernel_probe_args.h"

layout(local_size_x = KERNEL_PROBE_GROUP) in;

#include "kernels/kernel.glsl"

layout(push_constant, scalar) uniform Push { KernelProbeArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Input { vec2 q_opacity[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Output { vec4 value_slope_reach_scale[]; };

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= args.count) return;
    float w, slope, by_exponent;
    kernel_value_slope(q_opacity[i].x, args.exponent, w, slope, by_exponent);
    value_slope_reach_scale[i] =
        vec4(w, slope, kernel_reach(q_opacity[i].y, args.exponent), kernel_covariance_scale(args.exponent));
}
