// SPDX-License-Identifier: MIT
// The Adam step of one attribute from gradients in buffers, which come from several views or from the caller. It is the
// same step that project_backward.comp makes from one view, with its regularisers and limits.
// Place: once for each attribute and range, after the gradients of all views. Source: Kingma and Ba 2015.
// Work: one thread per float, per column for the harmonics above the first band (lib/rows.glsl), or with FLATNESS per
// splat. Shared memory: none. Does nothing when a frame overflowed its intersection buffers. A splat with a gradient
// that was not finite is left as it is; a float whose own gradient is not finite is counted and left.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/attribute_list.h"
#include "shared/limits.h"
#include "shared/optim_args.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;
layout(constant_id = 1) const uint FLOATS = 1;  // floats per splat
layout(constant_id = 2) const int STEP = STEP_PLAIN;
layout(constant_id = 3) const int REST = REST_EACH;
layout(constant_id = 36) const int FLATNESS = 0;  // 1, with STEP_SCALE: as in project_backward.comp

layout(push_constant, scalar) uniform Push { AdamUpdateArgs args; };
// only the range's, as are the next two and rest_sum
layout(set = 0, binding = 0, scalar) buffer Value { float value[]; };
layout(set = 0, binding = 1, scalar) buffer Moment { vec2 moment[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Gradient { float gradient[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Views { vec2 views[]; };  // [N] sum of norms, views
layout(set = 0, binding = 5, scalar) buffer Status { FrameStatus status; };
// With STEP_REST they lie in columns.
layout(set = 0, binding = 0, scalar) buffer ValueColumn { vec4 value_column[]; };
layout(set = 0, binding = 1, scalar) buffer MomentColumn { vec4 moment_column[]; };
layout(set = 0, binding = 2, scalar) readonly buffer GradientColumn { vec4 gradient_column[]; };
layout(set = 0, binding = 4, scalar) buffer RestSum { vec4 rest_sum[]; };

#define ADAM_BETA1 args.beta1
#define ADAM_BETA2 args.beta2
#define ADAM_SHARE1 args.share1
#define ADAM_SHARE2 args.share2
#include "lib/finite.glsl"
#include "lib/linear_id.glsl"
#include "lib/rows.glsl"
#include "optim/adam.glsl"
#include "optim/flatness.glsl"

float regulariser(float x) {
    if (STEP == STEP_SCALE) return abs(x) <= LOG_SCALE_LIMIT ? args.weight * exp(x) : 0.0;
    const float o = 1.0 / (1.0 + exp(-x));
    return args.weight * o * (1.0 - o);
}

// Steps two floats of a column, with their values, gradients and moments, where they are in use and their gradients are
// finite.
void step_pair(bvec2 used, inout vec2 values, vec2 gradients, uint moments_at) {
    if (!any(used)) return;
    vec4 m = moment_column[moments_at];
    if (used.x) values.x = adam_step(values.x, m.xy, gradients.x, args.rate);
    if (used.y) values.y = adam_step(values.y, m.zw, gradients.y, args.rate);
    moment_column[moments_at] = m;
}

void step_rest() {
    const uint at = linear_id(), columns = (FLOATS + 3u) / 4u;
    const uint splat = at / (columns * ROW_BLOCK) * ROW_BLOCK + at % ROW_BLOCK, c = at / ROW_BLOCK % columns;
    if (splat >= args.splat_count || 4u * c >= args.floats_in_use || status.overflow != 0u) return;
    const float shown = views[args.first_splat + splat].y;
    if (shown < 0.0) return;
    vec4 g = gradient_column[at] * args.gradient_scale;
    bvec4 used = lessThan(4u * c + uvec4(0u, 1u, 2u, 3u), uvec4(args.floats_in_use));
    for (int j = 0; j < 4; ++j)
        if (used[j] && !magnitude_below(g[j], GRADIENT_LIMIT)) {
            atomicAdd(status.bad_gradients, 1u);
            used[j] = false;
        }
    if (REST != REST_EACH) {
        if (REST == REST_GATHER && shown == 0.0) return;
        const vec4 sum = rest_sum[at];
        g = sum + g * args.rest_share;
        rest_sum[at] = mix(sum, REST == REST_GATHER ? g : vec4(0.0), used);
        if (REST == REST_GATHER) return;
    }
    vec4 value = value_column[at];
    step_pair(used.xy, value.xy, g.xy, column_at(splat, 2u * c, 2u * columns));
    step_pair(used.zw, value.zw, g.zw, column_at(splat, 2u * c + 1u, 2u * columns));
    value_column[at] = value;
}

// Steps one float. flat_weight: that of its scale in the loss beside its regulariser.
void step_float(uint at, float shown, float flat_weight) {
    float g = gradient[at] * args.gradient_scale;
    if (magnitude_below(g, GRADIENT_LIMIT)) {
        // Part of the loss of each view that shows the splat, and of a share of the others.
        if (STEP == STEP_SCALE || STEP == STEP_OPACITY) {
            const float share = max(shown * args.gradient_scale, args.regularise_unseen);
            if (share > 0.0) g += share * regulariser(value[at]);
            if (FLATNESS == 1 && share > 0.0 && abs(value[at]) <= LOG_SCALE_LIMIT)
                g += share * flat_weight * exp(value[at]);
        }
        const float before = value[at];
        vec2 m = moment[at];
        float after = adam_step(before, m, g, args.rate);
        if (STEP == STEP_SCALE) {
            after = at_most(after, max(before, args.largest));
        }
        value[at] = after;
        moment[at] = m;
    } else {
        atomicAdd(status.bad_gradients, 1u);
    }
}

// The three scales of a splat, of which one is the smallest.
void step_scales(uint splat) {
    if (splat >= args.splat_count || status.overflow != 0u) return;
    const float shown = views[args.first_splat + splat].y;
    if (shown < 0.0) return;
    const uint first = FLOATS * splat;
    const uint least = smallest_axis(vec3(value[first], value[first + 1u], value[first + 2u]));
    for (uint c = 0u; c < 3u; ++c) step_float(first + c, shown, c == least ? args.flatness_weight : 0.0);
}

void main() {
    if (STEP == STEP_REST) {
        step_rest();
        return;
    }
    if (FLATNESS == 1) {
        step_scales(linear_id());
        return;
    }
    const uint at = linear_id(), splat = at / FLOATS;
    if (splat >= args.splat_count || at % FLOATS >= args.floats_in_use || status.overflow != 0u) return;
    const float shown = views[args.first_splat + splat].y;
    if (shown < 0.0) return;
    step_float(at, shown, 0.0);
}
