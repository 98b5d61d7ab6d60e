// SPDX-License-Identifier: MIT
// Adds one buffer of gradients to another, those of another view or process, in the order that the host chose.
// Place: before adam_update.
// Work: one thread per float. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/optim_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { AddArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer From { float from[]; };
layout(set = 0, binding = 1, scalar) buffer To { float to[]; };

void main() {
    const uint i = linear_id();
    if (i < args.count) to[i] += from[i];
}
