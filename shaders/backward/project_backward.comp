// Sums a splat's partials over its tiles, takes them back through the projection to its parameters and does
// the Adam step there (UPDATE_ADAM), or leaves the gradients in buffers, in place of what they hold (UPDATE_STORE)
// or added to it (UPDATE_ADD): adam_update.comp makes the step of these.
// With REST_GATHER the harmonics above the first band of a splat in view add to rest_sum instead.
// Place: last pass of an iteration. Source: docs/math.md, Gradients and Optimizer.
// Work: one thread a splat, all N of them: Adam is dense, an unseen splat's moments decay and move it.
// Shared memory: none. Does nothing when the frame overflowed its intersection buffers: the host repeats it.
// A splat whose gradient is not finite, or whose square is not, is counted and left as it is for this step.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

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

#define STATE_BINDING (1 + ATTRIBUTES)
#define FRAME_BINDING (1 + 2 * ATTRIBUTES)
layout(push_constant, scalar) uniform Push { ProjectBackwardArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Cameras { CameraData cameras[]; };
layout(set = 0, binding = 1 + ATTRIBUTE_POSITION, scalar) buffer Position { float position[]; };
layout(set = 0, binding = 1 + ATTRIBUTE_LOG_SCALE, scalar) buffer LogScale { float log_scale[]; };
layout(set = 0, binding = 1 + ATTRIBUTE_ROTATION, scalar) buffer Rotation { vec4 rotation[]; };
layout(set = 0, binding = 1 + ATTRIBUTE_OPACITY_LOGIT, scalar) buffer OpacityLogit { float opacity_logit[]; };
layout(set = 0, binding = 1 + ATTRIBUTE_SH_DC, scalar) buffer ShDc { float sh_dc[]; };
layout(set = 0, binding = 1 + ATTRIBUTE_SH_REST, scalar) buffer ShRest { float sh_rest[]; };  // from first_splat on, as m_sh_rest and d_sh_rest

// Moments with UPDATE_ADAM, else gradients.
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_POSITION, scalar) buffer MPosition { vec2 m_position[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_LOG_SCALE, scalar) buffer MLogScale { vec2 m_log_scale[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_ROTATION, scalar) buffer MRotation { vec2 m_rotation[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_OPACITY_LOGIT, scalar) buffer MOpacityLogit { vec2 m_opacity_logit[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_SH_DC, scalar) buffer MShDc { vec2 m_sh_dc[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_SH_REST, scalar) buffer MShRest { vec2 m_sh_rest[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_POSITION, scalar) buffer DPosition { float d_position[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_LOG_SCALE, scalar) buffer DLogScale { float d_log_scale[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_ROTATION, scalar) buffer DRotation { float d_rotation[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_OPACITY_LOGIT, scalar) buffer DOpacityLogit { float d_opacity_logit[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_SH_DC, scalar) buffer DShDc { float d_sh_dc[]; };
layout(set = 0, binding = STATE_BINDING + ATTRIBUTE_SH_REST, scalar) buffer DShRest { float d_sh_rest[]; };

layout(set = 0, binding = FRAME_BINDING, scalar) readonly buffer IntersectionCount { uint intersection_count[]; };
layout(set = 0, binding = FRAME_BINDING + 1, scalar) readonly buffer FirstIntersection { uint first_intersection[]; };
layout(set = 0, binding = FRAME_BINDING + 7, scalar) readonly buffer PartialRest { float partial_rest[]; };
layout(set = 0, binding = FRAME_BINDING + 8, scalar) buffer GradientSum { vec2 gradient_sum[]; };  // norms, views
layout(set = 0, binding = FRAME_BINDING + 9, scalar) buffer Status { FrameStatus status; };
layout(set = 0, binding = FRAME_BINDING + 10, scalar) readonly buffer Smoothing { float smoothing[]; };  // [N] world
layout(set = 0, binding = FRAME_BINDING + 11, scalar) buffer RestSum { float rest_sum[]; };  // as sh_rest, but with REST_EACH
layout(set = 0, binding = FRAME_BINDING + 11, scalar) buffer CameraGradient { float camera_gradient[]; };  // [N][13] with CAMERA_GRADIENT

const int SH_USED = (SH_DEGREE + 1) * (SH_DEGREE + 1) - 1;
const uint SH_STRIDE = uint((SH_STORED + 1) * (SH_STORED + 1) - 1) * 3u;

#define PARTIALS_BINDING (FRAME_BINDING + 2)
#include "effects/constants.glsl"
#include "lib/splat_values.glsl"
#include "kernels/kernel.glsl"
#include "lib/covariance.glsl"
#include "effects/antialias.glsl"
#include "effects/camera_model.glsl"
#include "lib/linear_id.glsl"
#include "lib/partials.glsl"
#include "lib/sh.glsl"
#include "optim/adam.glsl"
#include "optim/fading.glsl"
#include "backward/camera_gradient.glsl"
#include "backward/project_gradient.glsl"

Partial sum_partials(uint i) {
    Partial sums = Partial(vec4(0.0), 0.0, 0.0, vec3(0.0));
    uint e = first_intersection[i];
    const uint end = e + intersection_count[i];
    for (uint stop = e; e < end;) {
        stop = min(stop + 32768u, end);  // some drivers end loops at 65,535
        for (; e < stop; ++e) {
            const vec4 light = load_partial(e, 1u);
            sums.a += load_partial(e, 0u);
            sums.b += partial_rest[e];
            sums.d_opacity += light.x;
            sums.d_colour += light.yzw;
        }
    }
    return sums;
}

bool finite(SplatGradient g) {
    const uint ellipsoid = max(max(magnitude(g.position), magnitude(g.log_scale)), magnitude(g.rotation));
    const uint light = max(magnitude(g.colour), magnitude(vec3(g.opacity_logit, g.mean)));
    return below(max(ellipsoid, light), GRADIENT_LIMIT);
}

// What becomes of a float's gradient.
#define UPDATE_FLOAT(value, moment, stored, gradient, rate)                   \
    if (UPDATE == UPDATE_ADAM) {                                              \
        vec2 m = moment;                                                      \
        value = adam_step(value, m, gradient, rate);                          \
        moment = m;                                                           \
    } else {                                                                  \
        stored = UPDATE == UPDATE_ADD ? stored + (gradient) : (gradient);     \
    }

void update_rest(uint i, SplatGradient g) {
    float basis[SH_REST_MAX];
    sh_basis(g.direction, basis);
    const uint row = (i - args.first_splat) * SH_STRIDE;
    for (int k = 0; k < SH_USED; ++k) {
        for (uint c = 0u; c < 3u; ++c) {
            const uint at = row + uint(k) * 3u + c;
            float gradient = basis[k] * g.colour[c];
            if (UPDATE == UPDATE_ADAM && REST != REST_EACH) {
                gradient = rest_sum[at] + gradient * args.rest_share;
                rest_sum[at] = REST == REST_GATHER ? gradient : 0.0;
            }
            if (REST != REST_GATHER)
                UPDATE_FLOAT(sh_rest[at], m_sh_rest[at], d_sh_rest[at], gradient,
                             args.rate[ATTRIBUTE_SH_REST])
        }
    }
}

void update_splat(uint i, SplatGradient g) {
    for (uint c = 0u; c < 3u; ++c) {
        const uint at = 3u * i + c;
        UPDATE_FLOAT(position[at], m_position[at], d_position[at], g.position[c],
                     args.rate[ATTRIBUTE_POSITION])
        const float before = log_scale[at], largest = max(before, args.largest_log_scale);
        UPDATE_FLOAT(log_scale[at], m_log_scale[at], d_log_scale[at], g.log_scale[c],
                     args.rate[ATTRIBUTE_LOG_SCALE])
        if (UPDATE == UPDATE_ADAM && log_scale[at] > largest) log_scale[at] = largest;
        UPDATE_FLOAT(sh_dc[at], m_sh_dc[at], d_sh_dc[at], (DIRECT_COLOUR == 1 ? 1.0 : SH_C0) * g.colour[c],
                     args.rate[ATTRIBUTE_SH_DC])
    }
    for (uint c = 0u; c < 4u; ++c) {
        const uint at = 4u * i + c;
        UPDATE_FLOAT(rotation[i][c], m_rotation[at], d_rotation[at], g.rotation[c],
                     args.rate[ATTRIBUTE_ROTATION])
    }
    UPDATE_FLOAT(opacity_logit[i], m_opacity_logit[i], d_opacity_logit[i], g.opacity_logit,
                 args.rate[ATTRIBUTE_OPACITY_LOGIT])
    if (UPDATE == UPDATE_ADAM && stands_near(cameras[args.camera_index], i, args.clearance))
        opacity_logit[i] -= FADING;
    if (SH_DEGREE > 0 && (REST != REST_GATHER || intersection_count[i] > 0u)) update_rest(i, g);
    if (UPDATE == UPDATE_STORE) {  // the bands beyond the degree in use
        const uint row = (i - args.first_splat) * SH_STRIDE;
        for (uint c = uint(SH_USED) * 3u; c < SH_STRIDE; ++c) d_sh_rest[row + c] = 0.0;
    }
}

SplatGradient no_gradient() {
    SplatGradient g;
    g.position = g.log_scale = g.colour = g.direction = vec3(0.0);
    g.rotation = vec4(0.0);
    g.opacity_logit = 0.0;
    g.mean = vec2(0.0);
    return g;
}

void regularise(uint i, inout SplatGradient g) {
    const float o = 1.0 / (1.0 + exp(-opacity_logit[i]));
    g.opacity_logit += args.opacity_weight * o * (1.0 - o);
    for (uint c = 0u; c < 3u; ++c) {
        const float raw = log_scale[3u * i + c];
        if (abs(raw) <= LOG_SCALE_LIMIT) g.log_scale[c] += args.scale_weight * exp(raw);
    }
}

void main() {
    const uint i = args.first_splat + linear_id();
    if (i >= args.splat_end || status.overflow != 0u) return;
    SplatGradient g = no_gradient();
    vec2 shown = vec2(0.0);  // norm of the gradient of the mean, NDC; 1
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
    // Adam makes a step of full length of any gradient that comes alone: at all frames that do not show a splat the
    // regularisers would take, in a large set, what a few of its photos never get to hold up.
    if (UPDATE == UPDATE_ADAM && (intersection_count[i] > 0u || args.regularise_unseen == 1u)) regularise(i, g);
    update_splat(i, g);
}
