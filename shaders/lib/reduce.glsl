// Sums nine values over a subgroup and adds them to a slot of the partials, each value by one lane.
// Needs SUBGROUP_SIZE, lib/partials.glsl and the buffer partial_rest [K].

// Halves the number of values: lanes with the bit keep the upper ones, the others the lower ones.
float keep_half(float low, float high, uint bit) {
    const bool upper = (gl_SubgroupInvocationID & bit) != 0u;
    return (upper ? high : low) + subgroupShuffleXor(upper ? low : high, bit);
}

// For 8 lanes, lane i returns the sum of v[i]: 7 shuffles in place of 8 reductions.
float transposed_sum(float v[PARTIALS]) {
    const float a0 = keep_half(v[0], v[4], 4u), a1 = keep_half(v[1], v[5], 4u);
    const float a2 = keep_half(v[2], v[6], 4u), a3 = keep_half(v[3], v[7], 4u);
    return keep_half(keep_half(a0, a2, 2u), keep_half(a1, a3, 2u), 1u);
}

void add_to_slot(uint slot, float v[PARTIALS], float rest) {
    if (SUBGROUP_SIZE == 8u) {
        const float mine = transposed_sum(v);
        rest += subgroupShuffleXor(rest, 4u);
        rest += subgroupShuffleXor(rest, 2u);
        rest += subgroupShuffleXor(rest, 1u);
        add_partial(slot, gl_SubgroupInvocationID, mine);
    } else {
        rest = subgroupAdd(rest);
        for (uint i = 0u; i < PARTIALS; ++i) {
            const float total = subgroupAdd(v[i]);
            if (gl_SubgroupInvocationID == i % SUBGROUP_SIZE) add_partial(slot, i, total);
        }
    }
    if (gl_SubgroupInvocationID == 0u) partial_rest[slot] += rest;
}
