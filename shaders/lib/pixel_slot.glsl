// SPDX-License-Identifier: MIT
// Numbers a tile's 256 pixels by slots, block after block of 8 x 8: bits 0-2 of a slot are x, 3-5 are y, 6 is the
// block's x and 7 its y. Slots with disjoint bits add up as pixels do.
#ifndef DARB_PIXEL_SLOT_GLSL
#define DARB_PIXEL_SLOT_GLSL

const uint TILE_PIXELS = 256u;
const uint BLOCK_PIXELS = 64u;

uvec2 slot_to_pixel(uint slot) {
    return uvec2((slot & 7u) | ((slot >> 3) & 8u), ((slot >> 3) & 7u) | ((slot >> 4) & 8u));
}

// The bit of an intersection that tells whether its ellipse touches the block.
uint block_bit(uint block) {
    return 1u << (INTERSECTION_BLOCK_SHIFT + block);
}

#endif
