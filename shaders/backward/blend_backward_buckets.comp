// SPDX-License-Identifier: MIT
// Computes the same gradients as blend_backward.comp the other way round: a thread owns an intersection and walks the
// tile's pixels, so that its sums stay in registers and go to the intersection's slot as a whole, without reductions,
// atomics or additions to memory.
// Place: after bucket_behind. Source: Taming 3DGS (Mallick et al. 2024), section 4. What lies behind a bucket comes
// from bucket_behind.comp, so that the steps within a bucket are those of blend_backward.comp.
// Work: one subgroup, which is the workgroup, per bucket. Where subgroups are smaller than buckets, it takes one part
// of the bucket after another, the last one first. Thread 0 has the last intersection. Pixels enter there from the
// checkpoints, and their transmittance and what lies behind them pass along the subgroup by shuffles, one thread per
// step. Shared memory: the packed pixels of the tile that reach into the bucket and that one of its ellipses may touch.
// Slots of buckets that no pixel reaches must be zero before.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_shuffle : require

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 32;  // SUBGROUP_SIZE
layout(constant_id = 3) const uint SUBGROUP_SIZE = 32;

#include "kernels/kernel.glsl"
layout(push_constant, scalar) uniform Push { BucketArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer TileRange { uvec2 tile_range[]; };
layout(set = 0, binding = 1, scalar) readonly buffer IntersectionFromSorted { uint intersection_from_sorted[]; };
layout(set = 0, binding = 2, scalar) readonly buffer SplatFromIntersection { uint splat_from_intersection[]; };
layout(set = 0, binding = 6, scalar) readonly buffer DImage { float d_image[]; };  // [3][H][W] and more
layout(set = 0, binding = 7, scalar) readonly buffer LastIntersection { uint last_intersection[]; };
layout(set = 0, binding = 8, scalar) readonly buffer BucketTile { uint bucket_tile[]; };
layout(set = 0, binding = 9, scalar) readonly buffer Checkpoints { float checkpoints[]; };
layout(set = 0, binding = 10, scalar) readonly buffer BucketBehind { float bucket_behind[]; };  // [records][TILE_PIXELS]
layout(set = 0, binding = 11, scalar) writeonly buffer Partials { vec4 partials[]; };  // [K][2]
layout(set = 0, binding = 12, scalar) writeonly buffer PartialRest { float partial_rest[]; };  // [K][RESTS]
layout(set = 0, binding = 13, scalar) readonly buffer SplatExponent { float splat_exponent[]; };  // where SHAPED
layout(set = 0, binding = 14, scalar) writeonly buffer PartialExponent { float partial_exponent[]; };  // [K] where SHAPED

#define SHAPE_BINDING 3
#define LIGHT_BINDING 4
#define BOUND_BINDING 5
#include "lib/projected.glsl"
#include "lib/bucket.glsl"
#include "lib/lockstep.glsl"
#include "backward/depth_gradient.glsl"
#include "backward/splat_sums.glsl"

const uint SLOT_BITS = 8u;  // enough for TILE_PIXELS
shared uint pixel_word[TILE_PIXELS];  // slot, and above it how many of the bucket's intersections the pixel looks at
shared float pixel_transmittance[TILE_PIXELS], pixel_behind[TILE_PIXELS];
shared float pixel_d_red[TILE_PIXELS], pixel_d_green[TILE_PIXELS], pixel_d_blue[TILE_PIXELS];
shared float pixel_d_depth[DEPTH_SUM == 1 ? TILE_PIXELS : 1u];
shared float pixel_d_square[DEPTH_SPREAD == 1 ? TILE_PIXELS : 1u], pixel_first_depth[DEPTH_SPREAD == 1 ? TILE_PIXELS : 1u];

// The blocks that intersections [begin, end) touch, in the bits of an intersection.
uint touched_blocks(uint begin, uint end) {
    uint bits = 0u;
    for (uint batch = begin; batch < end; batch += SUBGROUP_SIZE) {
        const uint j = batch + gl_SubgroupInvocationID;
        if (j < end) bits |= splat_from_intersection[intersection_from_sorted[j]];
    }
    return subgroupOr(bits);
}

// Packs the pixels that matter and returns their number.
uint gather_pixels(uvec2 tile, uint record, uint begin, uint end) {
    const uint bits = touched_blocks(begin, end), plane = args.width * args.height;
    uint count = 0u;
    for (uint base = 0u; base < TILE_PIXELS; base += SUBGROUP_SIZE) {
        const uint slot = base + gl_SubgroupInvocationID;
        const uvec2 at = tile * TILE_SIZE + slot_to_pixel(slot);
        const uint o = at.y * args.width + at.x;
        uint seen = 0u;
        if (at.x < args.width && at.y < args.height && (bits & block_bit(slot / BLOCK_PIXELS)) != 0u) {
            const uint last = last_intersection[o];
            seen = last > begin ? min(last - begin, BUCKET) : 0u;
        }
        const uvec4 ballot = subgroupBallot(seen > 0u);
        if (seen > 0u) {
            const uint i = count + subgroupBallotExclusiveBitCount(ballot);
            pixel_word[i] = slot | seen << SLOT_BITS;
            pixel_transmittance[i] = checkpoints[checkpoint_at(record, TRANSMITTANCE_PLANE, slot)];
            pixel_behind[i] = bucket_behind[bucket_behind_at(record, slot)];
            pixel_d_red[i] = d_image[o];
            pixel_d_green[i] = d_image[plane + o];
            pixel_d_blue[i] = d_image[2u * plane + o];
            if (DEPTH_SUM == 1) {
                const vec3 d = load_depth_gradient(plane, o);
                pixel_d_depth[i] = d.x;
                if (DEPTH_SPREAD == 1) {
                    pixel_d_square[i] = d.y;
                    pixel_first_depth[i] = d.z;
                }
            }
        }
        count += subgroupBallotBitCount(ballot);
    }
    return count;
}

// Walks one intersection per thread over all pixels; `local` is the intersection's number within the bucket. A pixel is
// at thread t in the step that comes t after its own number. What leaves the last thread enters the preceding part.
Sums walk(uint count, uint local, vec2 mean, vec4 shape, float l22, float exponent, float z,
          vec4 light) {
    const uint lane = gl_SubgroupInvocationID;
    Sums sums = NO_SUMS;
    float transmittance = 1.0, behind = 0.0;
    uint time = 0u;
    do {
        transmittance = subgroupShuffle(transmittance, max(lane, 1u) - 1u);
        behind = subgroupShuffle(behind, max(lane, 1u) - 1u);
        const bool here = time - lane < count;  // unsigned, so it is also false before the first has come
        const uint i = here ? time - lane : 0u;
        if (lane == 0u) {
            transmittance = pixel_transmittance[i];
            behind = pixel_behind[i];
        }
        const uint word = pixel_word[i];
        const vec2 to_mean = mean - vec2(slot_to_pixel(word & (TILE_PIXELS - 1u)));
        vec3 d_z = vec3(0.0);
        if (DEPTH_SUM == 1) d_z.x = pixel_d_depth[i];
        if (DEPTH_SPREAD == 1) d_z.yz = vec2(pixel_d_square[i], pixel_first_depth[i]);
        add_pixel(sums, transmittance, behind, to_mean, shape, l22, light, exponent, z,
                  vec3(pixel_d_red[i], pixel_d_green[i], pixel_d_blue[i]),
                  d_z, here && local < word >> SLOT_BITS);
        if (BUCKET > SUBGROUP_SIZE && here && lane == SUBGROUP_SIZE - 1u) {
            pixel_transmittance[i] = transmittance;
            pixel_behind[i] = behind;
        }
    } while (++time < count + SUBGROUP_SIZE - 1u);
    return sums;
}

void blend_part(uint part, uvec2 tile, uint begin, uint end, uint count) {
    const uint local = part * SUBGROUP_SIZE + (SUBGROUP_SIZE - 1u - gl_SubgroupInvocationID);
    const bool has_pair = begin + local < end;
    vec4 shape = vec4(0.0), light = vec4(0.0);
    float l22 = 0.0, exponent = 0.0, depth = 0.0;
    uint slot = 0u;
    if (has_pair) {
        slot = intersection_from_sorted[begin + local];
        const uint splat = splat_from_intersection[slot] & INTERSECTION_SPLAT_MASK;
        shape = load_shape(splat, l22);
        light = load_light(splat);
        if (SHAPED) exponent = splat_exponent[splat];
        if (DEPTH_SUM == 1) depth = splat_bound[splat].z;
    }
    const Sums s = walk(count, local, shape.xy - (vec2(tile * TILE_SIZE) + 0.5), shape, l22, exponent, depth, light);
    if (has_pair) {
        partials[2u * slot] = vec4(s.gx, s.gxx, s.gxdy, s.gdy) * light.w;
        partials[2u * slot + 1u] = vec4(s.opacity, s.colour);
        partial_rest[RESTS * slot] = s.gdydy * light.w;
        if (DEPTH_SUM == 1) partial_rest[RESTS * slot + 1u] = s.depth;
        if (SHAPED) partial_exponent[slot] = s.exponent * light.w;
    }
}

void main() {
    const uint record = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (record >= args.records) return;
    const uint tile_number = bucket_tile[record];
    if (tile_number == 0u) return;
    const uint tile_index = tile_number - 1u;
    const uvec2 tile = uvec2(tile_index % args.tiles_x, tile_index / args.tiles_x);
    const uvec2 range = tile_range[tile_index];
    const uint begin = range.x + (record - bucket_record(tile_index, range.x, 0u)) * BUCKET;
    const uint end = min(begin + BUCKET, range.y);
    const uint count = gather_pixels(tile, record, begin, end);
    if (count == 0u) return;
    for (uint part = (end - begin + SUBGROUP_SIZE - 1u) / SUBGROUP_SIZE; part-- > 0u;) {
        order_within_subgroup();
        blend_part(part, tile, begin, end, count);
    }
}
