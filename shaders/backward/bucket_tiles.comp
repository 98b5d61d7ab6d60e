// SPDX-License-Identifier: MIT
// Stores for each record of lib/bucket.glsl the tile to which it belongs, as its index + 1. Records without a bucket
// are left as they are.
// Place: first pass of the backward blend by buckets.
// Work: one workgroup per tile; its threads take the buckets in turn. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

layout(push_constant, scalar) uniform Push { BucketArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer TileRange { uvec2 tile_range[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer BucketTile { uint bucket_tile[]; };

#include "lib/bucket.glsl"

void main() {
    const uint tile = gl_WorkGroupID.y * args.tiles_x + gl_WorkGroupID.x;
    const uvec2 range = tile_range[tile];
    const uint buckets = (range.y - range.x + BUCKET - 1u) / BUCKET;
    for (uint bucket = gl_LocalInvocationID.x; bucket < buckets; bucket += THREADS) {
        const uint record = bucket_record(tile, range.x, bucket);
        if (record < args.records) bucket_tile[record] = tile + 1u;
    }
}
