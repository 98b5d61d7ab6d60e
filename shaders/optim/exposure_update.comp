// SPDX-License-Identifier: MIT
// One Adam step of one photo's exposure, after which the mean of all maps is made the identity again, because a change
// common to all photos belongs to the scene.
// Place: after exposure_backward. Source: Kingma and Ba 2015.
// Work: one thread per term of the map, or of the grid of maps. Shared memory: none. Does nothing when the frame
// overflowed its intersection buffers, as for the splats, or when the gradient or its square is not finite. Reads
// partial sums; writes maps and moments.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/effect_args.h"
#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { ExposureUpdateArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Partials { float partials[]; };
layout(set = 0, binding = 1, scalar) buffer Maps { float maps[]; };        // [views][terms]
layout(set = 0, binding = 2, scalar) buffer Moments { vec2 moments[]; };   // [views][terms]
layout(set = 0, binding = 3, scalar) readonly buffer Status { FrameStatus status; };

#include "lib/finite.glsl"
#include "optim/adam.glsl"

void main() {
    const uint k = linear_id(), at = args.view * args.terms + k;
    if (k >= args.terms || status.overflow != 0u) return;
    float gradient = 0.0;
    for (uint g = 0u; g < args.groups; ++g) gradient += partials[g * args.terms + k];
    if (!magnitude_below(gradient, GRADIENT_LIMIT)) return;
    vec2 moment = moments[at];
    const float change = adam_step(0.0, moment, gradient, args.rate);
    moments[at] = moment;
    maps[at] += change;
    const float share = change / float(args.views);
    for (uint v = 0u; v < args.views; ++v) maps[v * args.terms + k] -= share;
}
