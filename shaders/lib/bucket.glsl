// SPDX-License-Identifier: MIT
// Checkpoints of the forward blend, for a backward blend that works on the buckets of a tile's list side by side. Each
// bucket has a record of four planes of the tile's pixels. The forward pass leaves the light that the bucket's splats
// add to the pixel (three planes) and the transmittance behind them. bucket_behind.comp puts what lies behind the
// bucket, dotted with dL/dcolour, into a plane of its own, so that a frame can be walked back more than once.
#include "lib/depth_sum.glsl"
#include "lib/pixel_slot.glsl"

layout(constant_id = 7) const uint BUCKET = BUCKET_INTERSECTIONS;  // a multiple of SUBGROUP_SIZE; divides SEGMENT

// With DEPTH_SUM there is one more plane, the bucket's share of weight times depth, and with DEPTH_SPREAD another one
// for its square.
const uint TRANSMITTANCE_PLANE = 3u, BUCKET_DEPTH_PLANE = 4u, BUCKET_SQUARE_PLANE = 5u;
const uint CHECKPOINT_PLANES = DEPTH_SPREAD == 1 ? 6u : DEPTH_SUM == 1 ? 5u : 4u;

// The records of all tiles are separate, and there are at most intersections / BUCKET + tiles. list_begin: where the
// tile's whole list begins.
uint bucket_record(uint tile, uint list_begin, uint bucket) {
    return list_begin / BUCKET + tile + bucket;
}
uint checkpoint_at(uint record, uint plane, uint slot) {
    return (record * CHECKPOINT_PLANES + plane) * TILE_PIXELS + slot;
}
uint bucket_behind_at(uint record, uint slot) {
    return record * TILE_PIXELS + slot;
}
