// Blends each tile's splats front to back. alpha = min(0.99, opacity * w(q)); below the cut-off nothing; a pixel
// ends before the splat that would bring its transmittance below 1e-4. Place: last pass of the forward walk.
// Source: 3DGS section 4; kernels of DARB-Splatting.
// Work: one workgroup a tile, TILE_PIXELS / THREADS pixels a thread in registers. Each lane of a subgroup loads one
// splat and tests it against the subgroup's block of pixels; those that reach it are broadcast in turn. No
// shared memory, no barrier. Reads pairs and projected splats; writes the image and, for the backward
// pass, the final transmittance and the last pair that counted.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 32;
layout(constant_id = 1) const int STORE_FOR_BACKWARD = 0;
layout(constant_id = 2) const float MIN_TRANSMITTANCE = TRANSMITTANCE_STOP;

#include "kernels/kernel.glsl"
#include "lib/block.glsl"
#include "lib/tile.glsl"

layout(push_constant, scalar) uniform Push { BlendArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer TileRange { uvec2 tile_range[]; };
layout(set = 0, binding = 1, scalar) readonly buffer PairOrder { uint pair_order[]; };
layout(set = 0, binding = 2, scalar) readonly buffer PairSplat { uint pair_splat[]; };
layout(set = 0, binding = 3, scalar) readonly buffer SplatShape { vec4 splat_shape[]; };
layout(set = 0, binding = 4, scalar) readonly buffer SplatLight { vec4 splat_light[]; };
layout(set = 0, binding = 5, scalar) readonly buffer SplatBound { vec4 splat_bound[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer ImageOut { float image[]; };  // [3][H][W]
layout(set = 0, binding = 7, scalar) writeonly buffer FinalT { float final_transmittance[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer LastPair { uint last_pair[]; };  // 0: none, else 1 + j

struct Pixels {
    float transmittance[PIXELS];
    float live[PIXELS];  // 1, or 0 once the pixel has ended
    vec3 colour[PIXELS];
    uint last[PIXELS];
};

void main() {
    const uvec2 tile = gl_WorkGroupID.xy;
    const uvec2 range = tile_range[tile.y * args.tiles_x + tile.x];
    const vec2 corner = vec2(tile * TILE_SIZE) + 0.5;
    uvec2 low, high;
    block_bounds(low, high);
    const vec2 block_low = corner + vec2(low), block_high = corner + vec2(high);

    Pixels px;
    vec2 centre[PIXELS];
    for (uint k = 0u; k < PIXELS; ++k) {
        px.transmittance[k] = 1.0;
        const uvec2 at = tile * TILE_SIZE + pixel_of(k);
        centre[k] = vec2(at) + 0.5;
        px.live[k] = at.x < args.width && at.y < args.height ? 1.0 : 0.0;
        px.colour[k] = vec3(0.0);
        px.last[k] = 0u;
    }

    for (uint batch = range.x; batch < range.y; batch += gl_SubgroupSize) {
        const uint j = batch + gl_SubgroupInvocationID;
        const bool mine = j < range.y;
        const uint splat = pair_splat[pair_order[mine ? j : range.x]];
        const vec4 shape = splat_shape[splat];
        const vec4 light = splat_light[splat];
        const vec2 bound = splat_bound[splat].xy;
        const bool hit = mine && reaches(smallest_q(shape.xy, shape.z, shape.w, bound.x, block_low,
                                                    block_high), bound.y);
        for (uvec4 hits = subgroupBallot(hit); subgroupBallotBitCount(hits) > 0u;) {
            const uint lane = subgroupBallotFindLSB(hits);
            hits[lane >> 5] &= ~(1u << (lane & 31u));
            const vec4 s = subgroupBroadcast(shape, lane);
            const vec4 c = subgroupBroadcast(light, lane);
            const float l22 = subgroupBroadcast(bound.x, lane);
            for (uint k = 0u; k < PIXELS; ++k) {
                const vec2 d = s.xy - centre[k];
                const float x = s.z * d.x + s.w * d.y, y = l22 * d.y;
                const float alpha = min(c.w * kernel_value(x * x + y * y), ALPHA_MAX);
                const float shown = alpha >= ALPHA_CUTOFF ? alpha * px.live[k] : 0.0;
                const float next = px.transmittance[k] * (1.0 - shown);
                const bool go_on = next >= MIN_TRANSMITTANCE;
                const float weight = go_on ? shown * px.transmittance[k] : 0.0;
                px.live[k] = go_on ? px.live[k] : 0.0;
                px.colour[k] += weight * c.rgb;
                px.transmittance[k] = go_on ? next : px.transmittance[k];
                if (STORE_FOR_BACKWARD == 1)
                    px.last[k] = weight > 0.0 ? batch + lane + 1u : px.last[k];
            }
        }
        float alive = 0.0;
        for (uint k = 0u; k < PIXELS; ++k) alive += px.live[k];
        if (subgroupAll(alive == 0.0)) break;
    }

    const vec3 background = vec3(args.background_r, args.background_g, args.background_b);
    const uint plane = args.width * args.height;
    for (uint k = 0u; k < PIXELS; ++k) {
        const uvec2 at = tile * TILE_SIZE + pixel_of(k);
        if (at.x >= args.width || at.y >= args.height) continue;
        const uint o = at.y * args.width + at.x;
        const vec3 colour = px.colour[k] + px.transmittance[k] * background;
        image[o] = colour.r;
        image[plane + o] = colour.g;
        image[2u * plane + o] = colour.b;
        if (STORE_FOR_BACKWARD == 1) {
            final_transmittance[o] = px.transmittance[k];
            last_pair[o] = px.last[k];
        }
    }
}
