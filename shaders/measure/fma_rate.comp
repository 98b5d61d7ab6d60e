// SPDX-License-Identifier: MIT
// Does multiply-adds in registers and nothing else: the arithmetic rate of a device.
// Work: MEASURE_STEPS steps of MEASURE_CHAINS chains per thread. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/measure_args.h"

layout(local_size_x = MEASURE_THREADS) in;

layout(push_constant, scalar) uniform Push { FmaArgs args; };
layout(set = 0, binding = 0, scalar) writeonly buffer Sums { float sums[]; };

void main() {
    const float start = float(gl_GlobalInvocationID.x);
    const vec4 factor = vec4(args.factor), term = vec4(args.term);
    vec4 a = vec4(start, start + 1.0, start + 2.0, start + 3.0), b = a + 4.0, c = a + 8.0;  // MEASURE_CHAINS
    for (int i = 0; i < MEASURE_STEPS / 8; ++i) {
        for (int k = 0; k < 8; ++k) {  // unrolled, because a loop counter costs as much as six
            a = fma(a, factor, term);
            b = fma(b, factor, term);
            c = fma(c, factor, term);
        }
    }
    sums[gl_GlobalInvocationID.x] = dot(a + b + c, vec4(1.0));
}
