// SPDX-License-Identifier: MIT
// The depth at which a share `level` of a pixel's light is left. T(z) is the product, over the splats that the picture
// drew, of what each leaves of the light up to z: it never rises, so D, the least z with T(z) <= level, is unique.
// A splat's slice along the ray is its own profile, a(z) = alpha f(q + s^2)/f(q), s = (z - mean)/deviation, and READING
// says how much of it counts at z (shared/depth_args.h); every reading ends at 1 - alpha.
// Place: after the lists of a frame are made; no blend is needed. Source: docs/math.md, Depth of a surface.
// Work: a workgroup a block of 8 x 8 pixels, a pixel a thread; the first dispatches (BRACKET) walk the list as a picture
// is blended and leave where D may lie, the others test MEDIAN_SAMPLES depths of what is left. Shared memory: none.
// Reads lists and projected splats; writes the state of the pixels and at last depth and opacity.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/depth_args.h"
#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;
layout(constant_id = 1) const int READING = DEPTH_READING_FRONT;
layout(constant_id = 2) const int BRACKET = 0;
layout(constant_id = 3) const float MIN_TRANSMITTANCE = TRANSMITTANCE_STOP * (1.0 - TRANSMITTANCE_SLACK);

#include "kernels/kernel.glsl"
layout(push_constant, scalar) uniform Push { MedianDepthArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer TileRange { uvec2 tile_range[]; };
layout(set = 0, binding = 1, scalar) readonly buffer IntersectionFromSorted { uint intersection_from_sorted[]; };
layout(set = 0, binding = 2, scalar) readonly buffer SplatFromIntersection { uint splat_from_intersection[]; };
layout(set = 0, binding = 6, scalar) readonly buffer SplatExponent { float splat_exponent[]; };  // where SHAPED
layout(set = 0, binding = 7, scalar) readonly buffer SplatPlane { vec3 splat_plane[]; };         // slope, deviation
// While the bracket is looked for: T (negative once the pixel has ended), the least front edge, the largest depth of
// the splats that bring T to the level. Then: the bracket, and T at both ends; empty where its end is before its start.
layout(set = 0, binding = 8, scalar) buffer Bracket { vec4 bracket[]; };      // [H][W]
// [H][W] the part of the list, begin and end, in which splats still matter; as a float, what those before it leave.
layout(set = 0, binding = 9, scalar) buffer Part { uvec3 part[]; };
layout(set = 0, binding = 10, scalar) buffer Product { float product[]; };    // [MEDIAN_SAMPLES][H][W], of several segments
layout(set = 0, binding = 11, scalar) buffer DepthOut { vec2 depth_out[]; };  // [H][W] depth, 0: no surface; opacity

#define SHAPE_BINDING 3
#define LIGHT_BINDING 4
#define BOUND_BINDING 5
#include "lib/projected.glsl"
#include "lib/pixel_slot.glsl"

const float NO_EDGE = 3e38;
const float UNKNOWN = -1.0;  // T at the end of the bracket, until a walk has tested it
// Where a walk is the last of a pixel: T is straight between the ends, or float32 holds no more between them.
const float STRAIGHT = 1e-3, STRAIGHT_FALL = 4e-4, LEAST_STEP = 1e-5;  // of the depth; of the light; of the depth

// A splat on the ray of a pixel.
struct Slice {
    float alpha;     // as the picture has it; 0: not drawn
    float strength;  // alpha / w(q)
    float q, reach, mean, deviation, exponent;
};

// How far before and behind its mean the slice is.
float half_length(Slice s) {
    return READING == DEPTH_READING_PLANE ? 0.0 : s.deviation * sqrt(max(s.reach - s.q, 0.0));
}

// Nothing of a splat that begins behind `farthest` is computed.
Slice slice_of(uint splat, vec2 centre, float farthest) {
    Slice s;
    float l22;
    const vec4 shape = load_shape(splat, l22), bound = splat_bound[splat];
    const vec2 d = shape.xy - centre;
    const float x = shape.z * d.x + shape.w * d.y, y = l22 * d.y;
    s.q = x * x + y * y;
    s.reach = bound.y;
    s.alpha = 0.0;
    if (!(s.q <= s.reach)) return s;
    const vec3 plane = splat_plane[splat];
    s.mean = bound.z - plane.x * x - plane.y * y;
    s.deviation = plane.z;
    if (s.mean - half_length(s) > farthest) return s;
    s.exponent = 0.0;
    if (SHAPED) s.exponent = splat_exponent[splat];
    const float w = kernel_value(s.q, s.exponent), raw = min(load_light(splat).w * w, ALPHA_MAX);
    if (!(raw >= ALPHA_CUTOFF)) return s;
    s.alpha = raw;
    s.strength = raw / w;
    return s;
}

// What the splat leaves of the light up to depth z.
float left_at(Slice s, float z) {
    const bool behind = z >= s.mean;
    if (READING == DEPTH_READING_PLANE) return behind ? 1.0 - s.alpha : 1.0;
    if (READING == DEPTH_READING_FRONT && behind) return 1.0 - s.alpha;
    const float t = (z - s.mean) / s.deviation, q = s.q + t * t;
    float a = 0.0;
    if (q <= s.reach) a = min(s.strength * kernel_value(q, s.exponent), s.alpha);
    a = a >= ALPHA_CUTOFF ? a : 0.0;
    if (READING == DEPTH_READING_FRONT) return 1.0 - a;
    const float root = sqrt(1.0 - a);
    return behind ? (1.0 - s.alpha) / root : root;
}

void find_bracket(uvec2 range, uint first, uint bits, uint pixel, vec2 centre) {
    vec4 state = vec4(1.0, NO_EDGE, 0.0, 0.0);
    uint end = first;  // behind it splats begin behind the bracket, or the pixel has ended
    if (args.segment > 0u) {
        state = bracket[pixel];
        end = part[pixel].y;
    }
    for (uint j = range.x; j < range.y && state.x > 0.0; ++j) {
        const uint intersection = splat_from_intersection[intersection_from_sorted[j]];
        if ((intersection & bits) == 0u) continue;
        const Slice s = slice_of(intersection & INTERSECTION_SPLAT_MASK, centre, NO_EDGE);
        if (s.alpha == 0.0) continue;
        const float next = state.x - s.alpha * state.x;
        if (!(next >= MIN_TRANSMITTANCE)) {
            state.x = -state.x;
            break;
        }
        const float reach = half_length(s), back = READING == DEPTH_READING_SOLID ? reach : 0.0;
        state.y = min(state.y, s.mean - reach);
        const bool decides = state.x > args.level;
        if (decides) state.z = max(state.z, s.mean + back);
        if (decides || s.mean - reach <= state.z) end = j + 1u;
        state.x = next;
    }
    if (args.segment + 1u == args.segments) {
        const float left = abs(state.x);
        depth_out[pixel] = vec2(0.0, 1.0 - left);
        const float low = max(state.y, args.near_plane);
        const float high = max(state.z, low);
        if (left <= args.level) depth_out[pixel].x = high;
        state = left <= args.level ? vec4(low, high, 1.0, UNKNOWN) : vec4(1.0, 0.0, 1.0, 1.0);
    }
    bracket[pixel] = state;
    part[pixel] = uvec3(first, end, floatBitsToUint(1.0));
}

// T at the samples, times what `left` has. kept: the part of the list that matters within the bracket, which ends at
// `high`, and what the splats before that part leave.
void walk(uvec2 range, uint bits, vec2 centre, float low, float high, inout float left[MEDIAN_SAMPLES],
          inout uvec3 kept) {
    const float step = (high - low) / float(MEDIAN_SAMPLES + 1u);
    float before = uintBitsToFloat(kept.z);
    kept.xy = range.yy;
    for (uint j = range.x; j < range.y; ++j) {
        const uint intersection = splat_from_intersection[intersection_from_sorted[j]];
        if ((intersection & bits) == 0u) continue;
        const Slice s = slice_of(intersection & INTERSECTION_SPLAT_MASK, centre, high);
        if (s.alpha == 0.0) continue;
        const float reach = half_length(s), back = READING == DEPTH_READING_SOLID ? reach : 0.0;
        const bool passed = s.mean + back <= low;
        if (passed && kept.x == range.y) {
            before *= 1.0 - s.alpha;
        } else {
            kept.x = min(kept.x, j);
            kept.y = j + 1u;
        }
        for (uint i = 0u; i < MEDIAN_SAMPLES; ++i)
            left[i] *= passed ? 1.0 - s.alpha : left_at(s, low + float(i + 1u) * step);
    }
    kept.z = floatBitsToUint(before);
}

// The part of the bracket in which T passes the level.
vec4 narrowed(vec4 b, float step, float left[MEDIAN_SAMPLES]) {
    float below = b.z;
    for (uint i = 0u; i < MEDIAN_SAMPLES; ++i) {
        if (left[i] <= args.level) return vec4(b.x + float(i) * step, b.x + float(i + 1u) * step, below, left[i]);
        below = left[i];
    }
    return vec4(b.x + float(MEDIAN_SAMPLES) * step, b.y, below, b.w);
}

bool is_found(vec4 b) {
    const float width = b.y - b.x;
    return width <= LEAST_STEP * b.y || (width <= STRAIGHT * b.y && b.z - b.w <= STRAIGHT_FALL);
}

void search(uvec2 range, uint bits, uint pixel, vec2 centre) {
    const vec4 b = bracket[pixel];
    if (b.y < b.x || is_found(b)) return;
    const float step = (b.y - b.x) / float(MEDIAN_SAMPLES + 1u);
    const uint plane = args.width * args.height;
    uvec3 kept = part[pixel];
    const float before = uintBitsToFloat(kept.z);
    float left[MEDIAN_SAMPLES];
    for (uint i = 0u; i < MEDIAN_SAMPLES; ++i) left[i] = args.segment > 0u ? product[i * plane + pixel] : before;
    const uvec2 looked = uvec2(max(range.x, kept.x), min(range.y, kept.y));
    if (looked.x < looked.y) walk(looked, bits, centre, b.x, b.y, left, kept);
    if (args.segments == 1u) {
        part[pixel] = kept;
    } else if (args.segment + 1u < args.segments) {
        for (uint i = 0u; i < MEDIAN_SAMPLES; ++i) product[i * plane + pixel] = left[i];
        return;
    }
    const vec4 rest = narrowed(b, step, left);
    bracket[pixel] = rest;
    const float fall = rest.z - rest.w;
    const float share = fall > 0.0 && rest.w >= 0.0 ? clamp((rest.z - args.level) / fall, 0.0, 1.0) : 1.0;
    depth_out[pixel].x = mix(rest.x, rest.y, share);
}

void main() {
    const uint block = gl_WorkGroupID.z, slot = block * BLOCK_PIXELS + gl_LocalInvocationID.x;
    const uvec2 at = gl_WorkGroupID.xy * TILE_SIZE + slot_to_pixel(slot);
    if (at.x >= args.width || at.y >= args.height) return;
    const uvec2 whole = tile_range[gl_WorkGroupID.y * args.tiles_x + gl_WorkGroupID.x];
    const uint begin = min(whole.x + args.segment * MEDIAN_SEGMENT, whole.y);
    const uvec2 range = uvec2(begin, min(begin + MEDIAN_SEGMENT, whole.y));
    const uint pixel = at.y * args.width + at.x;
    if (BRACKET == 1)
        find_bracket(range, whole.x, block_bit(block), pixel, vec2(at) + 0.5);
    else
        search(range, block_bit(block), pixel, vec2(at) + 0.5);
}
