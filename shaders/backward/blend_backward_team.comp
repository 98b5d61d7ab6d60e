// SPDX-License-Identifier: MIT
// Computes the same gradients as blend_backward.comp with the same order of additions, so that both give the same
// numbers, but with TEAM subgroups per tile. Each walks the tile's list over an area of its own, a chunk of
// intersections at a time.
// Place: after the loss. Source: docs/math.md, Gradients.
// Work: one workgroup of TEAM subgroups per tile, with pixels dealt as in blend.comp. Shared memory: the chunk's sums
// of every subgroup; three barriers per chunk. Every intersection of the list is written once by eight neighbouring
// threads, with zeros where nothing reaches it, so that the slots need not be zero before.
// Lists that are too long for one dispatch are processed as in blend_backward.comp.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_shuffle : require

#include "backward/team_interface.glsl"
const uint CHUNK = 32u;
#include "lib/hits.glsl"
#define PARTIALS_BINDING 9
#define PARTIALS_PUT =
#include "lib/partials.glsl"
#include "lib/reduce.glsl"
#include "backward/depth_gradient.glsl"
#include "backward/splat_sums.glsl"

const uint TEAM = AREAS, SUMS = PARTIALS + RESTS + (SHAPED ? 1u : 0u);
shared float chunk_sums[TEAM * CHUNK * SUMS];
shared uint chunk_slot[CHUNK], chunk_word[CHUNK];  // for each intersection: its slot; its splat and blocks
shared uint area_end[TEAM];  // the list's intersections before it reach a pixel of the area
uint chunk_begin;

uint place_of(uint j) {
    return (gl_SubgroupID * CHUNK + j - chunk_begin) * SUMS;
}
void put_sums(uint place, float v[PARTIALS], float rest) {
    const vec2 mine = transposed_sum(v);
    rest = subgroup_sum(rest);
    const uint lane = gl_SubgroupInvocationID;
    if (SUBGROUP_SIZE == 4u) {
        chunk_sums[place + 2u * lane] = mine.x;
        chunk_sums[place + 2u * lane + 1u] = mine.y;
    } else if (SUBGROUP_SIZE == PARTIALS || lane < PARTIALS) {
        chunk_sums[place + lane] = mine.x;
    }
    if (lane == 0u) chunk_sums[place + PARTIALS] = rest;
}
void put_exponent(uint place, float value) {
    value = subgroup_sum(value);
    if (gl_SubgroupInvocationID == 0u) chunk_sums[place + PARTIALS + 1u] = value;
}
void put_depth(uint place, float value) {
    value = subgroup_sum(value);
    if (gl_SubgroupInvocationID == 0u) chunk_sums[place + SUMS - 1u] = value;
}
#include "backward/area_walk.glsl"

#include "backward/team_chunk.glsl"

// The sum of one value over the areas that the intersection touches.
float team_sum(uint local, uint value) {
    float sum = 0.0;
    [[unroll]] for (uint area = 0u; area < TEAM; ++area)
        if ((chunk_word[local] & area_bits(area)) != 0u && chunk_begin + local < area_end[area])
            sum += chunk_sums[(area * CHUNK + local) * SUMS + value];
    return sum;
}

void store_chunk(uint end) {
    const uint count = min(end - chunk_begin, CHUNK);
    for (uint i = gl_LocalInvocationIndex; i < count * PARTIALS; i += THREADS)
        put_partial(chunk_slot[i / PARTIALS], i % PARTIALS, team_sum(i / PARTIALS, i % PARTIALS));
    for (uint i = gl_LocalInvocationIndex; i < count; i += THREADS)
        partial_rest[RESTS * chunk_slot[i]] = team_sum(i, PARTIALS);
    for (uint i = gl_LocalInvocationIndex; SHAPED && i < count; i += THREADS)
        partial_exponent[chunk_slot[i]] = team_sum(i, PARTIALS + 1u);
    for (uint i = gl_LocalInvocationIndex; DEPTH_SUM == 1 && i < count; i += THREADS)
        partial_rest[RESTS * chunk_slot[i] + 1u] = team_sum(i, SUMS - 1u);
}

void main() {
    const uvec2 tile = own_tile();
    const uvec2 range = list_part(tile_range[tile.y * args.tiles_x + tile.x]);
    if (range.x >= range.y) return;
    const uint area = gl_SubgroupID;
    const uvec2 first = tile * TILE_SIZE + first_pixel(area, gl_SubgroupInvocationID);
    Pixels px;
    const uint last = subgroupMax(load_pixels(first, px));
    const uint own_end = min(last, range.y);
    if (gl_SubgroupInvocationID == 0u) area_end[area] = own_end;
    if (SEGMENT > 0u && last > range.y) load_behind(px, first);
    chunk_begin = range.x + (range.y - 1u - range.x) / CHUNK * CHUNK;
    for (;; chunk_begin -= CHUNK) {
        load_chunk(range.y);
        if (chunk_begin < own_end) {
            const uint count =
                collect_hits(chunk_begin, min(chunk_begin + CHUNK, own_end), area_bits(area));
            if (count > 0u) blend_hits(px, vec2(first) + 0.5, count);
        }
        barrier();
        store_chunk(range.y);
        if (chunk_begin == range.x) break;
        barrier();
    }
    if (SEGMENT > 0u && args.segment > 0u && own_end > range.x) store_state(px, first);
}
