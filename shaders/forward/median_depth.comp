// SPDX-License-Identifier: MIT
// The depths that median_search.comp has not found: by walks over the list, each of which tests SAMPLES depths of a pixel
// and keeps the part of its bracket in which T passes the level.
// Place: after median_search.comp, a few times. Source: docs/math.md, Depth of a surface.
// Work: a workgroup is a subgroup and has a block of 8 x 8 pixels. It packs those whose depth is not found yet, takes
// PIXELS of them a thread at a time, and walks the list once for these, testing SAMPLES depths of each. Shared memory:
// the packed pixels and the lists of lib/hits.glsl; no barrier. Reads lists and projected splats; reads and writes
// brackets and depths.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require

#define RAY_WALK
#include "forward/ray_slice.glsl"
#include "forward/ray_walk.glsl"
#include "forward/median_state.glsl"
layout(set = 0, binding = 11, scalar) buffer Product { float product[]; };  // [MEDIAN_SAMPLES][H][W], of several segments

shared uint open_pixel[BLOCK_PIXELS];  // slots in the tile

// Where a walk is the last of a pixel: float32 holds no more within the bracket, or the light falls in it as it does in
// its neighbours, by less than this.
const float EVEN_FALL = 1e-4, EVEN_STEP = 1e-5;

uint find_open(uint block) {
    order_within_subgroup();
    uint count = 0u;
    for (uint slot = gl_SubgroupInvocationID; slot < BLOCK_PIXELS; slot += SUBGROUP_SIZE) {
        const uvec2 at = gl_WorkGroupID.xy * TILE_SIZE + slot_to_pixel(block * BLOCK_PIXELS + slot);
        bool open = at.x < args.width && at.y < args.height;
        if (open) {
            const vec4 b = bracket[at.y * args.width + at.x];
            open = b.x <= b.y;
        }
        const uvec4 ballot = subgroupBallot(open);
        if (open) open_pixel[count + subgroupBallotExclusiveBitCount(ballot)] = block * BLOCK_PIXELS + slot;
        count += subgroupBallotBitCount(ballot);
    }
    order_within_subgroup();
    return count;
}

uint pixel_at(uint place, out uvec2 at) {
    at = gl_WorkGroupID.xy * TILE_SIZE + slot_to_pixel(open_pixel[place]);
    return at.y * args.width + at.x;
}

// The part of the bracket in which T passes the level, and D there. The fall of T within it, and half the difference
// of its neighbours' falls, make a parabola; a jump shows in that the fall is not the mean of theirs.
void narrow(uint pixel, float first, float step, float left[SAMPLES]) {
    const vec4 b = bracket[pixel];
    uint at = SAMPLES;  // the first sample at or below the level
    [[unroll]] for (uint i = SAMPLES; i > 0u; --i)
        if (left[i - 1u] <= args.level) at = i - 1u;
    vec4 rest = b;
    float fall_before = -1.0, fall_behind = -1.0, before_that = -1.0, behind_that = -1.0;
    [[unroll]] for (uint i = 0u; i < SAMPLES; ++i) {
        if (i + 1u == at) rest.xz = vec2(first + float(i) * step, left[i]);
        if (i == at) rest.yw = vec2(first + float(i) * step, left[i]);
        if (i + 1u < SAMPLES) {
            const float fall = left[i] - left[i + 1u];
            if (i + 2u == at) fall_before = fall;
            if (i + 3u == at) before_that = fall;
            if (i == at) fall_behind = fall;
            if (i == at + 1u) behind_that = fall;
        }
    }
    const float fall = rest.z - rest.w;
    float share = fall > 0.0 && rest.w >= 0.0 ? clamp((rest.z - args.level) / fall, 0.0, 1.0) : 1.0;
    bool found = rest.y - rest.x <= LEAST_STEP * rest.y;
    if (READING != DEPTH_READING_PLANE && at > 0u && at < SAMPLES) {
        if (fall_before < 0.0) fall_before = 2.0 * fall_behind - behind_that;
        if (fall_behind < 0.0) fall_behind = 2.0 * fall_before - before_that;
        const float uneven = abs(fall - 0.5 * (fall_before + fall_behind));
        found = found || uneven <= EVEN_FALL || uneven * (rest.y - rest.x) <= EVEN_STEP * rest.y * fall;
        const float bend = 0.25 * (fall_before - fall_behind), c = rest.z - args.level, b1 = fall + bend;
        const float divisor = b1 + sqrt(max(b1 * b1 - 4.0 * bend * c, 0.0));
        if (divisor > 0.0) share = clamp(2.0 * c / divisor, 0.0, 1.0);
    }
    depth_out[pixel].x = mix(rest.x, rest.y, share);
    bracket[pixel] = found ? NO_BRACKET : rest;
}

void search(uint place, uint count, uvec2 range, uint bits) {
    Rays px;
    float farthest = 0.0;
    uint last = range.x;
    const uint plane = args.width * args.height;
    [[unroll]] for (uint k = 0u; k < PIXELS; ++k) {
        const uint mine = place + k * SUBGROUP_SIZE + gl_SubgroupInvocationID;
        uvec2 at;
        const uint pixel = pixel_at(min(mine, count - 1u), at);
        const vec4 b = bracket[pixel];
        px.step[k] = (b.y - b.x) / float(SAMPLES + 1u);
        px.first[k] = b.x + px.step[k];
        px.centre[k] = vec2(at) + 0.5;
        px.end[k] = mine < count ? list_end[pixel] : 0u;
        farthest = max(farthest, b.y);
        last = max(last, px.end[k]);
        [[unroll]] for (uint i = 0u; i < SAMPLES; ++i)
            px.left[k * SAMPLES + i] = args.segment > 0u ? product[i * plane + pixel] : 1.0;
    }
    block_farthest = subgroupMax(farthest);
    range.y = min(range.y, subgroupMax(last));
    if (range.x < range.y) walk(px, range, bits);
    [[unroll]] for (uint k = 0u; k < PIXELS; ++k) {
        const uint mine = place + k * SUBGROUP_SIZE + gl_SubgroupInvocationID;
        if (mine >= count) continue;
        uvec2 at;
        const uint pixel = pixel_at(mine, at);
        float left[SAMPLES];
        [[unroll]] for (uint i = 0u; i < SAMPLES; ++i) left[i] = px.left[k * SAMPLES + i];
        if (args.segment + 1u == args.segments) {
            narrow(pixel, px.first[k], px.step[k], left);
        } else {
            [[unroll]] for (uint i = 0u; i < SAMPLES; ++i) product[i * plane + pixel] = left[i];
        }
    }
}

void main() {
    const uint block = gl_WorkGroupID.z;
    const uvec2 whole = tile_range[gl_WorkGroupID.y * args.tiles_x + gl_WorkGroupID.x];
    const uint begin = min(whole.x + args.segment * MEDIAN_SEGMENT, whole.y);
    const uvec2 range = uvec2(begin, min(begin + MEDIAN_SEGMENT, whole.y));
    const uint count = find_open(block);
    for (uint place = 0u; place < count; place += SUBGROUP_SIZE * PIXELS)
        search(place, count, range, block_bit(block));
}
