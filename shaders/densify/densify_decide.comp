// SPDX-License-Identifier: MIT
// Decides for every splat whether density control keeps, clones, splits or prunes it.
// Place: between iterations. Source: docs/math.md, Density control; 3DGS section 5, with the thresholds of graphdeco's
// program.
// Work: one thread per splat. Shared memory: none. Writes keep (0, 1) and grow (0, 1) for their scans.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/optim_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/finite.glsl"
#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { DensifyArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer LogScale { vec3 log_scale[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Opacity { float opacity_logit[]; };
layout(set = 0, binding = 2, scalar) readonly buffer GradientSum { vec2 gradient_sum[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Keep { uint keep[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Grow { uint grow[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer Action { uint action[]; };

const float SPLIT_SHRINK = 1.6;

uint decide(uint i) {
    const vec3 raw_scale = log_scale[i], s = exp(raw_scale);
    const float largest = max(s.x, max(s.y, s.z));
    const float logit = opacity_logit[i], opacity = 1.0 / (1.0 + exp(-logit));
    const vec2 sum = gradient_sum[i];
    const bool grows = sum.y > 0.0 && sum.x >= args.gradient_threshold * sum.y;
    const bool splits = grows && largest > args.clone_split_scale;
    const float final_scale = splits ? largest / SPLIT_SHRINK : largest;
    if (is_nan(logit) || !(opacity >= args.prune_opacity)) return DENSIFY_PRUNE;
    if (args.prune_scale > 0.0 && (any_nan(raw_scale) || !(final_scale <= args.prune_scale)))
        return DENSIFY_PRUNE;
    return splits ? DENSIFY_SPLIT : grows ? DENSIFY_CLONE : DENSIFY_KEEP;
}

void main() {
    const uint i = linear_id();
    if (i >= args.splat_count) return;
    const uint what = decide(i);
    action[i] = what;
    keep[i] = what == DENSIFY_PRUNE ? 0u : 1u;
    grow[i] = what == DENSIFY_CLONE || what == DENSIFY_SPLIT ? 1u : 0u;
}
