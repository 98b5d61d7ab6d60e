// SPDX-License-Identifier: MIT
// The depth at which a share `level` of a pixel's light is left. T(z) is the product, over the splats that the picture
// drew, of what each leaves of the light up to z: it never rises, so D, the least z with T(z) <= level, is unique.
// A splat's slice along the ray is its own profile (forward/ray_slice.glsl), and READING says how much of it counts at z
// (shared/depth_args.h); every reading ends at 1 - alpha.
// Place: after depth_bracket.comp, where no list is longer than LIST_SEGMENT; median_depth.comp finds the depths of pixels
// with more slices than fit. Source: docs/math.md, Depth of a surface.
// Work: a workgroup is a subgroup and has a block of 8 x 8 pixels. It walks the list once and keeps the splats that the
// block meets. For ROW pixels at a time it then lists the slices that each ray meets within its bracket, and tests one
// depth of a pixel after another, a few slices a lane. Shared memory: these splats and slices and the lists of
// lib/hits.glsl; no barrier. Reads lists and projected splats; reads and writes brackets and depths.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require

#define RAY_WALK
#include "forward/ray_slice.glsl"
#include "forward/median_state.glsl"

layout(constant_id = 7) const uint BLOCK_SPLATS = 512;  // less than the 16 KiB of shared memory that every device has
const uint ROW = 4u, CAPACITY = 128u;                   // pixels; slices of each
const uint OWN = CAPACITY / SUBGROUP_SIZE;  // slices of a lane
const uint MOST_TESTS = 48u;
const float EVEN = 2e-5;  // of the light: T is at the level

shared uint kept_splat[BLOCK_SPLATS], kept_number[BLOCK_SPLATS];
shared vec4 listed[ROW * CAPACITY];  // mean, 1 / deviation, strength, alpha
shared float listed_q[ROW * CAPACITY];
shared float listed_exponent[SHAPED ? ROW * CAPACITY : 1u];

struct Row {
    vec4 bracket[ROW];
    uint end[ROW], count[ROW];
};

uint pixel_of_row(uvec2 first, uint k) {
    return first.y * args.width + first.x + k;
}

bool load_row(out Row row, uvec2 first) {
    bool open = false;
    [[unroll]] for (uint k = 0u; k < ROW; ++k) {
        row.bracket[k] = NO_BRACKET;
        row.end[k] = row.count[k] = 0u;
        if (first.x + k >= args.width || first.y >= args.height) continue;
        const vec4 b = bracket[pixel_of_row(first, k)];
        if (b.x > b.y) continue;
        open = true;
        row.bracket[k] = b;
        row.end[k] = list_end[pixel_of_row(first, k)];
    }
    return open;
}

// Where the block's last bracket ends, and in the list the last splat that matters to it; 0 where no pixel has any.
uint find_ends(uvec2 first) {
    float farthest = 0.0;
    uint last = 0u;
    for (uint slot = gl_SubgroupInvocationID; slot < BLOCK_PIXELS; slot += SUBGROUP_SIZE) {
        const uvec2 at = first + slot_to_pixel(slot);
        if (at.x >= args.width || at.y >= args.height) continue;
        const vec4 b = bracket[at.y * args.width + at.x];
        if (b.x > b.y) continue;
        farthest = max(farthest, b.y);
        last = max(last, list_end[at.y * args.width + at.x]);
    }
    block_farthest = subgroupMax(farthest);
    return subgroupMax(last);
}

// Returns how many splats matter to the block, of which the first BLOCK_SPLATS are kept.
uint keep_splats(uvec2 range, uint bits) {
    uint kept = 0u, chunk = range.x;
    do {
        const uint count = collect_hits(chunk, min(chunk + CHUNK, range.y), bits);
        for (uint i = gl_SubgroupInvocationID; i < count && kept + i < BLOCK_SPLATS; i += SUBGROUP_SIZE) {
            kept_splat[kept + i] = hit_splat[hits_base() + i];
            kept_number[kept + i] = hit_index[hits_base() + i];
        }
        kept += count;
        chunk += CHUNK;
    } while (chunk < range.y && kept <= BLOCK_SPLATS);
    order_within_subgroup();
    return kept;
}

