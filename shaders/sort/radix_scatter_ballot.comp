// SPDX-License-Identifier: MIT
// Radix sort, step 3 of 3 of a pass, for GPUs: a subgroup ranks a row of keys by one ballot per digit bit. The rows of
// a subgroup are contiguous, so that all reads are. The block's keys are brought into order in shared memory, so that
// keys with the same digit are written side by side. After Adinets and Merrill 2022. One workgroup per block of THREADS
// * ITEMS keys. Shared memory: the block's keys, DIGITS words per subgroup, and as many more. Reads offsets [digits][blocks],
// keys and values [n]; writes keys and values [n].
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "shaders/shared/radix_args.h"
#include "shaders/sort/radix_scatter.glsl"

layout(constant_id = 3) const uint SUBGROUPS = 4;  // at least gl_NumSubgroups

const uint RUN = DIGITS / THREADS;  // digits that a thread counts

shared uint counters[SUBGROUPS * DIGITS];  // [subgroup][digit]
shared uint digit_places[DIGITS];  // where a digit's keys go, less their place in the block
shared uint subgroup_sums[SUBGROUPS];
shared uint block_words[THREADS * ITEMS];  // the block's keys or values in order

// The valid lanes of the subgroup that hold the same digit.
uvec4 peers_of(uint digit, bool valid) {
    uvec4 peers = subgroupBallot(valid);
    for (uint bit = 1; bit < args.digits; bit <<= 1) {
        const bool set = (digit & bit) != 0;
        const uvec4 vote = subgroupBallot(set);
        peers &= set ? vote : ~vote;
    }
    return peers;
}

// Turns counts into places in the block: digit by digit, and keys of earlier subgroups first.
void place_digits() {
    // gl_LocalInvocationID would not do, because its order need not be that of the subgroups.
    const uint first = RUN * (gl_SubgroupID * gl_SubgroupSize + gl_SubgroupInvocationID);
    uint total = 0;
    for (uint d = first; d < first + RUN; ++d) {
        digit_places[d] = total;
        for (uint s = 0; s < gl_NumSubgroups; ++s) total += counters[s * DIGITS + d];
    }
    const uint inclusive = subgroupInclusiveAdd(total);
    if (gl_SubgroupInvocationID == gl_SubgroupSize - 1) subgroup_sums[gl_SubgroupID] = inclusive;
    barrier();
    uint before = inclusive - total;
    for (uint s = 0; s < gl_SubgroupID; ++s) before += subgroup_sums[s];
    for (uint d = first; d < first + RUN; ++d) {
        uint place = digit_places[d] + before;
        digit_places[d] = block_offset(d) - place;
        for (uint s = 0; s < gl_NumSubgroups; ++s) {
            const uint count = counters[s * DIGITS + d];
            counters[s * DIGITS + d] = place;
            place += count;
        }
    }
}

void main() {
    const uint row = gl_SubgroupID * DIGITS, thread = gl_LocalInvocationID.x;
    const uint block = gl_WorkGroupID.x * THREADS * ITEMS, count = min(plan.count - block, THREADS * ITEMS);
    const uint begin = gl_SubgroupID * gl_SubgroupSize * ITEMS + gl_SubgroupInvocationID;
    for (uint i = thread; i < SUBGROUPS * DIGITS; i += THREADS) counters[i] = 0;
    barrier();

    uint keys[ITEMS], ranks[ITEMS];
    [[unroll]] for (uint i = 0; i < ITEMS; ++i) {
        const uint at = begin + i * gl_SubgroupSize;
        const bool valid = at < count;
        keys[i] = valid ? keys_in[block + at] : 0;
        const uint digit = digit_of(keys[i]);
        const uvec4 peers = peers_of(digit, valid);
        const uint before = subgroupBallotExclusiveBitCount(peers);
        const uint earlier = counters[row + digit];
        ranks[i] = earlier + before;
        subgroupBarrier();
        if (valid && before == 0)
            counters[row + digit] = earlier + subgroupBallotBitCount(peers);
        subgroupBarrier();
    }
    barrier();
    place_digits();
    barrier();
    [[unroll]] for (uint i = 0; i < ITEMS; ++i) {
        ranks[i] += counters[row + digit_of(keys[i])];
        if (begin + i * gl_SubgroupSize < count) block_words[ranks[i]] = keys[i];
    }
    barrier();
    [[unroll]] for (uint i = 0; i < ITEMS; ++i) {
        const uint at = thread + i * THREADS;
        if (at < count) {
            const uint key = block_words[at];
            keys[i] = digit_places[digit_of(key)] + at;
            keys_out[keys[i]] = key;
        }
    }
    barrier();
    [[unroll]] for (uint i = 0; i < ITEMS; ++i) {
        const uint at = begin + i * gl_SubgroupSize;
        if (at < count) block_words[ranks[i]] = value_of(block + at);
    }
    barrier();
    [[unroll]] for (uint i = 0; i < ITEMS; ++i) {
        const uint at = thread + i * THREADS;
        if (at < count) values_out[keys[i]] = block_words[at];
    }
}
