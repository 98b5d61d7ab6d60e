// How a tile's 256 pixels are dealt to threads: four blocks of 8 x 8, one subgroup at a time on each, so that a
// splat which misses a block costs nothing there. Pixel slot bits 0-2 are x, 3-5 are y, 6 is the block's x, 7 its y:
// slots of disjoint bits add up to pixels, so the pixels of one thread differ by constants.
// Needs the specialization constant SUBGROUP_SIZE, 4 to 64, which the pipeline requires of the device.

const uint BLOCKS = 4u;
const uint BLOCK_PIXELS = 64u;
const uint PIXELS = BLOCK_PIXELS / SUBGROUP_SIZE;  // per thread

uvec2 slot_to_pixel(uint slot) {
    return uvec2((slot & 7u) | ((slot >> 3) & 8u), ((slot >> 3) & 7u) | ((slot >> 4) & 8u));
}

// Pixel of the tile that a thread has first in a block; its others are at + slot_offset(k).
uvec2 first_pixel(uint block, uint lane) {
    return slot_to_pixel(block * BLOCK_PIXELS + lane);
}
uvec2 slot_offset(uint k) {
    return slot_to_pixel(k * SUBGROUP_SIZE);
}

// The bit of a pair that says whether its ellipse touches the block.
uint block_bit(uint block) {
    return 1u << (PAIR_BLOCK_SHIFT + block);
}