// Every lane has a splat, and lists it for the pixels of the row in whose bracket it has a part.
void list_splats(inout Row row, RaySplat s, bool valid, uvec2 first) {
    const float sharpness = 1.0 / s.plane.z;
    [[unroll]] for (uint k = 0u; k < ROW; ++k) {
        const Slice slice = slice_of(s, vec2(first) + vec2(0.5 + float(k), 0.5));
        const float reach =
            READING == DEPTH_READING_PLANE ? 0.0 : s.plane.z * sqrt(max(s.reach - slice.q, 0.0));
        const bool meets = valid && slice.alpha > 0.0 && s.number < row.end[k] &&
                           slice.mean - reach <= row.bracket[k].y;
        const uvec4 ballot = subgroupBallot(meets);
        const uint at = row.count[k] + subgroupBallotExclusiveBitCount(ballot);
        if (meets && at < CAPACITY) {
            listed[k * CAPACITY + at] = vec4(slice.mean, sharpness, slice.alpha / slice.w, slice.alpha);
            listed_q[k * CAPACITY + at] = slice.q;
            if (SHAPED) listed_exponent[k * CAPACITY + at] = s.exponent;
        }
        row.count[k] += subgroupBallotBitCount(ballot);
    }
}

void list_row(inout Row row, uint kept, uvec2 first) {
    order_within_subgroup();  // other lanes may still read the lists
    uint batch = 0u;
    do {
        const uint mine = batch + gl_SubgroupInvocationID, at = min(mine, kept - 1u);
        list_splats(row, load_ray_splat(kept_splat[at], kept_number[at]), mine < kept, first);
        batch += SUBGROUP_SIZE;
    } while (batch < kept);
    order_within_subgroup();
}

// The slices of a pixel that a lane has; those beyond the last leave all.
struct Own {
    vec4 slice[OWN];
    float q[OWN], exponent[OWN];
};

float light_before(Own own, float z) {
    float left = 1.0;
    [[unroll]] for (uint i = 0u; i < OWN; ++i)
        left *= left_by(own.slice[i], own.q[i], own.exponent[i], z);
    return subgroupMul(left);
}

// By the line between the ends of what is left of the bracket, or by halves where that was no better the last time. T at
// the end that stays is halved towards the level (the Illinois rule), so that lines do not creep.
float find_depth(uint first, uint count, vec4 b) {
    Own own;
    [[unroll]] for (uint i = 0u; i < OWN; ++i) {
        const uint mine = i * SUBGROUP_SIZE + gl_SubgroupInvocationID, at = first + min(mine, count - 1u);
        own.slice[i] = mine < count ? listed[at] : vec4(0.0, 1.0, 0.0, 0.0);
        own.q[i] = listed_q[at];
        own.exponent[i] = 0.0;
        if (SHAPED) own.exponent[i] = listed_exponent[at];
    }
    float low = b.x, high = b.y, above = light_before(own, low) - args.level;
    if (above <= 0.0) return low;
    float below = light_before(own, high) - args.level;
    bool halve = READING == DEPTH_READING_PLANE;
    uint tests = 0u;
    do {
        const float width = high - low, share = halve ? 0.5 : clamp(above / (above - below), 0.02, 0.98);
        const float z = low + share * width, there = light_before(own, z) - args.level;
        if (abs(there) <= EVEN && READING != DEPTH_READING_PLANE) return z;
        if (there > 0.0) {
            low = z;
            above = there;
            below *= 0.5;
        } else {
            high = z;
            below = there;
            above *= 0.5;
        }
        halve = READING == DEPTH_READING_PLANE || (!halve && high - low > 0.5 * width);
        ++tests;
    } while (high - low > LEAST_STEP * high && tests < MOST_TESTS);
    return high;
}

void main() {
    const uint block = gl_WorkGroupID.z;
    const uvec2 corner = gl_WorkGroupID.xy * TILE_SIZE + slot_to_pixel(block * BLOCK_PIXELS);
    uvec2 range = tile_range[gl_WorkGroupID.y * args.tiles_x + gl_WorkGroupID.x];
    range.y = min(range.y, find_ends(corner));
    if (range.x >= range.y) return;
    const uint kept = keep_splats(range, block_bit(block));
    if (kept == 0u || kept > BLOCK_SPLATS) return;
    for (uint part = 0u; part < BLOCK_PIXELS / ROW; ++part) {
        const uvec2 first = corner + slot_to_pixel(part * ROW);
        Row row;
        if (!load_row(row, first)) continue;
        list_row(row, kept, first);
        for (uint k = 0u; k < ROW; ++k) {
            uint count = 0u;
            vec4 b = NO_BRACKET;
            [[unroll]] for (uint i = 0u; i < ROW; ++i)
                if (i == k) {
                    count = row.count[i];
                    b = row.bracket[i];
                }
            if (count == 0u || count > CAPACITY) continue;
            const float depth = find_depth(k * CAPACITY, count, b);
            if (gl_SubgroupInvocationID == 0u) {
                depth_out[pixel_of_row(first, k)].x = depth;
                bracket[pixel_of_row(first, k)] = NO_BRACKET;
            }
        }
    }
}
