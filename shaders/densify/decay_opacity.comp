// Every opacity times a factor a little below 1: what no photo holds up fades, in place of resets. Moments stay.
// Place: budget, between iterations. Work: one thread a splat. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/strategy_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { DecayOpacityArgs args; };
layout(set = 0, binding = 0, scalar) buffer Opacity { float opacity_logit[]; };

void main() {
    const uint i = linear_id();
    if (i >= args.splat_count) return;
    // o' / (1 - o') with o = 1 / (1 + e): keep / (1 - keep + e), e = exp(-logit).
    opacity_logit[i] = log(args.keep) - log(1.0 - args.keep + exp(-opacity_logit[i]));
}
