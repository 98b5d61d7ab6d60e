// Sums a splat's partials over its tiles, takes them back through the projection to its parameters and does
// the Adam step there (UPDATE = 1), or stores the gradients in the moments' place (UPDATE = 0).
// With REST_GATHER the harmonics above the first band of a splat in view add to rest_sum instead.
// Place: last pass of an iteration. Source: docs/math.md, Gradients and Optimizer.
// Work: one thread a splat, all N of them: Adam is dense, an unseen splat's moments decay and move it.
// Shared memory: none. Does nothing when the frame overflowed its pair buffers: the host repeats it.
// A splat whose gradient is not finite, or whose square is not, is counted and left as it is for this step.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/optim_args.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;
layout(constant_id = 1) const int SH_DEGREE = 0;
layout(constant_id = 2) const int SH_STORED = 0;
layout(constant_id = 3) const int UPDATE = 1;
layout(constant_id = 4) const int REST = REST_EACH;

layout(push_constant, scalar) uniform Push { ProjectBackwardArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Cameras { CameraData cameras[]; };
layout(set = 0, binding = 1, scalar) buffer Position { float position[]; };
layout(set = 0, binding = 2, scalar) buffer LogScale { float log_scale[]; };
layout(set = 0, binding = 3, scalar) buffer Rotation { vec4 rotation[]; };
layout(set = 0, binding = 4, scalar) buffer Opacity { float opacity_logit[]; };
layout(set = 0, binding = 5, scalar) buffer ShDc { float sh_dc[]; };
layout(set = 0, binding = 6, scalar) buffer ShRest { float sh_rest[]; };  // from first_splat on, as m_rest
layout(set = 0, binding = 7, scalar) buffer MPosition { vec2 m_position[]; };
layout(set = 0, binding = 8, scalar) buffer MScale { vec2 m_scale[]; };
layout(set = 0, binding = 9, scalar) buffer MRotation { vec2 m_rotation[]; };
layout(set = 0, binding = 10, scalar) buffer MOpacity { vec2 m_opacity[]; };
layout(set = 0, binding = 11, scalar) buffer MShDc { vec2 m_dc[]; };
layout(set = 0, binding = 12, scalar) buffer MShRest { vec2 m_rest[]; };
layout(set = 0, binding = 13, scalar) readonly buffer PairCount { uint pair_count[]; };
layout(set = 0, binding = 14, scalar) readonly buffer PairBegin { uint pair_begin[]; };
layout(set = 0, binding = 20, scalar) readonly buffer PartialRest { float partial_rest[]; };
layout(set = 0, binding = 21, scalar) buffer GradientSum { vec2 gradient_sum[]; };  // sum of norms, frames
layout(set = 0, binding = 22, scalar) buffer Status { FrameStatus status; };
layout(set = 0, binding = 23, scalar) readonly buffer Smoothing { float smoothing[]; };  // [N] world, with SMOOTHING
layout(set = 0, binding = 24, scalar) buffer RestSum { float rest_sum[]; };  // as sh_rest, but with REST_EACH

const int SH_USED = (SH_DEGREE + 1) * (SH_DEGREE + 1) - 1;
const uint SH_STRIDE = uint((SH_STORED + 1) * (SH_STORED + 1) - 1) * 3u;

#define PARTIALS_BINDING 15
#include "effects/constants.glsl"
#include "kernels/kernel.glsl"
#include "lib/covariance.glsl"
#include "effects/antialias.glsl"
#include "effects/camera_model.glsl"
#include "lib/linear_id.glsl"
#include "lib/partials.glsl"
#include "lib/sh.glsl"
#include "optim/adam.glsl"
#include "backward/project_gradient.glsl"

const float FADING = 1.0;  // of a logit, in a frame: what Adam adds in 20 at most, so what many photos hold up stays

Partial sum_partials(uint i) {
    Partial sums = Partial(vec4(0.0), 0.0, 0.0, vec3(0.0));
    uint e = pair_begin[i];
    const uint end = e + pair_count[i];
    if (e == end) return sums;
    do {  // loops end at their bottoms: see emit_cells
        const uint stop = min(e + 32768u, end);  // some drivers end loops at 65,535
        do {
            const vec4 light = load_partial(e, 1u);
            sums.a += load_partial(e, 0u);
            sums.b += partial_rest[e];
            sums.d_opacity += light.x;
            sums.d_colour += light.yzw;
        } while (++e < stop);
    } while (e < end);
    return sums;
}

bool finite(SplatGradient g) {
    const uint ellipsoid = max(max(magnitude(g.position), magnitude(g.log_scale)), magnitude(g.rotation));
    const uint light = max(magnitude(g.colour), magnitude(vec3(g.opacity_logit, g.mean)));
    return below(max(ellipsoid, light), GRADIENT_LIMIT);
}

void update_rest(uint i, SplatGradient g) {
    float basis[SH_REST_MAX];
    sh_basis(g.direction, basis);
    for (int k = 0; k < SH_USED; ++k) {
        for (uint c = 0u; c < 3u; ++c) {
            const uint at = (i - args.first_splat) * SH_STRIDE + uint(k) * 3u + c;
            float gradient = basis[k] * g.colour[c];
            if (REST != REST_EACH) {
                gradient = rest_sum[at] + gradient * args.rest_share;
                rest_sum[at] = REST == REST_GATHER ? gradient : 0.0;
            }
            if (REST != REST_GATHER) {
                vec2 m = m_rest[at];
                sh_rest[at] = adam_step(sh_rest[at], m, gradient, args.rate_rest);
                m_rest[at] = m;
            }
        }
    }
}

void update_splat(uint i, SplatGradient g) {
    for (uint c = 0u; c < 3u; ++c) {
        const uint at = 3u * i + c;
        vec2 m = m_position[at];
        position[at] = adam_step(position[at], m, g.position[c], args.rate_position);
        m_position[at] = m;
        m = m_scale[at];
        const float before = log_scale[at], largest = max(before, args.largest_log_scale);
        const float after = adam_step(before, m, g.log_scale[c], args.rate_scale);
        log_scale[at] = after > largest ? largest : after;  // not min: what is no number stays none
        m_scale[at] = m;
        m = m_dc[at];
        sh_dc[at] = adam_step(sh_dc[at], m, SH_C0 * g.colour[c], args.rate_dc);
        m_dc[at] = m;
    }
    vec4 q = rotation[i];
    for (uint c = 0u; c < 4u; ++c) {
        vec2 m = m_rotation[4u * i + c];
        q[c] = adam_step(q[c], m, g.rotation[c], args.rate_rotation);
        m_rotation[4u * i + c] = m;
    }
    rotation[i] = q;
    vec2 m = m_opacity[i];
    float logit = adam_step(opacity_logit[i], m, g.opacity_logit, args.rate_opacity);
    const vec3 at = vec3(position[3u * i], position[3u * i + 1u], position[3u * i + 2u]);
    const float away = length(from_centre(cameras[args.camera_index], at));
    if (UPDATE == 1 && away < args.clearance) logit -= FADING;
    opacity_logit[i] = logit;
    m_opacity[i] = m;
    if (SH_DEGREE > 0 && (REST != REST_GATHER || pair_count[i] > 0u)) update_rest(i, g);
}

void main() {
    const uint i = args.first_splat + linear_id();
    if (i >= args.splat_end || status.overflow != 0u) return;
    SplatGradient g;
    g.position = g.log_scale = g.colour = g.direction = vec3(0.0);
    g.rotation = vec4(0.0);
    g.opacity_logit = 0.0;
    g.mean = vec2(0.0);
    if (pair_count[i] > 0u) {
        const CameraData camera = cameras[args.camera_index];
        g = project_gradient(camera, i, sum_partials(i));
        if (!finite(g)) {
            atomicAdd(status.bad_gradients, 1u);
            return;
        }
        const vec2 ndc = g.mean * 0.5 * vec2(camera.width, camera.height);
        gradient_sum[i] += vec2(length(ndc), 1.0);
    }
    // The regularisers. Adam makes a step of full length of any gradient that comes alone: at all frames that do not
    // show a splat they would take, in a large set, what a few of its photos never get to hold up.
    if (UPDATE == 1 && (pair_count[i] > 0u || args.regularise_unseen == 1u)) {
        const float o = 1.0 / (1.0 + exp(-opacity_logit[i]));
        g.opacity_logit += args.opacity_weight * o * (1.0 - o);
        for (uint c = 0u; c < 3u; ++c) {
            const float raw = log_scale[3u * i + c];
            if (abs(raw) <= LOG_SCALE_LIMIT) g.log_scale[c] += args.scale_weight * exp(raw);
        }
    }
    update_splat(i, g);
}
