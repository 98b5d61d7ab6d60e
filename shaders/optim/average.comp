// SPDX-License-Identifier: MIT
// Takes one more iteration into the mean of a parameter: mean += (value - mean) / iterations so far.
// Place: the end of a run, between iterations.
// Work: one thread per float. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/optim_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { AverageArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Value { float value[]; };
layout(set = 0, binding = 1, scalar) buffer Mean { float mean[]; };

void main() {
    const uint i = linear_id();
    if (i >= args.count) return;
    mean[i] += args.share * (value[i] - mean[i]);
}
