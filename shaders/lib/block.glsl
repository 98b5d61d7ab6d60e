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

// The stretch of a tile's list that a dispatch works off. Needs the specialization constant SEGMENT: pairs of a
// stretch, or 0 for whole lists in one dispatch.
uvec2 list_part(uvec2 range) {
    if (SEGMENT == 0u) return range;
    const uint begin = min(range.x + args.segment * SEGMENT, range.y);
    return uvec2(begin, min(begin + SEGMENT, range.y));
}

// The pairs of a stretch of the tile's list that touch the subgroup's block, packed together, so that the loop over
// them has neither gaps nor branches. Needs the buffers pair_order and pair_splat.
const uint CHUNK = 128u;  // pairs looked at before those found are worked off
shared uint hit_pair[THREADS / SUBGROUP_SIZE * CHUNK];
shared uint hit_index[THREADS / SUBGROUP_SIZE * CHUNK];

// 1: a subgroup's threads are the lanes of one vector, as on lavapipe, and need no barrier among them. lavapipe of
// Mesa 25.0 makes one of the whole workgroup, and loses the subgroups that go on after another has ended.
layout(constant_id = 5) const int LOCKSTEP = 0;

void order_within_subgroup() {
    subgroupMemoryBarrierShared();
    if (LOCKSTEP == 0) subgroupBarrier();
}

uint hits_base() {
    return gl_SubgroupID * CHUNK;
}

// Fills the subgroup's lists from pairs [begin, end), at most CHUNK of them; returns how many hit.
uint collect_hits(uint begin, uint end, uint bit) {
    order_within_subgroup();  // the lists may still be read
    uint count = 0u;
    for (uint batch = begin; batch < end; batch += SUBGROUP_SIZE) {
        const uint j = batch + gl_SubgroupInvocationID;
        uint pair = 0u;
        if (j < end) pair = pair_splat[pair_order[j]];
        const bool hit = (pair & bit) != 0u;
        const uvec4 hits = subgroupBallot(hit);
        if (hit) {
            const uint at = hits_base() + count + subgroupBallotExclusiveBitCount(hits);
            hit_pair[at] = pair & PAIR_SPLAT_MASK;
            hit_index[at] = j;
        }
        count += subgroupBallotBitCount(hits);
    }
    order_within_subgroup();
    return count;
}
