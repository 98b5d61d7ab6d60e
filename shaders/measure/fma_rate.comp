// Multiply-adds in registers and nothing else: the arithmetic rate of a device.
// Work: MEASURE_STEPS steps of MEASURE_CHAINS chains a thread. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/measure_args.h"

layout(local_size_x = MEASURE_THREADS) in;

layout(push_constant, scalar) uniform Push { FmaArgs args; };
layout(set = 0, binding = 0, scalar) writeonly buffer Sums { float sums[]; };

void main() {
    const float start = float(gl_GlobalInvocationID.x);
    vec4 a = vec4(start, start + 1.0, start + 2.0, start + 3.0), b = a + 4.0;  // MEASURE_CHAINS
    for (int i = 0; i < MEASURE_STEPS; ++i) {
        a = a * args.factor + args.term;
        b = b * args.factor + args.term;
    }
    sums[gl_GlobalInvocationID.x] = dot(a, vec4(1.0)) + dot(b, vec4(1.0));
}
