// SPDX-License-Identifier: MIT
// What the gradient of a learned profile w(q) is made of: sums over pixels and splats of G T_k(2 sqrt(u) - 1), with G
// = opacity dL/dalpha, T_k of Chebyshev and u = 1 - q/R^2. The derivative of w by any parameter is a polynomial of
// sqrt(u), so that the host has dL/d(parameter) from these sums (engine/kernels/learned_profile.h).
// Place: after the loss, before the backward blend, which overwrites what this pass reads where lists are long. Runs in
// some iterations only, as a profile moves slowly. Source: docs/math.md, A profile that is learned.
// Work: one subgroup per tile, which takes its areas one after another with pixels dealt as in blend.comp and walks the
// list from its end as blend_backward.comp does. A thread keeps its sums in registers over all of its pixels; at the end
// they are added within the subgroup. No barrier. Writes PROFILE_SUMS floats a tile. Lists that are too long for one
// dispatch are processed SEGMENT intersections at a time, the last ones first; final_transmittance, then a copy, and
// behind hold the pixels' state in between.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_shuffle : require

#include "shared/limits.h"
#include "shared/profile_args.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 8;  // SUBGROUP_SIZE
layout(constant_id = 3) const uint SUBGROUP_SIZE = 8;
layout(constant_id = 4) const uint SEGMENT = 0;  // intersections of a list per dispatch; 0: all of them
layout(constant_id = 31) const int ALPHA_GRADIENT = 0;  // 1: d_image has one more plane, dL/d(1 - transmittance)

#include "kernels/kernel.glsl"
layout(push_constant, scalar) uniform Push { BlendArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer TileRange { uvec2 tile_range[]; };
layout(set = 0, binding = 1, scalar) readonly buffer IntersectionFromSorted { uint intersection_from_sorted[]; };
layout(set = 0, binding = 2, scalar) readonly buffer SplatFromIntersection { uint splat_from_intersection[]; };
layout(set = 0, binding = 6, scalar) readonly buffer DImage { float d_image[]; };  // [3][H][W] and more
layout(set = 0, binding = 7, scalar) buffer FinalT { float final_transmittance[]; };  // written where SEGMENT > 0
layout(set = 0, binding = 8, scalar) readonly buffer LastIntersection { uint last_intersection[]; };
layout(set = 0, binding = 9, scalar) buffer Rows { float rows[]; };  // [T][PROFILE_SUMS]
layout(set = 0, binding = 10, scalar) buffer Behind { float behind[]; };  // [H][W] where SEGMENT > 0

#define SHAPE_BINDING 3
#define LIGHT_BINDING 4
#define BOUND_BINDING 5
#include "lib/projected.glsl"
#include "lib/area.glsl"
#include "lib/depth_sum.glsl"
#include "lib/list_part.glsl"
#include "lib/own_tile.glsl"
const uint CHUNK = 128u;
#include "lib/hits.glsl"
#include "lib/reduce.glsl"
#include "backward/area_pixels.glsl"
#include "backward/area_state.glsl"

float sum[PROFILE_SUMS];  // the thread's

// What a splat adds at pixel k of the thread: G T_k to the sums. The walk is that of backward/splat_sums.glsl.
void add_splat(inout Pixels px, uint k, vec2 to_mean, vec4 shape, float l22, vec4 light, float z, bool reached) {
    const float x = shape.z * to_mean.x + shape.w * to_mean.y, y = l22 * to_mean.y, q = x * x + y * y;
    float w, slope, by_exponent;
    kernel_value_slope(q, 0.0, w, slope, by_exponent);
    const float raw = light.w * w;
    const bool counts = raw >= ALPHA_CUTOFF && reached;
    const float alpha = mix(0.0, min(raw, ALPHA_MAX), counts);
    const float before = px.transmittance[k] / (1.0 - alpha);
    float ahead = dot(light.rgb, px.d_colour[k]) - px.behind[k];
    if (DEPTH_SUM == 1) ahead += depth_by_weight(z, d_depth[k]);
    const float g = mix(0.0, light.w * before * ahead, counts && raw < ALPHA_MAX);
    px.behind[k] += alpha * ahead;
    px.transmittance[k] = before;
    const float v = 2.0 * sqrt(max(1.0 - q * KERNEL_INVERSE_SUPPORT, 0.0)) - 1.0;
    float t0 = g, t1 = g * v;  // G T_n and G T_n+1
    for (uint n = 0u; n < PROFILE_SUMS; ++n) {
        sum[n] += t0;
        const float t2 = 2.0 * v * t1 - t0;
        t0 = t1;
        t1 = t2;
    }
}

// As blend_hits of backward/area_walk.glsl.
void add_hits(inout Pixels px, vec2 centre, uint count) {
    uint rest = count;
    do {
        const uint size = min(rest, SUBGROUP_SIZE);
        rest -= size;
        vec4 shape = vec4(0.0), light = vec4(0.0);
        float l22 = 0.0, depth = 0.0;
        uint number = 0u;
        if (gl_SubgroupInvocationID < size) {
            const uint at = hits_base() + rest + gl_SubgroupInvocationID;
            const uint splat = hit_splat[at];
            number = hit_index[at] + 1u;
            shape = load_shape(splat, l22);
            light = load_light(splat);
            if (DEPTH_SUM == 1) depth = splat_bound[splat].z;
        }
        uint lane = size;
        do {
            --lane;
            const vec4 s = subgroupBroadcast(shape, lane), c = subgroupBroadcast(light, lane);
            const float l = subgroupBroadcast(l22, lane);
            const float z = DEPTH_SUM == 1 ? subgroupBroadcast(depth, lane) : 0.0;
            const uint n = subgroupBroadcast(number, lane);
            for (uint k = 0u; k < PIXELS; ++k)
                add_splat(px, k, s.xy - centre - vec2(slot_offset(k)), s, l, c, z, n <= px.last[k]);
        } while (lane > 0u);
    } while (rest > 0u);
}

void add_area(uint area, uvec2 tile, uvec2 range) {
    const uvec2 first = tile * TILE_SIZE + first_pixel(area, gl_SubgroupInvocationID);
    Pixels px;
    const uint last = subgroupMax(load_pixels(first, px));
    const uint end = min(last, range.y);
    if (end <= range.x) return;
    if (SEGMENT > 0u && last > range.y) load_behind(px, first);
    for (uint chunk = range.x + (end - 1u - range.x) / CHUNK * CHUNK;; chunk -= CHUNK) {
        const uint count = collect_hits(chunk, min(chunk + CHUNK, end), area_bits(area));
        if (count > 0u) add_hits(px, vec2(first) + 0.5, count);
        if (chunk == range.x) break;
    }
    if (SEGMENT > 0u && args.segment > 0u) store_state(px, first);
}

void main() {
    const uvec2 tile = own_tile();
    const uint number = tile.y * args.tiles_x + tile.x;
    const uvec2 range = list_part(tile_range[number]);
    for (uint n = 0u; n < PROFILE_SUMS; ++n) sum[n] = 0.0;
    if (range.x < range.y) {
        uint area = 0u;
        do add_area(area, tile, range);
        while (++area < AREAS);
    }
    const bool first = SEGMENT == 0u || args.segment + 1u == args.segments;
    for (uint n = 0u; n < PROFILE_SUMS; ++n) {
        const float total = subgroup_sum(sum[n]);
        const uint to = number * PROFILE_SUMS + n;
        if (gl_SubgroupInvocationID == 0u) rows[to] = (first ? 0.0 : rows[to]) + total;
    }
}
