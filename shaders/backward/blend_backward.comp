// SPDX-License-Identifier: MIT
// Gradients of blend.comp. It turns dL/dimage into sums over pixels, from which dL/d(mean, l11, l21, l22, opacity,
// colour) follow: PARTIALS floats for each splat-tile intersection, in the intersection's own slot, so that the sums
// per splat need no atomics and repeat bit by bit.
// Place: after the loss. Source: docs/math.md, Gradients.
// blend_backward_team.comp and blend_backward_buckets.comp are two other ways to the same sums.
// Work: one subgroup per tile, which takes its areas one after another with pixels dealt as in blend.comp. The lanes'
// sums are reduced within the subgroup and added to the slot, which nobody else writes. No shared memory, no barrier.
// It reads what the forward pass stored; slots must be zero before. Lists that are too long for one dispatch are
// processed SEGMENT intersections at a time, the last ones first; final_transmittance and behind hold the pixels' state
// in between.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_shuffle : require

#include "shared/limits.h"
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
layout(set = 0, binding = 7, scalar) buffer FinalT { float final_transmittance[]; };
layout(set = 0, binding = 8, scalar) readonly buffer LastIntersection { uint last_intersection[]; };
layout(set = 0, binding = 14, scalar) buffer PartialRest { float partial_rest[]; };  // [K][RESTS]
layout(set = 0, binding = 15, scalar) buffer Behind { float behind[]; };  // [H][W] where SEGMENT > 0
layout(set = 0, binding = 16, scalar) readonly buffer SplatExponent { float splat_exponent[]; };  // where SHAPED
layout(set = 0, binding = 17, scalar) buffer PartialExponent { float partial_exponent[]; };  // [K] where SHAPED

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
#define PARTIALS_BINDING 9
#define PARTIALS_PUT +=
#include "lib/partials.glsl"
#include "lib/reduce.glsl"
#include "backward/depth_gradient.glsl"
#include "backward/splat_sums.glsl"

uint place_of(uint j) {
    return intersection_from_sorted[j];
}
void put_sums(uint slot, float v[PARTIALS], float rest) {
    const vec2 mine = transposed_sum(v);
    rest = subgroup_sum(rest);
    const uint lane = gl_SubgroupInvocationID;
    if (SUBGROUP_SIZE == 4u) {
        put_partial(slot, 2u * lane, mine.x);
        put_partial(slot, 2u * lane + 1u, mine.y);
    } else if (SUBGROUP_SIZE == PARTIALS || lane < PARTIALS) {
        put_partial(slot, lane, mine.x);
    }
    if (lane == 0u) partial_rest[RESTS * slot] += rest;
}
void put_exponent(uint slot, float value) {
    value = subgroup_sum(value);
    if (gl_SubgroupInvocationID == 0u) partial_exponent[slot] += value;
}
void put_depth(uint slot, float value) {
    value = subgroup_sum(value);
    if (gl_SubgroupInvocationID == 0u) partial_rest[RESTS * slot + 1u] += value;
}
#include "backward/area_walk.glsl"

void blend_area(uint area, uvec2 tile, uvec2 range) {
    const uvec2 first = tile * TILE_SIZE + first_pixel(area, gl_SubgroupInvocationID);
    Pixels px;
    const uint last = subgroupMax(load_pixels(first, px));
    const uint end = min(last, range.y);
    if (end <= range.x) return;
    if (SEGMENT > 0u && last > range.y) load_behind(px, first);
    for (uint chunk = range.x + (end - 1u - range.x) / CHUNK * CHUNK;; chunk -= CHUNK) {
        const uint count = collect_hits(chunk, min(chunk + CHUNK, end), area_bits(area));
        if (count > 0u) blend_hits(px, vec2(first) + 0.5, count);
        if (chunk == range.x) break;
    }
    if (SEGMENT > 0u && args.segment > 0u) store_state(px, first);
}

void main() {
    const uvec2 tile = own_tile();
    const uvec2 range = list_part(tile_range[tile.y * args.tiles_x + tile.x]);
    if (range.x >= range.y) return;
    uint area = 0u;
    do blend_area(area, tile, range);
    while (++area < AREAS);
}
