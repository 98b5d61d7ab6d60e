// SPDX-License-Identifier: MIT
// Finds what lies behind each bucket of a pixel's list, dotted with dL/dcolour. It puts the bucket's own light in front
// of what lies behind it, last bucket to first, so that only convex combinations are made and nothing cancels (the
// final colour less the colour so far does, by 3 % after 10,000 layers).
// Place: between bucket_tiles and blend_backward_buckets.
// Work: one thread per pixel, one workgroup per block of a tile. Shared memory: none. Reads what the forward pass
// stored and writes bucket_behind for the records that a pixel sees. Long lists take several dispatches as in
// blend_backward.comp; behind holds the pixels' state in between.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;  // BLOCK_PIXELS
layout(constant_id = 4) const uint SEGMENT = 0;  // intersections of a list per dispatch; 0: all of them
layout(constant_id = 31) const int ALPHA_GRADIENT = 0;  // as in blend_backward.comp

layout(push_constant, scalar) uniform Push { BlendArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer TileRange { uvec2 tile_range[]; };
layout(set = 0, binding = 1, scalar) readonly buffer DImage { float d_image[]; };  // [3][H][W]
layout(set = 0, binding = 2, scalar) readonly buffer LastIntersection { uint last_intersection[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Checkpoints { float checkpoints[]; };
layout(set = 0, binding = 4, scalar) buffer Behind { float behind[]; };  // [H][W] where SEGMENT > 0
layout(set = 0, binding = 5, scalar) writeonly buffer BucketBehind { float bucket_behind[]; };  // [records][TILE_PIXELS]

#include "lib/pixel_slot.glsl"
#include "lib/list_part.glsl"
#include "lib/bucket.glsl"
#include "backward/depth_gradient.glsl"

const float LEAST_TRANSMITTANCE = 1e-30;  // below it nothing has weight, and no bit of a quotient is right

void main() {
    const uvec2 tile = gl_WorkGroupID.xy;
    const uint tile_index = tile.y * args.tiles_x + tile.x;
    const uvec2 whole = tile_range[tile_index], range = list_part(whole);
    const uint slot = gl_WorkGroupID.z * THREADS + gl_LocalInvocationID.x;
    const uvec2 at = tile * TILE_SIZE + slot_to_pixel(slot);
    if (at.x >= args.width || at.y >= args.height) return;
    const uint o = at.y * args.width + at.x, plane = args.width * args.height;
    const uint last = last_intersection[o];
    if (last <= range.x) return;

    const vec3 d_colour = vec3(d_image[o], d_image[plane + o], d_image[2u * plane + o]);
    float rest = dot(d_colour, vec3(args.background_r, args.background_g, args.background_b));
    if (ALPHA_GRADIENT == 1) rest -= d_image[3u * plane + o];
    vec3 d_depth = vec3(0.0);
    if (DEPTH_SUM == 1) d_depth = load_depth_gradient(plane, o);
    if (SEGMENT > 0u && last > range.y) rest = behind[o];
    const uint first = (range.x - whole.x) / BUCKET;
    uint bucket = (min(last, range.y) - 1u - whole.x) / BUCKET;
    uint record = bucket_record(tile_index, whole.x, bucket);
    float after = checkpoints[checkpoint_at(record, TRANSMITTANCE_PLANE, slot)];
    for (;; --bucket, --record) {
        vec3 light;
        for (int c = 0; c < 3; ++c) light[c] = checkpoints[checkpoint_at(record, uint(c), slot)];
        bucket_behind[bucket_behind_at(record, slot)] = rest;
        float before = 1.0;
        if (bucket > 0u) before = checkpoints[checkpoint_at(record - 1u, TRANSMITTANCE_PLANE, slot)];
        float ahead = dot(light, d_colour);
        if (DEPTH_SUM == 1) ahead += checkpoints[checkpoint_at(record, BUCKET_DEPTH_PLANE, slot)] * d_depth.x;
        if (DEPTH_SPREAD == 1)
            ahead += checkpoints[checkpoint_at(record, BUCKET_SQUARE_PLANE, slot)] * d_depth.y;
        rest = before > LEAST_TRANSMITTANCE ? (ahead + after * rest) / before : 0.0;
        if (bucket == first) break;
        after = before;
    }
    if (SEGMENT > 0u && args.segment > 0u) behind[o] = rest;
}
