// Gradients of blend.comp: from dL/dimage to sums over pixels from which dL/d(mean, l11, l21, l22, opacity, colour)
// follow, PARTIALS floats for each splat-tile intersection in the intersection's own slot, so that sums per splat need
// no atomics and repeat bit by bit. Place: after the loss. Source: docs/math.md, Gradients.
// One of two ways to the same sums; the other is blend_backward_buckets.comp.
// Work: one subgroup a tile, its areas one after another, pixels dealt as in blend.comp; the lanes' sums are
// reduced within the subgroup and added to the slot, which nobody else writes. No shared memory, no barrier.
// Reads what the forward pass stored; slots must be zero before. Lists too long for one dispatch are worked off
// SEGMENT intersections at a time, the last ones first; final_transmittance and behind hold the pixels' state in
// between.
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
layout(constant_id = 4) const uint SEGMENT = 0;  // intersections of a list a dispatch; 0: all of them
layout(constant_id = 31) const int ALPHA_GRADIENT = 0;  // 1: d_image has a plane more, dL/d(1 - transmittance)

#include "kernels/kernel.glsl"
layout(push_constant, scalar) uniform Push { BlendArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer TileRange { uvec2 tile_range[]; };
layout(set = 0, binding = 1, scalar) readonly buffer IntersectionFromSorted { uint intersection_from_sorted[]; };
layout(set = 0, binding = 2, scalar) readonly buffer SplatFromIntersection { uint splat_from_intersection[]; };
layout(set = 0, binding = 6, scalar) readonly buffer DImage { float d_image[]; };  // [3][H][W]
layout(set = 0, binding = 7, scalar) buffer FinalT { float final_transmittance[]; };
layout(set = 0, binding = 8, scalar) readonly buffer LastIntersection { uint last_intersection[]; };
layout(set = 0, binding = 14, scalar) buffer PartialRest { float partial_rest[]; };  // [K]
layout(set = 0, binding = 15, scalar) buffer Behind { float behind[]; };  // [H][W] where SEGMENT > 0

#define SHAPE_BINDING 3
#define LIGHT_BINDING 4
#define BOUND_BINDING 5
#include "lib/projected.glsl"
#include "lib/area.glsl"
#include "lib/list_part.glsl"
const uint CHUNK = 128u;
#include "lib/hits.glsl"
#define PARTIALS_BINDING 9
#define PARTIALS_ADD
#include "lib/partials.glsl"
#include "lib/reduce.glsl"
#include "backward/splat_sums.glsl"

struct Pixels {
    float transmittance[PIXELS];
    float behind[PIXELS];
    vec3 d_colour[PIXELS];
    uint last[PIXELS];
};

uint load_pixels(uvec2 first, out Pixels px) {
    const vec3 background = vec3(args.background_r, args.background_g, args.background_b);
    const uint plane = args.width * args.height;
    uint last = 0u;
    for (uint k = 0u; k < PIXELS; ++k) {
        const uvec2 at = first + slot_offset(k);
        px.d_colour[k] = vec3(0.0);
        px.behind[k] = 0.0;
        px.transmittance[k] = 1.0;
        px.last[k] = 0u;
        if (at.x < args.width && at.y < args.height) {
            const uint o = at.y * args.width + at.x;
            px.d_colour[k] = vec3(d_image[o], d_image[plane + o], d_image[2u * plane + o]);
            px.transmittance[k] = final_transmittance[o];
            px.last[k] = last_intersection[o];
            if (ALPHA_GRADIENT == 1) px.behind[k] = -d_image[3u * plane + o];
        }
        px.behind[k] += dot(px.d_colour[k], background);
        last = max(last, px.last[k]);
    }
    return last;
}

Sums splat_sums(inout Pixels px, vec2 d, vec4 shape, vec4 light, float l22, uint number) {
    Sums s = NO_SUMS;
    for (uint k = 0u; k < PIXELS; ++k)
        add_pixel(s, px.transmittance[k], px.behind[k], d - vec2(slot_offset(k)), shape, l22, light,
                  px.d_colour[k], number <= px.last[k]);
    return s;
}

// The collected splats of an area, at least one, last to first.
void blend_hits(inout Pixels px, vec2 centre, uint count) {
    uint rest = count;
    do {  // ends at its bottom, as the one within: see emit_cells
        const uint size = min(rest, SUBGROUP_SIZE);
        rest -= size;
        vec4 shape = vec4(0.0), light = vec4(0.0);
        float l22 = 0.0;
        uint number = 0u, slot = 0u;
        if (gl_SubgroupInvocationID < size) {
            const uint at = hits_base() + rest + gl_SubgroupInvocationID;
            const uint splat = hit_splat[at];
            number = hit_index[at] + 1u;
            slot = intersection_from_sorted[number - 1u];
            shape = load_shape(splat, l22);
            light = load_light(splat);
        }
        uint lane = size;
        do {
            --lane;
            const vec4 s = subgroupBroadcast(shape, lane);
            const vec4 c = subgroupBroadcast(light, lane);
            const Sums sums = splat_sums(px, s.xy - centre, s, c, subgroupBroadcast(l22, lane),
                                         subgroupBroadcast(number, lane));
            float parts[PARTIALS] =
                float[](sums.gx * c.w, sums.gxx * c.w, sums.gxdy * c.w, sums.gdy * c.w,
                        sums.opacity, sums.colour.r, sums.colour.g, sums.colour.b);
            add_to_slot(subgroupBroadcast(slot, lane), parts, sums.gdydy * c.w);
        } while (lane > 0u);
    } while (rest > 0u);
}

// What is behind the intersections of this dispatch, from and for the other dispatches.
void load_behind(inout Pixels px, uvec2 first) {
    for (uint k = 0u; k < PIXELS; ++k) {
        const uvec2 at = first + slot_offset(k);
        if (at.x < args.width && at.y < args.height) px.behind[k] = behind[at.y * args.width + at.x];
    }
}
void store_state(Pixels px, uvec2 first) {
    for (uint k = 0u; k < PIXELS; ++k) {
        const uvec2 at = first + slot_offset(k);
        if (at.x >= args.width || at.y >= args.height) continue;
        final_transmittance[at.y * args.width + at.x] = px.transmittance[k];
        behind[at.y * args.width + at.x] = px.behind[k];
    }
}

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
    const uvec2 tile = gl_WorkGroupID.xy;
    const uvec2 range = list_part(tile_range[tile.y * args.tiles_x + tile.x]);
    if (range.x >= range.y) return;
    uint area = 0u;
    do blend_area(area, tile, range);
    while (++area < AREAS);
}
