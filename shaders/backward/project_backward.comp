// SPDX-License-Identifier: MIT
// Sums a splat's partials over its tiles and takes them back through the projection to its parameters. Then it either
// does the Adam step (UPDATE_ADAM), or stores the gradients in buffers (UPDATE_STORE) or adds them to what these hold
// (UPDATE_ADD), for which adam_update.comp does the step. With REST_GATHER, the harmonics above the first band of a
// splat in view are added to rest_sum instead.
// Place: last pass of an iteration. Source: docs/math.md, Gradients and Optimizer.
// Work: one thread per splat, for all N of them: Adam is dense, so an unseen splat's moments decay and move it. Shared
// memory: none. Does nothing when the frame overflowed its intersection buffers, because the host repeats it. A splat
// with a gradient that is not finite, or whose square is not, is counted and left alone for this step.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/accuracy_list.h"
#include "shared/attribute_list.h"
#include "shared/limits.h"
#include "shared/optim_args.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;
layout(constant_id = 1) const int SH_DEGREE = 0;
layout(constant_id = 2) const int SH_STORED = 0;
layout(constant_id = 3) const int UPDATE = UPDATE_ADAM;
layout(constant_id = 4) const int REST = REST_EACH;
layout(constant_id = 34) const int SUMS_BY_CHUNKS = 0;  // 1: partial_chunks.comp has added up chunks of intersections
layout(constant_id = 36) const int FLATNESS = 0;  // 1: the smallest scale of a splat has a regulariser of its own

#define STATE_BINDING (1 + ATTRIBUTES)
#define FRAME_BINDING (1 + 2 * ATTRIBUTES)
layout(push_constant, scalar) uniform Push { ProjectBackwardArgs args; };
#include "optim/adam.glsl"
layout(set = 0, binding = 0, scalar) readonly buffer Cameras { CameraData cameras[]; };
layout(set = 0, binding = 1 + ATTRIBUTE_POSITION, scalar) buffer Position { vec3 position[]; };
layout(set = 0, binding = 1 + ATTRIBUTE_LOG_SCALE, scalar) buffer LogScale { vec3 log_scale[]; };
layout(set = 0, binding = 1 + ATTRIBUTE_ROTATION, scalar) buffer Rotation { vec4 rotation[]; };
layout(set = 0, binding = 1 + ATTRIBUTE_OPACITY_LOGIT, scalar) buffer OpacityLogit { float opacity_logit[]; };
layout(set = 0, binding = 1 + ATTRIBUTE_SH_DC, scalar) buffer ShDc { vec3 sh_dc[]; };
// from first_splat on, as m_sh_rest and d_sh_rest
layout(set = 0, binding = 1 + ATTRIBUTE_SH_REST, scalar) buffer ShRest { vec4 sh_rest[]; };
layout(set = 0, binding = 1 + ATTRIBUTE_SHAPE, scalar) buffer Shape { float shape[]; };  // with SHAPED, as the next two

