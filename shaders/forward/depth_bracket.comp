// SPDX-License-Identifier: MIT
// The part of each ray in which its median depth lies, and the opacity of its pixel. T(z) is at or below the level for
// certain at the largest depth of those splats of the list's beginning that bring the product of 1 - alpha there; it is
// 1 at the least front edge. Splats that begin behind the one or that the picture no longer draws do not matter.
// Place: after the lists of a frame are made; no blend is needed. Source: docs/math.md, Depth of a surface.
// Work: a workgroup is a subgroup and has a block of 8 x 8 pixels, PIXELS of them a thread. Shared memory: the lists of
// lib/hits.glsl; no barrier. Reads lists and projected splats; writes brackets, ends, opacities, and depths of 0 where
// more light than the level is left.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require

#include "forward/ray_slice.glsl"
#include "forward/median_state.glsl"

// A pixel of the thread: T, negative once the pixel has ended; the least front edge; the largest depth of the splats
// that bring T to the level; where in the list the splats end that matter.
struct State {
    float left[PIXELS], low[PIXELS], high[PIXELS];
    uint end[PIXELS];
};

void look_at(inout State px, RaySplat s, vec2 first) {
    [[unroll]] for (uint k = 0u; k < PIXELS; ++k) {
        const Slice slice = slice_of(s, first + vec2(slot_offset(k)));
        const float before = px.left[k], next = before - slice.alpha * before;
        const bool goes_on = next >= MIN_TRANSMITTANCE, drawn = goes_on && slice.alpha > 0.0;
        const float reach =
            READING == DEPTH_READING_PLANE ? 0.0 : s.plane.z * sqrt(max(s.reach - slice.q, 0.0));
        const float front = slice.mean - reach;
        const float back = READING == DEPTH_READING_SOLID ? slice.mean + reach : slice.mean;
        if (drawn) px.low[k] = min(px.low[k], front);
        if (drawn && before > args.level) px.high[k] = max(px.high[k], back);
        if (drawn && (before > args.level || front <= px.high[k])) px.end[k] = s.number + 1u;
        px.left[k] = goes_on ? next : -abs(before);
    }
}

// Returns false when every pixel has ended.
bool look_at_hits(inout State px, vec2 first, uint count) {
    float alive = 1.0;
    uint batch = 0u;
    do {
        RaySplat mine;
        mine = load_hit(min(batch + gl_SubgroupInvocationID, count - 1u));
        const uint end = min(SUBGROUP_SIZE, count - batch);
        uint lane = 0u;
        do {
            look_at(px, broadcast_hit(mine, lane), first);
        } while (++lane < end);
        alive = px.left[0];
        for (uint k = 1u; k < PIXELS; ++k) alive = max(alive, px.left[k]);
        batch += SUBGROUP_SIZE;
    } while (batch < count && subgroupAny(alive > 0.0));
    return subgroupAny(alive > 0.0);
}

void load_state(inout State px, uvec2 first, uint begin) {
    for (uint k = 0u; k < PIXELS; ++k) {
        const uvec2 at = first + slot_offset(k);
        const bool is_there = at.x < args.width && at.y < args.height;
        px.left[k] = is_there ? 1.0 : -1.0;
        px.low[k] = NO_EDGE;
        px.high[k] = 0.0;
        px.end[k] = begin;
        if (args.segment == 0u || !is_there) continue;
        const vec4 kept = bracket[at.y * args.width + at.x];
        px.left[k] = kept.x;
        px.low[k] = kept.y;
        px.high[k] = kept.z;
        px.end[k] = list_end[at.y * args.width + at.x];
    }
}

void store_state(State px, uvec2 first) {
    for (uint k = 0u; k < PIXELS; ++k) {
        const uvec2 at = first + slot_offset(k);
        if (at.x >= args.width || at.y >= args.height) continue;
        const uint pixel = at.y * args.width + at.x;
        vec4 state = vec4(px.left[k], px.low[k], px.high[k], 0.0);
        if (args.segment + 1u == args.segments) {
            const float left = abs(px.left[k]), low = max(px.low[k], args.near_plane);
            const float high = max(px.high[k], low);
            const bool surface = left <= args.level;
            state = surface ? vec4(low, high, 1.0, UNKNOWN_LIGHT) : NO_BRACKET;
            depth_out[pixel] = vec2(surface ? high : 0.0, 1.0 - left);
        }
        bracket[pixel] = state;
        list_end[pixel] = px.end[k];
    }
}

void main() {
    const uint block = gl_WorkGroupID.z;
    const uvec2 whole = tile_range[gl_WorkGroupID.y * args.tiles_x + gl_WorkGroupID.x];
    const uint begin = min(whole.x + args.segment * MEDIAN_SEGMENT, whole.y);
    const uint end = min(begin + MEDIAN_SEGMENT, whole.y);
    const uvec2 first = gl_WorkGroupID.xy * TILE_SIZE + slot_to_pixel(block * BLOCK_PIXELS + gl_SubgroupInvocationID);
    State px;
    load_state(px, first, whole.x);
    if (begin < end) {
        uint chunk = begin;
        bool alive = true;
        do {
            const uint count = collect_hits(chunk, min(chunk + CHUNK, end), block_bit(block));
            if (count > 0u) alive = look_at_hits(px, vec2(first) + 0.5, count);
            chunk += CHUNK;
        } while (alive && chunk < end);
    }
    store_state(px, first);
}
