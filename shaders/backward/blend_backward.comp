// Gradients of blend.comp: from dL/dimage to dL/d(mean, l11, l21, l22, opacity, colour), one partial for each
// splat-tile pair, in the pair's own slot, so that sums per splat need no atomics and repeat bit by bit.
// Place: after the loss. Source: KERNELS section 4, the moments form below.
// Back to front: T before a splat is T after it / (1 - alpha), and 1 - alpha >= 0.01 by ALPHA_MAX; behind = colour
// behind the splat, dotted with dL/dcolour, is a convex combination, which no cancellation can hurt.
// Work: one workgroup a tile, pixels dealt as in blend.comp. Shared memory: partials of one batch for each
// subgroup, two batches. Reads what the forward pass stored; writes partials of every pair of the tile.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_basic : require

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 32;
layout(constant_id = 1) const uint SUBGROUPS = 4;  // THREADS / subgroup size

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
layout(set = 0, binding = 6, scalar) readonly buffer DImage { float d_image[]; };  // [3][H][W]
layout(set = 0, binding = 7, scalar) readonly buffer FinalT { float final_transmittance[]; };
layout(set = 0, binding = 8, scalar) readonly buffer LastPair { uint last_pair[]; };
layout(set = 0, binding = 9, scalar) writeonly buffer PartialA { vec4 partial_a[]; };  // G x, G x dx, G x dy, G dy
layout(set = 0, binding = 10, scalar) writeonly buffer PartialB { vec4 partial_b[]; };  // G dy dy, d_opacity
layout(set = 0, binding = 11, scalar) writeonly buffer PartialC { vec4 partial_c[]; };  // d_colour, 0

const uint BATCH = 32;
shared vec4 sum_a[2 * SUBGROUPS * BATCH];
shared vec4 sum_c[2 * SUBGROUPS * BATCH];
shared float sum_b[2 * SUBGROUPS * BATCH];

struct Pixels {
    float transmittance[PIXELS];
    float behind[PIXELS];
    vec3 d_colour[PIXELS];
    uint last[PIXELS];
};

uint load_pixels(uvec2 tile, out Pixels px, out vec2 centre[PIXELS]) {
    const vec3 background = vec3(args.background_r, args.background_g, args.background_b);
    const uint plane = args.width * args.height;
    uint last = 0u;
    for (uint k = 0u; k < PIXELS; ++k) {
        const uvec2 at = tile * TILE_SIZE + pixel_of(k);
        centre[k] = vec2(at) + 0.5;
        const bool inside = at.x < args.width && at.y < args.height;
        const uint o = inside ? at.y * args.width + at.x : 0u;
        const vec3 g = vec3(d_image[o], d_image[plane + o], d_image[2u * plane + o]);
        px.d_colour[k] = inside ? g : vec3(0.0);
        px.transmittance[k] = inside ? final_transmittance[o] : 1.0;
        px.behind[k] = dot(px.d_colour[k], background);
        px.last[k] = inside ? last_pair[o] : 0u;
        last = max(last, px.last[k]);
    }
    return last;
}

// Adds up what the subgroups found for one batch; thread t has entry t.
void write_batch(uint base, uint half_, uvec2 range) {
    for (uint t = gl_LocalInvocationIndex; t < BATCH; t += THREADS) {
        const uint j = base + t;
        if (j >= range.y) continue;
        vec4 a = vec4(0.0);
        vec4 c = vec4(0.0);
        float b = 0.0;
        for (uint s = 0u; s < SUBGROUPS; ++s) {
            const uint o = (half_ * SUBGROUPS + s) * BATCH + t;
            a += sum_a[o];
            b += sum_b[o];
            c += sum_c[o];
        }
        const uint slot = pair_order[j];
        partial_a[slot] = a;
        partial_b[slot] = vec4(b, c.w, 0.0, 0.0);
        partial_c[slot] = vec4(c.rgb, 0.0);
    }
}

