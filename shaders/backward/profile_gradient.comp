// SPDX-License-Identifier: MIT
// What the gradient of a learned profile w(q) is made of: sums over pixels and splats of G T_k(2 sqrt(u) - 1), with G
// = opacity dL/dalpha, T_k of Chebyshev and u = 1 - q/R^2. The derivative of w by any parameter is a polynomial of
// sqrt(u), so that the host has dL/d(parameter) from these sums (engine/kernels/learned_profile.h).
// Place: after the loss, before the backward blend, which overwrites what this pass reads where lists are long. Runs in
// some iterations only, as a profile moves slowly. Source: docs/math.md, A profile that is learned.
// Work: a workgroup a block of 8 x 8 pixels, a thread a pixel, which walks its tile's list from the end as
// blend_backward.comp does. A tree in shared memory adds the threads in a fixed order; no subgroups, no atomics on
// floats. Writes PROFILE_SUMS floats a block. Lists that are too long for one dispatch are processed SEGMENT
// intersections at a time, the last ones first; state holds the pixels' transmittance and what is behind in between.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/profile_args.h"
#include "shared/render_args.h"

layout(local_size_x = PROFILE_BLOCK_THREADS) in;
layout(constant_id = 4) const uint SEGMENT = 0;  // intersections of a list per dispatch; 0: all of them
layout(constant_id = 31) const int ALPHA_GRADIENT = 0;  // 1: d_image has one more plane, dL/d(1 - transmittance)

