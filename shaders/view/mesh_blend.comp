// SPDX-License-Identifier: MIT
// Blends each tile's splats as blend.comp does, but for each pixel only those whose middle is before the surface of a
// mesh; what light they leave shows the mesh.
// Place: in place of blend.comp, in the viewer, where a mesh is shown among splats.
// Work: one workgroup per tile and one subgroup per block of it, as in blend.comp. Shared memory: a subgroup's own
// lists; no barrier. Reads intersections, projected splats, depths and pixels of the mesh; writes the image and, where
// lists are too long for one dispatch, the pixels' state between them.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require

#include "shared/limits.h"
#include "shared/render_args.h"
#include "shared/view_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 32;  // TILE_PIXELS / PIXELS
layout(constant_id = 2) const float MIN_TRANSMITTANCE = TRANSMITTANCE_STOP * (1.0 - TRANSMITTANCE_SLACK);
layout(constant_id = 3) const uint SUBGROUP_SIZE = 8;
layout(constant_id = 4) const uint SEGMENT = 0;  // intersections of a list per dispatch; 0: all of them

#include "kernels/kernel.glsl"
layout(push_constant, scalar) uniform Push { MeshBlendArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer TileRange { uvec2 tile_range[]; };
layout(set = 0, binding = 1, scalar) readonly buffer IntersectionFromSorted { uint intersection_from_sorted[]; };
layout(set = 0, binding = 2, scalar) readonly buffer SplatFromIntersection { uint splat_from_intersection[]; };
layout(set = 0, binding = 6, scalar) readonly buffer SplatExponent { float splat_exponent[]; };  // where SHAPED
layout(set = 0, binding = 7, scalar) readonly buffer Depth { uint mesh_depth[]; };  // [H][W] bits of a float
layout(set = 0, binding = 8, scalar) readonly buffer Mesh { uint mesh[]; };         // [H][W] B8G8R8A8
layout(set = 0, binding = 9, scalar) buffer ImageOut { float image[]; };            // [3][H][W]
layout(set = 0, binding = 10, scalar) buffer FinalT { float final_transmittance[]; };

#define SHAPE_BINDING 3
#define LIGHT_BINDING 4
#define BOUND_BINDING 5
#include "lib/projected.glsl"
#include "lib/area.glsl"
#include "lib/list_part.glsl"
const uint CHUNK = 128u;
#include "lib/hits.glsl"

struct Pixels {
    float transmittance[PIXELS];  // negative once the pixel has ended
    float farthest[PIXELS];       // depth of the surface
    vec3 colour[PIXELS];
};

// A splat of the list.
struct Blended {
    vec4 shape, light;
    float l22, exponent, z;
};

Blended load_hit(uint hit) {
    const uint splat = hit_splat[hits_base() + hit];
    Blended s;
    s.shape = load_shape(splat, s.l22);
    s.light = load_light(splat);
    s.exponent = 0.0;
    if (SHAPED) s.exponent = splat_exponent[splat];
    s.z = splat_bound[splat].z;
    return s;
}

Blended broadcast(Blended s, uint lane) {
    Blended to;
    to.shape = subgroupBroadcast(s.shape, lane);
    to.light = subgroupBroadcast(s.light, lane);
    to.l22 = subgroupBroadcast(s.l22, lane);
    to.exponent = 0.0;
    if (SHAPED) to.exponent = subgroupBroadcast(s.exponent, lane);
    to.z = subgroupBroadcast(s.z, lane);
    return to;
}

void blend_splat(inout Pixels px, Blended s, vec2 centre) {
    for (uint k = 0u; k < PIXELS; ++k) {
        const vec2 d = s.shape.xy - centre - vec2(slot_offset(k));
        const float x = s.shape.z * d.x + s.shape.w * d.y, y = s.l22 * d.y;
        const float raw = min(s.light.w * kernel_value(x * x + y * y, s.exponent), ALPHA_MAX);
        const float alpha = raw >= ALPHA_CUTOFF ? raw : 0.0;
        const float before = px.transmittance[k], wanted = alpha * before, next = before - wanted;
        const bool goes_on = next >= MIN_TRANSMITTANCE && s.z <= px.farthest[k];
        px.colour[k] += (goes_on ? wanted : 0.0) * s.light.rgb;
        px.transmittance[k] = goes_on ? next : -abs(before);
    }
}

// Blends all collected splats, at least one, in order; returns false when every pixel has ended.
bool blend_hits(inout Pixels px, vec2 centre, uint count) {
    float alive = 1.0;
    uint batch = 0u;
    do {  // tested at the bottom, as is the inner loop: see emit_cells
        const Blended mine = load_hit(min(batch + gl_SubgroupInvocationID, count - 1u));
        const uint end = min(SUBGROUP_SIZE, count - batch);
        uint lane = 0u;
        do {
            blend_splat(px, broadcast(mine, lane), centre);
        } while (++lane < end);
        alive = px.transmittance[0];
        for (uint k = 1u; k < PIXELS; ++k) alive = max(alive, px.transmittance[k]);
        batch += SUBGROUP_SIZE;
    } while (batch < count && subgroupAny(alive > 0.0));
    return subgroupAny(alive > 0.0);
}

void load(inout Pixels px, uvec2 first) {
    const uint plane = args.width * args.height;
    for (uint k = 0u; k < PIXELS; ++k) {
        const uvec2 at = first + slot_offset(k);
        const bool is_there = at.x < args.width && at.y < args.height;
        px.transmittance[k] = is_there ? 1.0 : -1.0;
        px.farthest[k] = 0.0;
        px.colour[k] = vec3(0.0);
        if (!is_there) continue;
        const uint o = at.y * args.width + at.x;
        px.farthest[k] = uintBitsToFloat(mesh_depth[o]) * (1.0 - args.nearer);
        if (SEGMENT == 0u || args.segment == 0u) continue;
        px.transmittance[k] = final_transmittance[o];
        px.colour[k] = vec3(image[o], image[plane + o], image[2u * plane + o]);
    }
}

void store(Pixels px, uvec2 first) {
    const bool more = SEGMENT > 0u && args.segment + 1u < args.segments;
    const uint plane = args.width * args.height;
    for (uint k = 0u; k < PIXELS; ++k) {
        const uvec2 at = first + slot_offset(k);
        if (at.x >= args.width || at.y >= args.height) continue;
        const uint o = at.y * args.width + at.x;
        const vec3 behind = more ? vec3(0.0) : unpackUnorm4x8(mesh[o]).bgr;
        const vec3 colour = px.colour[k] + abs(px.transmittance[k]) * behind;
        image[o] = colour.r;
        image[plane + o] = colour.g;
        image[2u * plane + o] = colour.b;
        if (SEGMENT > 0u) final_transmittance[o] = px.transmittance[k];
    }
}

void main() {
    const uvec2 tile = gl_WorkGroupID.xy;
    const uvec2 range = list_part(tile_range[tile.y * args.tiles_x + tile.x]);
    const uint bits = area_bits(gl_SubgroupID);
    const uvec2 first = tile * TILE_SIZE + first_pixel(gl_SubgroupID, gl_SubgroupInvocationID);
    Pixels px;
    load(px, first);
    if (range.x < range.y) {
        uint chunk = range.x;
        bool alive = true;
        do {
            const uint count = collect_hits(chunk, min(chunk + CHUNK, range.y), bits);
            if (count > 0u) alive = blend_hits(px, vec2(first) + 0.5, count);
            chunk += CHUNK;
        } while (alive && chunk < range.y);
    }
    store(px, first);
}