void main() {
    const uvec2 tile = gl_WorkGroupID.xy;
    const uvec2 range = tile_range[tile.y * args.tiles_x + tile.x];
    if (range.x >= range.y) return;
    const vec2 corner = vec2(tile * TILE_SIZE) + 0.5;
    uvec2 low, high;
    block_bounds(low, high);
    const vec2 block_low = corner + vec2(low), block_high = corner + vec2(high);

    Pixels px;
    vec2 centre[PIXELS];
    const uint block_last = subgroupMax(load_pixels(tile, px, centre));

    const uint batches = (range.y - range.x + BATCH - 1u) / BATCH;
    for (uint n = 0u; n < batches; ++n) {
        const uint base = range.x + (batches - 1u - n) * BATCH;
        const uint half_ = n & 1u;
        const uint mine_at = (half_ * SUBGROUPS + gl_SubgroupID) * BATCH;
        for (uint t = gl_SubgroupInvocationID; t < BATCH; t += gl_SubgroupSize) {
            sum_a[mine_at + t] = vec4(0.0);
            sum_b[mine_at + t] = 0.0;
            sum_c[mine_at + t] = vec4(0.0);
        }
        subgroupBarrier();
        if (base < block_last) {
            for (uint part = BATCH; part > 0u;) {
                part -= min(gl_SubgroupSize, part);
                const uint j = base + part + gl_SubgroupInvocationID;
                const bool mine = j < min(range.y, block_last);
                const uint splat = pair_splat[pair_order[mine ? j : range.x]];
                const vec4 shape = splat_shape[splat];
                const vec4 light = splat_light[splat];
                const vec2 bound = splat_bound[splat].xy;
                const bool hit = mine && reaches(smallest_q(shape.xy, shape.z, shape.w, bound.x,
                                                            block_low, block_high), bound.y);
                for (uvec4 hits = subgroupBallot(hit); subgroupBallotBitCount(hits) > 0u;) {
                    const uint lane = subgroupBallotFindMSB(hits);
                    hits[lane >> 5] &= ~(1u << (lane & 31u));
                    const vec4 s = subgroupBroadcast(shape, lane);
                    const vec4 c = subgroupBroadcast(light, lane);
                    const float l22 = subgroupBroadcast(bound.x, lane);
                    const uint number = base + part + lane + 1u;
                    vec4 a = vec4(0.0);  // sums of G x, G x dx, G x dy, G dy
                    vec4 d_light = vec4(0.0);  // d_colour, d_opacity
                    float b = 0.0;  // sum of G dy dy
                    for (uint k = 0u; k < PIXELS; ++k) {
                        const vec2 d = s.xy - centre[k];
                        const float x = s.z * d.x + s.w * d.y, y = l22 * d.y;
                        float w, slope;
                        kernel_value_slope(x * x + y * y, w, slope);
                        const float raw = c.w * w;
                        const float alpha = min(raw, ALPHA_MAX);
                        const bool counts = alpha >= ALPHA_CUTOFF && number <= px.last[k];
                        const float shown = counts ? alpha : 0.0;
                        const float before = px.transmittance[k] / (1.0 - shown);
                        const float lit = dot(c.rgb, px.d_colour[k]);
                        const float d_alpha =
                            counts && raw < ALPHA_MAX ? before * (lit - px.behind[k]) : 0.0;
                        d_light.rgb += shown * before * px.d_colour[k];
                        d_light.w += d_alpha * w;
                        const float g = d_alpha * slope, gx = g * x, gy = g * d.y;
                        a += vec4(gx, gx * d.x, gx * d.y, gy);
                        b += gy * d.y;
                        px.behind[k] += shown * (lit - px.behind[k]);
                        px.transmittance[k] = before;
                    }
                    a = subgroupAdd(a);
                    b = subgroupAdd(b);
                    d_light = subgroupAdd(d_light);
                    if (subgroupElect()) {
                        const uint o = mine_at + part + lane;
                        sum_a[o] = a * c.w;
                        sum_b[o] = b * c.w;
                        sum_c[o] = d_light;
                    }
                }
            }
        }
        barrier();
        write_batch(base, half_, range);
    }
}