#include "kernels/kernel.glsl"
layout(push_constant, scalar) uniform Push { BlendArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer TileRange { uvec2 tile_range[]; };
layout(set = 0, binding = 1, scalar) readonly buffer IntersectionFromSorted { uint intersection_from_sorted[]; };
layout(set = 0, binding = 2, scalar) readonly buffer SplatFromIntersection { uint splat_from_intersection[]; };
layout(set = 0, binding = 6, scalar) readonly buffer DImage { float d_image[]; };  // [3][H][W] and more
layout(set = 0, binding = 7, scalar) readonly buffer FinalT { float final_transmittance[]; };
layout(set = 0, binding = 8, scalar) readonly buffer LastIntersection { uint last_intersection[]; };
layout(set = 0, binding = 9, scalar) buffer Rows { float rows[]; };  // [4 T][PROFILE_SUMS]
layout(set = 0, binding = 10, scalar) buffer State { vec2 state[]; };  // [H][W] where SEGMENT > 0

#define SHAPE_BINDING 3
#define LIGHT_BINDING 4
#define BOUND_BINDING 5
#include "lib/projected.glsl"
#include "lib/depth_sum.glsl"
#include "lib/list_part.glsl"
#include "lib/pixel_slot.glsl"

shared uint last_of_block;
shared float part[PROFILE_SUMS * PROFILE_BLOCK_THREADS];

struct Pixel {
    vec2 centre;
    vec3 d_colour;
    float d_depth, transmittance, behind;  // of what lies behind the splats that are still to come
    uint last;
};

// A pixel outside the picture has no last intersection, and nothing counts there.
Pixel load_pixel(uvec2 at, bool first) {
    Pixel px = Pixel(vec2(at) + 0.5, vec3(0.0), 0.0, 1.0, 0.0, 0u);
    if (at.x >= args.width || at.y >= args.height) return px;
    const uint o = at.y * args.width + at.x, plane = args.width * args.height;
    px.d_colour = vec3(d_image[o], d_image[plane + o], d_image[2u * plane + o]);
    px.last = last_intersection[o];
    if (DEPTH_SUM == 1) px.d_depth = d_image[DEPTH_GRADIENT_PLANE * plane + o];
    px.transmittance = final_transmittance[o];
    if (ALPHA_GRADIENT == 1) px.behind = -d_image[3u * plane + o];
    px.behind += dot(px.d_colour, vec3(args.background_r, args.background_g, args.background_b));
    if (SEGMENT > 0u && !first) {
        px.transmittance = state[o].x;
        px.behind = state[o].y;
    }
    return px;
}

// Adds G T_k for intersection j of the sorted list.
void add_splat(inout float sum[PROFILE_SUMS], inout Pixel px, uint splat, bool reached) {
    float l22, w, slope, by_exponent;
    const vec4 shape = load_shape(splat, l22), light = load_light(splat);
    const vec2 to_mean = shape.xy - px.centre;
    const float x = shape.z * to_mean.x + shape.w * to_mean.y, y = l22 * to_mean.y, q = x * x + y * y;
    kernel_value_slope(q, 0.0, w, slope, by_exponent);
    const float raw = light.w * w;
    const bool counts = raw >= ALPHA_CUTOFF && reached;
    const float alpha = counts ? min(raw, ALPHA_MAX) : 0.0;
    const float before = px.transmittance / (1.0 - alpha);
    float ahead = dot(light.rgb, px.d_colour) - px.behind;
    if (DEPTH_SUM == 1) ahead += splat_bound[splat].z * px.d_depth;
    const float g = counts && raw < ALPHA_MAX ? light.w * before * ahead : 0.0;
    px.behind += alpha * ahead;
    px.transmittance = before;
    const float v = 2.0 * sqrt(max(1.0 - q * KERNEL_INVERSE_SUPPORT, 0.0)) - 1.0;
    float t0 = g, t1 = g * v;  // G T_k and G T_k+1
    for (uint k = 0u; k < PROFILE_SUMS; ++k) {
        sum[k] += t0;
        const float t2 = 2.0 * v * t1 - t0;
        t0 = t1;
        t1 = t2;
    }
}

void add_threads(float sum[PROFILE_SUMS], uint row, bool first) {
    const uint thread = gl_LocalInvocationID.x;
    for (uint k = 0u; k < PROFILE_SUMS; ++k) part[k * PROFILE_BLOCK_THREADS + thread] = sum[k];
    for (uint half_size = PROFILE_BLOCK_THREADS / 2u; half_size > 0u; half_size /= 2u) {
        barrier();
        if (thread < half_size)
            for (uint k = 0u; k < PROFILE_SUMS; ++k)
                part[k * PROFILE_BLOCK_THREADS + thread] += part[k * PROFILE_BLOCK_THREADS + thread + half_size];
    }
    barrier();
    if (thread >= PROFILE_SUMS) return;
    const uint to = row * PROFILE_SUMS + thread;
    const float before = first ? 0.0 : rows[to];
    rows[to] = before + part[thread * PROFILE_BLOCK_THREADS];
}

void main() {
    const uint thread = gl_LocalInvocationID.x;
    const uvec2 block = gl_WorkGroupID.xy, tile = block / 2u;
    const uvec2 at = block * 8u + uvec2(thread & 7u, thread >> 3);
    const uvec2 range = list_part(tile_range[tile.y * args.tiles_x + tile.x]);
    const bool first = SEGMENT == 0u || args.segment + 1u == args.segments;
    Pixel px = load_pixel(at, first);
    if (thread == 0u) last_of_block = 0u;
    barrier();
    atomicMax(last_of_block, px.last);
    barrier();
    const uint bit = block_bit((block.y & 1u) * 2u + (block.x & 1u));
    float sum[PROFILE_SUMS];
    for (uint k = 0u; k < PROFILE_SUMS; ++k) sum[k] = 0.0;
    for (uint j = min(last_of_block, range.y); j > range.x; --j) {
        const uint intersection = splat_from_intersection[intersection_from_sorted[j - 1u]];
        if ((intersection & bit) == 0u) continue;
        add_splat(sum, px, intersection & INTERSECTION_SPLAT_MASK, j <= px.last);
    }
    if (SEGMENT > 0u && at.x < args.width && at.y < args.height)
        state[at.y * args.width + at.x] = vec2(px.transmittance, px.behind);
    add_threads(sum, block.y * 2u * args.tiles_x + block.x, first);
}
