// SPDX-License-Identifier: MIT
// Copies a buffer and does nothing else. It measures the rate of a device's memory, because the device's own copies may
// go another way.
// Work: vectors of four floats, which the threads take in turn. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/measure_args.h"

layout(local_size_x = MEASURE_THREADS) in;

layout(push_constant, scalar) uniform Push { CopyArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer From { vec4 from[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer To { vec4 to[]; };

void main() {
    const uint stride = gl_NumWorkGroups.x * MEASURE_THREADS;
    for (uint i = gl_GlobalInvocationID.x; i < args.vectors; i += stride) to[i] = from[i];
}
