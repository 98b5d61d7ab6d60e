// SPDX-License-Identifier: MIT
// Sums of eight values over a subgroup, each in lanes of its own, so that every shuffle halves what remains to be
// added. Needs SUBGROUP_SIZE, a power of two from 4 to 64.

// Halves the number of values: lanes with the bit keep the upper ones, the others keep the lower ones.
float keep_half(float low, float high, uint bit) {
    const bool upper = (gl_SubgroupInvocationID & bit) != 0u;
    return (upper ? high : low) + subgroupShuffleXor(upper ? low : high, bit);
}

// The sum over the groups of eight lanes, separately for each lane of a group. It is not a loop, because lavapipe
// counts their rounds.
float sum_of_eights(float v) {
    if (SUBGROUP_SIZE > 32u) v += subgroupShuffleXor(v, 32u);
    if (SUBGROUP_SIZE > 16u) v += subgroupShuffleXor(v, 16u);
    if (SUBGROUP_SIZE > 8u) v += subgroupShuffleXor(v, 8u);
    return v;
}

float subgroup_sum(float v) {
    v = sum_of_eights(v);
    if (SUBGROUP_SIZE > 4u) v += subgroupShuffleXor(v, 4u);
    v += subgroupShuffleXor(v, 2u);
    return v + subgroupShuffleXor(v, 1u);
}

// With 8 lanes or more, lane i returns the sum of v[i % 8] as x; with 4 lanes, lane i returns those of v[2i] and v[2i +
// 1].
vec2 transposed_sum(float v[PARTIALS]) {
    const uint first = SUBGROUP_SIZE == 4u ? 2u : 4u;
    const float a0 = keep_half(v[0], v[4], first), a1 = keep_half(v[1], v[5], first);
    const float a2 = keep_half(v[2], v[6], first), a3 = keep_half(v[3], v[7], first);
    const float b0 = keep_half(a0, a2, first >> 1u), b1 = keep_half(a1, a3, first >> 1u);
    if (SUBGROUP_SIZE == 4u) return vec2(b0, b1);
    return vec2(sum_of_eights(keep_half(b0, b1, 1u)), 0.0);
}
