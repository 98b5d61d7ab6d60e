// SPDX-License-Identifier: MIT
// How a tile's pixels are dealt to threads. A subgroup takes the slots of one area at a time. An area is a block of the
// tile, so that a splat which misses the block costs nothing there. Where threads have fewer pixels it is part of a
// block, and where they have more it is several blocks. A thread's pixels differ by constants. Needs the specialization
// constant SUBGROUP_SIZE, 4 to 64, which the pipeline requires of the device.
#include "lib/pixel_slot.glsl"

layout(constant_id = 6) const uint PIXELS = 8;  // per thread; SUBGROUP_SIZE * PIXELS is at most TILE_PIXELS

const uint AREA_PIXELS = SUBGROUP_SIZE * PIXELS;
const uint AREAS = TILE_PIXELS / AREA_PIXELS;
const uint AREA_BLOCKS = AREA_PIXELS > BLOCK_PIXELS ? AREA_PIXELS / BLOCK_PIXELS : 1u;  // blocks that an area touches

// A thread's first pixel of the tile in an area; its others are at + slot_offset(k).
uvec2 first_pixel(uint area, uint lane) {
    return slot_to_pixel(area * AREA_PIXELS + lane);
}
uvec2 slot_offset(uint k) {
    return slot_to_pixel(k * SUBGROUP_SIZE);
}

// The bits of an intersection that tell whether its ellipse touches the blocks of an area.
uint area_bits(uint area) {
    return ((1u << AREA_BLOCKS) - 1u) * block_bit(area * AREA_PIXELS / BLOCK_PIXELS);
}