// The moments with UPDATE_ADAM, otherwise the gradients.
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_POSITION, scalar) buffer MPosition { Moments3 m_position[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_LOG_SCALE, scalar) buffer MLogScale { Moments3 m_log_scale[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_ROTATION, scalar) buffer MRotation { mat2x4 m_rotation[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_OPACITY_LOGIT, scalar) buffer MOpacityLogit { vec2 m_opacity_logit[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_SH_DC, scalar) buffer MShDc { Moments3 m_sh_dc[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_SH_REST, scalar) buffer MShRest { vec4 m_sh_rest[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_POSITION, scalar) buffer DPosition { vec3 d_position[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_LOG_SCALE, scalar) buffer DLogScale { vec3 d_log_scale[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_ROTATION, scalar) buffer DRotation { vec4 d_rotation[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_OPACITY_LOGIT, scalar) buffer DOpacityLogit { float d_opacity_logit[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_SH_DC, scalar) buffer DShDc { vec3 d_sh_dc[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_SH_REST, scalar) buffer DShRest { vec4 d_sh_rest[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_SHAPE, scalar) buffer MShape { vec2 m_shape[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_SHAPE, scalar) buffer DShape { float d_shape[]; };

layout(set = 0, binding = FRAME_BINDING, scalar) readonly buffer IntersectionCount { uint intersection_count[]; };
layout(set = 0, binding = FRAME_BINDING + 1, scalar) readonly buffer FirstIntersection { uint first_intersection[]; };
layout(set = 0, binding = FRAME_BINDING + 7, scalar) readonly buffer PartialRest { float partial_rest[]; };  // [K][RESTS]
layout(set = 0, binding = FRAME_BINDING + 8, scalar) buffer GradientSum { vec2 gradient_sum[]; };  // norms, views
layout(set = 0, binding = FRAME_BINDING + 9, scalar) buffer Status { FrameStatus status; };
layout(set = 0, binding = FRAME_BINDING + 10, scalar) readonly buffer Smoothing { float smoothing[]; };  // [N] world
// as sh_rest; not with REST_EACH
layout(set = 0, binding = FRAME_BINDING + 11, scalar) buffer RestSum { vec4 rest_sum[]; };
layout(set = 0, binding = FRAME_BINDING + 11, scalar) buffer CameraGradient { float camera_gradient[]; };  // [N][CAMERA_SHARES] with CAMERA_GRADIENT
layout(set = 0, binding = FRAME_BINDING + 12, scalar) readonly buffer PartialExponent { float partial_exponent[]; };  // with SHAPED

#define PARTIALS_BINDING (FRAME_BINDING + 2)
#include "effects/constants.glsl"
#include "lib/splat_values.glsl"
#include "kernels/kernel.glsl"
#include "lib/covariance.glsl"
#include "lib/depth_sum.glsl"
#include "effects/antialias.glsl"
#include "effects/camera_model.glsl"
#include "effects/sigma_points.glsl"
#include "effects/shutter.glsl"
#include "lib/linear_id.glsl"
#include "lib/partials.glsl"
#include "lib/sh.glsl"
#include "lib/rest.glsl"
#include "optim/fading.glsl"
#include "optim/flatness.glsl"
#include "backward/camera_gradient.glsl"
#include "backward/project_gradient.glsl"

Partial sum_partials(uint i) {
    Partial sums = Partial(vec4(0.0), 0.0, 0.0, 0.0, 0.0, vec3(0.0));
    uint e = first_intersection[i];
    const uint count = intersection_count[i], end = e + count;
    const uint stride = SUMS_BY_CHUNKS == 1 && count > uint(SUM_CHUNK) ? uint(SUM_CHUNK) : 1u;
    for (uint stop = e; e < end;) {
        stop = min(stop + 32768u, end);  // some drivers end loops after 65,535 rounds
        for (; e < stop; e += stride) {
            const vec4 light = load_partial(e, 1u);
            sums.a += load_partial(e, 0u);
            sums.b += partial_rest[RESTS * e];
            if (DEPTH_SUM == 1) sums.d_depth += partial_rest[RESTS * e + 1u];
            sums.d_opacity += light.x;
            sums.d_colour += light.yzw;
            if (SHAPED) sums.d_exponent += partial_exponent[e];
        }
    }
    return sums;
}

bool finite(SplatGradient g) {
    const uint ellipsoid = max(max(magnitude(g.position), magnitude(g.log_scale)), magnitude(g.rotation));
    const uint light = max(magnitude(g.colour), magnitude(vec3(g.opacity_logit, g.mean)));
    const uint shape = SHAPED ? magnitude(vec3(g.shape)) : 0u;
    return below(max(max(ellipsoid, light), shape), GRADIENT_LIMIT);
}

// Applies an attribute's gradient as UPDATE says.
#define UPDATE_ATTRIBUTE(Moments, value, moments, stored, gradient, attribute) \
    if (UPDATE == UPDATE_ADAM) {                                               \
        Moments m = moments;                                                   \
        value = adam_step(value, m, gradient, args.rate[attribute]);           \
        moments = m;                                                           \
    } else {                                                                   \
        stored = UPDATE == UPDATE_ADD ? stored + (gradient) : (gradient);      \
    }

// The step of column c of the harmonics. Nothing changes beyond the degree in use; a column that is partly in use has
// at least its x in use.
void step_column(uint row, int c, vec4 gradient) {
    const bool whole = 4 * c + 4 <= 3 * SH_USED;
    const uint at = column_at(row, uint(c), COLUMNS), moments_at = column_at(row, uint(2 * c), 2u * COLUMNS);
    const float rate = args.rate[ATTRIBUTE_SH_REST];
    vec4 value = sh_rest[at], moments = m_sh_rest[moments_at];
    value.x = adam_step(value.x, moments.xy, gradient.x, rate);
    if (whole) value.y = adam_step(value.y, moments.zw, gradient.y, rate);
    m_sh_rest[moments_at] = moments;
    if (whole) {
        moments = m_sh_rest[moments_at + ROW_BLOCK];
        value.z = adam_step(value.z, moments.xy, gradient.z, rate);
        value.w = adam_step(value.w, moments.zw, gradient.w, rate);
        m_sh_rest[moments_at + ROW_BLOCK] = moments;
    }
    sh_rest[at] = value;
}

// Applies the gradient of column c, which is 0 beyond the degree in use.
void update_column(uint row, int c, vec4 gradient) {
    if (4 * c >= 3 * SH_USED) return;
    const uint at = column_at(row, uint(c), COLUMNS);
    if (UPDATE != UPDATE_ADAM) {
        d_sh_rest[at] = UPDATE == UPDATE_ADD ? d_sh_rest[at] + gradient : gradient;
        return;
    }
    if (REST != REST_EACH) {
        const vec4 sum = rest_sum[at];
        const bool whole = 4 * c + 4 <= 3 * SH_USED;
        gradient = sum + gradient * args.rest_share;
        rest_sum[at] = REST == REST_GATHER ? gradient : whole ? vec4(0.0) : vec4(0.0, sum.yzw);
    }
    if (REST != REST_GATHER) step_column(row, c, gradient);
}

void update_rest(uint i, SplatGradient g) {
    float basis[SH_REST_MAX];
    sh_basis(g.direction, basis);
    const uint row = i - args.first_splat;
    for (int t = 0; t < FOURS; ++t) {
        const vec3 d0 = basis[4 * t] * g.colour, d1 = basis[4 * t + 1] * g.colour, d2 = basis[4 * t + 2] * g.colour;
        const vec3 d3 = 4 * t + 3 < SH_USED ? basis[4 * t + 3] * g.colour : vec3(0.0);
        update_column(row, 3 * t, vec4(d0, d1.x));
        update_column(row, 3 * t + 1, vec4(d1.yz, d2.xy));
        update_column(row, 3 * t + 2, vec4(d2.z, d3));
    }
}

void update_splat(uint i, SplatGradient g) {
    UPDATE_ATTRIBUTE(Moments3, position[i], m_position[i], d_position[i], g.position, ATTRIBUTE_POSITION)
    const vec3 scale_before = log_scale[i];
    vec3 scale = scale_before;
    UPDATE_ATTRIBUTE(Moments3, scale, m_log_scale[i], d_log_scale[i], g.log_scale, ATTRIBUTE_LOG_SCALE)
    if (UPDATE == UPDATE_ADAM) {
        log_scale[i] = at_most(scale, max(scale_before, vec3(args.largest_log_scale)));
    }
    UPDATE_ATTRIBUTE(Moments3, sh_dc[i], m_sh_dc[i], d_sh_dc[i], (DIRECT_COLOUR == 1 ? 1.0 : SH_C0) * g.colour,
                     ATTRIBUTE_SH_DC)
    UPDATE_ATTRIBUTE(mat2x4, rotation[i], m_rotation[i], d_rotation[i], g.rotation, ATTRIBUTE_ROTATION)
    UPDATE_ATTRIBUTE(vec2, opacity_logit[i], m_opacity_logit[i], d_opacity_logit[i], g.opacity_logit,
                     ATTRIBUTE_OPACITY_LOGIT)
    if (SHAPED) UPDATE_ATTRIBUTE(vec2, shape[i], m_shape[i], d_shape[i], g.shape, ATTRIBUTE_SHAPE)
    if (UPDATE == UPDATE_ADAM && stands_near(cameras[args.camera_index], i, args.clearance))
        opacity_logit[i] -= FADING;
    const bool shows = intersection_count[i] > 0u;
    const bool steps = shows || (UPDATE == UPDATE_ADAM && REST != REST_GATHER);
    if (SH_DEGREE > 0 && steps) update_rest(i, g);
    // bands beyond the degree in use, and all of what the view does not show; there must be no -0
    if (UPDATE == UPDATE_STORE)
        for (uint c = shows ? 3u * uint(FOURS) : 0u; c < COLUMNS; ++c)
            d_sh_rest[column_at(i - args.first_splat, c, COLUMNS)] = vec4(0.0);
}

SplatGradient no_gradient() {
    SplatGradient g;
    g.position = g.log_scale = g.colour = g.direction = vec3(0.0);
    g.rotation = vec4(0.0);
    g.opacity_logit = g.shape = 0.0;
    g.mean = vec2(0.0);
    return g;
}

void regularise(uint i, inout SplatGradient g) {
    const float o = 1.0 / (1.0 + exp(-opacity_logit[i]));
    g.opacity_logit += args.opacity_weight * o * (1.0 - o);
    const vec3 raw_scale = log_scale[i];
    for (uint c = 0u; c < 3u; ++c) {
        const float raw = raw_scale[c];
        if (abs(raw) <= LOG_SCALE_LIMIT) g.log_scale[c] += args.scale_weight * exp(raw);
    }
    if (FLATNESS == 1) {
        const uint c = smallest_axis(raw_scale);
        if (abs(raw_scale[c]) <= LOG_SCALE_LIMIT) g.log_scale[c] += args.flatness_weight * exp(raw_scale[c]);
    }
}

void main() {
    const uint i = args.first_splat + linear_id();
    if (i >= args.splat_end || status.overflow != 0u) return;
    SplatGradient g = no_gradient();
    vec2 shown = vec2(0.0);  // norm of the gradient of the mean, NDC; 1 where it is shown
    if (CAMERA_GRADIENT == 1 && intersection_count[i] == 0u) clear_camera_gradient(i);
    if (intersection_count[i] > 0u) {
        const CameraData camera = cameras[args.camera_index];
        g = project_gradient(camera, i, sum_partials(i));
        shown = vec2(length(g.mean * 0.5 * vec2(camera.width, camera.height)), 1.0);
        if (!finite(g)) {
            atomicAdd(status.bad_gradients, 1u);
            if (UPDATE == UPDATE_ADAM) return;
            g = no_gradient();
            shown = vec2(0.0, VIEWS_BAD);
            if (CAMERA_GRADIENT == 1) clear_camera_gradient(i);
        }
    } else if (UPDATE == UPDATE_ADD) {
        return;
    }
    if (UPDATE == UPDATE_STORE)
        gradient_sum[i] = shown;
    else if (intersection_count[i] > 0u)
        gradient_sum[i] += shown;
    // Adam makes a step of full length from any gradient that comes alone. If the regularisers acted in every frame
    // that does not show a splat, they would, in a large set, remove splats that their few photos never get to keep.
    if (UPDATE == UPDATE_ADAM && (intersection_count[i] > 0u || args.regularise_unseen == 1u)) regularise(i, g);
    update_splat(i, g);
}
