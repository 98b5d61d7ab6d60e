// How a tile's 256 pixels are dealt to threads: pixel slot k of a lane, so that each subgroup owns one compact
// block (8 x 8 px at 8 lanes with 8 pixels each, or at 64 lanes with one) which it can skip as a whole.
// Needs THREADS. Slot bits 0-2 are x, 3-5 are y, 6 is x again, 7 is y again.

const uint TILE_PIXELS = TILE_SIZE * TILE_SIZE;
const uint PIXELS = TILE_PIXELS / THREADS;  // per thread

uvec2 slot_to_pixel(uint slot) {
    return uvec2((slot & 7u) | ((slot >> 3) & 8u), ((slot >> 3) & 7u) | ((slot >> 4) & 8u));
}

// Slots of a subgroup are consecutive; within it lanes run fastest.
uint first_slot() {
    return gl_SubgroupID * gl_SubgroupSize * PIXELS + gl_SubgroupInvocationID;
}
uvec2 pixel_of(uint k) {
    return slot_to_pixel(first_slot() + k * gl_SubgroupSize);
}

// Corners of the subgroup's block, in pixels of the tile, both included.
void block_bounds(out uvec2 low, out uvec2 high) {
    const uint first = gl_SubgroupID * gl_SubgroupSize * PIXELS;
    low = slot_to_pixel(first);
    high = slot_to_pixel(min(first + gl_SubgroupSize * PIXELS, TILE_PIXELS) - 1u);
}
