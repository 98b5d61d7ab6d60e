// Blends each tile's splats front to back. alpha = min(0.99, opacity * w(q)); below the cut-off nothing; a pixel
// ends before the splat that would bring its transmittance below 1e-4. Place: last pass of the forward walk.
// Source: 3DGS section 4; kernels of DARB-Splatting.
// Work: one workgroup a tile, one subgroup a block of it, PIXELS pixels a thread in registers. Each lane loads one
// pair of the tile's list; those whose ellipse touches the block are broadcast in turn. No shared memory, no
// barrier. Reads pairs and projected splats; writes the image and, for the backward pass, the final
// transmittance and where each pixel ended.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 32;       // BLOCKS * SUBGROUP_SIZE
layout(constant_id = 1) const int STORE_FOR_BACKWARD = 0;
layout(constant_id = 2) const float MIN_TRANSMITTANCE = TRANSMITTANCE_STOP;
layout(constant_id = 3) const uint SUBGROUP_SIZE = 8;

#include "kernels/kernel.glsl"
#include "lib/block.glsl"

layout(push_constant, scalar) uniform Push { BlendArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer TileRange { uvec2 tile_range[]; };
layout(set = 0, binding = 1, scalar) readonly buffer PairOrder { uint pair_order[]; };
layout(set = 0, binding = 2, scalar) readonly buffer PairSplat { uint pair_splat[]; };
layout(set = 0, binding = 3, scalar) readonly buffer SplatShape { vec4 splat_shape[]; };
layout(set = 0, binding = 4, scalar) readonly buffer SplatLight { vec4 splat_light[]; };
layout(set = 0, binding = 5, scalar) readonly buffer SplatBound { vec4 splat_bound[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer ImageOut { float image[]; };  // [3][H][W]
layout(set = 0, binding = 7, scalar) writeonly buffer FinalT { float final_transmittance[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer LastPair { uint last_pair[]; };

struct Pixels {
    float transmittance[PIXELS];  // 0 once the pixel has ended
    float final[PIXELS];          // the transmittance it ended with
    vec3 colour[PIXELS];
    uint last[PIXELS];  // 1 + the last pair looked at while it was alive; 0: none
};

// One splat on all pixels of the thread. d: mean - centre of the thread's first pixel.
void blend_splat(inout Pixels px, vec2 d, vec4 shape, vec4 light, float l22, uint number) {
    for (uint k = 0u; k < PIXELS; ++k) {
        const vec2 to_mean = d - vec2(slot_offset(k));
        const float x = shape.z * to_mean.x + shape.w * to_mean.y, y = l22 * to_mean.y;
        const float alpha = min(light.w * kernel_value(x * x + y * y), ALPHA_MAX);
        const float wanted = (alpha >= ALPHA_CUTOFF ? alpha : 0.0) * px.transmittance[k];
        const float next = px.transmittance[k] - wanted;
        const bool goes_on = next >= MIN_TRANSMITTANCE;
        px.colour[k] += (goes_on ? wanted : 0.0) * light.rgb;
        px.transmittance[k] = goes_on ? next : 0.0;
        px.final[k] = goes_on ? next : px.final[k];
        if (STORE_FOR_BACKWARD == 1) px.last[k] = goes_on ? number : px.last[k];
    }
}

void store(Pixels px, uvec2 first) {
    const vec3 background = vec3(args.background_r, args.background_g, args.background_b);
    const uint plane = args.width * args.height;
    for (uint k = 0u; k < PIXELS; ++k) {
        const uvec2 at = first + slot_offset(k);
        if (at.x >= args.width || at.y >= args.height) continue;
        const uint o = at.y * args.width + at.x;
        const vec3 colour = px.colour[k] + px.final[k] * background;
        image[o] = colour.r;
        image[plane + o] = colour.g;
        image[2u * plane + o] = colour.b;
        if (STORE_FOR_BACKWARD == 1) {
            final_transmittance[o] = px.final[k];
            last_pair[o] = px.last[k];
        }
    }
}

void main() {
    const uvec2 tile = gl_WorkGroupID.xy;
    const uvec2 range = tile_range[tile.y * args.tiles_x + tile.x];
    const uint bit = block_bit(gl_SubgroupID);
    const uvec2 first = tile * TILE_SIZE + first_pixel(gl_SubgroupID, gl_SubgroupInvocationID);
    const vec2 centre = vec2(first) + 0.5;

    Pixels px;
    for (uint k = 0u; k < PIXELS; ++k) {
        const uvec2 at = first + slot_offset(k);
        px.transmittance[k] = at.x < args.width && at.y < args.height ? 1.0 : 0.0;
        px.final[k] = 1.0;
        px.colour[k] = vec3(0.0);
        px.last[k] = 0u;
    }

    for (uint batch = range.x; batch < range.y; batch += SUBGROUP_SIZE) {
        const uint j = batch + gl_SubgroupInvocationID;
        uint pair = 0u;
        if (j < range.y) pair = pair_splat[pair_order[j]];
        const bool hit = (pair & bit) != 0u;
        uvec4 hits = subgroupBallot(hit);
        if (subgroupBallotBitCount(hits) == 0u) continue;
        vec4 shape = vec4(0.0), light = vec4(0.0);
        float l22 = 0.0;
        if (hit) {
            const uint splat = pair & PAIR_SPLAT_MASK;
            shape = splat_shape[splat];
            light = splat_light[splat];
            l22 = splat_bound[splat].x;
        }
        while (subgroupBallotBitCount(hits) > 0u) {
            const uint lane = subgroupBallotFindLSB(hits);
            hits[lane >> 5] &= ~(1u << (lane & 31u));
            const vec4 s = subgroupBroadcast(shape, lane);
            blend_splat(px, s.xy - centre, s, subgroupBroadcast(light, lane),
                        subgroupBroadcast(l22, lane), batch + lane + 1u);
        }
        float alive = 0.0;
        for (uint k = 0u; k < PIXELS; ++k) alive += px.transmittance[k];
        if (subgroupAll(alive == 0.0)) break;
    }
    store(px, first);
}
