// SPDX-License-Identifier: MIT
// Blends each tile's splats front to back. alpha = min(0.99, opacity * w(q)), and nothing below the cut-off. A pixel
// ends before the splat that would bring its transmittance below 1e-4, less the slack of limits.h.
// Place: last pass of the forward walk. Source: 3DGS section 4; kernels of DARB-Splatting.
// Work: one workgroup per tile and one subgroup per area of it, with PIXELS pixels per thread in registers. Each lane
// loads one intersection of the tile's list, and those whose ellipse touches the area are broadcast in turn. Shared
// memory: a subgroup's own lists; no barrier. Reads intersections and projected splats; writes the image and, for the
// backward pass, the final transmittance and where each pixel ended, with CHECKPOINTS also the records of
// lib/bucket.glsl. Lists that are too long for one dispatch are processed SEGMENT intersections at a time; between the
// dispatches the outputs hold the pixels' state.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require

#include "forward/blend_interface.glsl"
#include "forward/blend_pixels.glsl"

// Blends one splat into all pixels of the thread. d: mean - centre of the thread's first pixel.
void blend_splat(inout Pixels px, vec2 d, vec4 shape, vec4 light, float l22, float exponent, uint number,
                 vec3 depth) {
    for (uint k = 0u; k < PIXELS; ++k) {
        const vec2 to_mean = d - vec2(slot_offset(k));
        const float x = shape.z * to_mean.x + shape.w * to_mean.y, y = l22 * to_mean.y;
        const float raw = min(light.w * kernel_value(x * x + y * y, exponent), ALPHA_MAX);
        const float alpha = raw >= ALPHA_CUTOFF ? raw : 0.0;
        if (DEPTH_ORDER == DEPTH_ORDER_PIXEL) {
            const float z = alpha > 0.0 ? depth.x - depth.y * x - depth.z * y : NO_DEPTH;
            const vec4 nearest = exchange_nearest(k, z, vec4(light.rgb, alpha));
            blend_sample(px, k, nearest.a, nearest.rgb, 0.0, number);
        } else {
            blend_sample(px, k, alpha, light.rgb, depth.x, number);
        }
    }
}

// Blends all collected splats, at least one, in order; returns false when every pixel has ended.
bool blend_hits(inout Pixels px, vec2 centre, uint count) {
    float alive = 1.0;
    uint batch = 0u;
    do {  // tested at the bottom, as is the inner loop: see emit_cells
        const uint mine = batch + gl_SubgroupInvocationID;
        vec4 shape = vec4(0.0), light = vec4(0.0);
        vec3 depth = vec3(0.0);
        float l22 = 0.0, exponent = 0.0;
        uint number = 0u;
        if (mine < count) {
            const uint splat = hit_splat[hits_base() + mine];
            number = hit_index[hits_base() + mine] + 1u;
            shape = load_shape(splat, l22);
            light = load_light(splat);
            if (SHAPED) exponent = splat_exponent[splat];
            if (DEPTH_ORDER == DEPTH_ORDER_PIXEL) depth = load_depth(splat);
            if (DEPTH_SUM == 1) depth.x = splat_bound[splat].z;
        }
        const uint end = min(SUBGROUP_SIZE, count - batch);
        uint lane = 0u;
        do {
            const vec4 s = subgroupBroadcast(shape, lane);
            vec3 z = vec3(0.0);
            if (DEPTH_ORDER == DEPTH_ORDER_PIXEL) z = subgroupBroadcast(depth, lane);
            if (DEPTH_SUM == 1) z.x = subgroupBroadcast(depth.x, lane);
            blend_splat(px, s.xy - centre, s, subgroupBroadcast(light, lane),
                        subgroupBroadcast(l22, lane), SHAPED ? subgroupBroadcast(exponent, lane) : 0.0,
                        subgroupBroadcast(number, lane), z);
        } while (++lane < end);
        alive = px.transmittance[0];
        for (uint k = 1u; k < PIXELS; ++k) alive = max(alive, px.transmittance[k]);
        batch += SUBGROUP_SIZE;
    } while (batch < count && subgroupAny(alive >= 0.0));
    return subgroupAny(alive > 0.0);
}

#include "forward/blend_state.glsl"

// Writes the checkpoint at the end of a bucket.
void store_checkpoint(Pixels px, uint record) {
    for (uint k = 0u; k < PIXELS; ++k) {
        const uint slot = gl_SubgroupID * AREA_PIXELS + k * SUBGROUP_SIZE + gl_SubgroupInvocationID;
        for (int c = 0; c < 3; ++c)
            checkpoints[checkpoint_at(record, uint(c), slot)] = bucket_colour[k][c];
        checkpoints[checkpoint_at(record, TRANSMITTANCE_PLANE, slot)] = abs(px.transmittance[k]);
        if (DEPTH_SUM == 1) {
            checkpoints[checkpoint_at(record, BUCKET_DEPTH_PLANE, slot)] = bucket_depth[k];
            bucket_depth[k] = 0.0;
        }
        if (DEPTH_SPREAD == 1) {
            checkpoints[checkpoint_at(record, BUCKET_SQUARE_PLANE, slot)] = bucket_square[k];
            bucket_square[k] = 0.0;
        }
        bucket_colour[k] = vec3(0.0);
    }
}

void main() {
    const uvec2 tile = own_tile();
    const uint tile_index = tile.y * args.tiles_x + tile.x;
    const uvec2 whole = tile_range[tile_index], range = list_part(whole);
    const uint bits = area_bits(gl_SubgroupID);
    const uvec2 first = tile * TILE_SIZE + first_pixel(gl_SubgroupID, gl_SubgroupInvocationID);
    const vec2 centre = vec2(first) + 0.5;

    Pixels px;
    for (uint k = 0u; k < PIXELS; ++k) {
        const uvec2 at = first + slot_offset(k);
        px.transmittance[k] = at.x < args.width && at.y < args.height ? 1.0 : -1.0;
        px.colour[k] = vec3(0.0);
        px.last[k] = 0u;
        if (DEPTH_ORDER == DEPTH_ORDER_PIXEL) clear_window(k);
        if (CHECKPOINTS == 1) bucket_colour[k] = vec3(0.0);
        clear_depths(k);
    }
    if (SEGMENT > 0u && args.segment > 0u) load(px, first);
    if (range.x < range.y) {
        uint chunk = range.x;
        bool alive = true;
        do {
            const uint count = collect_hits(chunk, min(chunk + CHUNK, range.y), bits);
            if (count > 0u) alive = blend_hits(px, centre, count);
            if (CHECKPOINTS == 1)
                store_checkpoint(px, bucket_record(tile_index, whole.x, (chunk - whole.x) / BUCKET));
            chunk += CHUNK;
        } while (alive && chunk < range.y);
    }
    if (DEPTH_ORDER == DEPTH_ORDER_PIXEL) {
        for (uint k = 0u; k < PIXELS; ++k)
            for (uint i = 0u; i < WINDOW; ++i) {
                const vec4 light = window_light[i * PIXELS + k];
                blend_sample(px, k, light.a, light.rgb, 0.0, 0u);
            }
    }
    store(px, first);
}
