// Radix sort, step 3 of 3 of a pass, for GPUs: a subgroup ranks a row of keys by one ballot a digit
// bit; rows of a subgroup are contiguous, so that all reads are. After Adinets and Merrill 2022.
// One workgroup a block of THREADS * ITEMS keys. Shared memory: a KiB a subgroup.
// Reads offsets [RADIX_MAX_DIGITS][blocks], keys and values [n]; writes keys and values [n].
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "shaders/shared/radix_args.h"
#include "shaders/sort/radix_scatter.glsl"

layout(constant_id = 3) const uint SUBGROUPS = 4;  // at least gl_NumSubgroups

shared uint counters[SUBGROUPS * RADIX_MAX_DIGITS];  // [subgroup][digit]

// The lanes of the subgroup that hold the same digit; only lanes that are valid.
uvec4 peers_of(uint digit, bool valid) {
    uvec4 peers = subgroupBallot(valid);
    for (uint bit = 1; bit < args.digits; bit <<= 1) {
        const bool set = (digit & bit) != 0;
        const uvec4 vote = subgroupBallot(set);
        peers &= set ? vote : ~vote;
    }
    return peers;
}

void main() {
    const uint n = plan.count;
    const uint row = gl_SubgroupID * RADIX_MAX_DIGITS;
    const uint begin = gl_WorkGroupID.x * THREADS * ITEMS + gl_SubgroupID * gl_SubgroupSize * ITEMS +
                       gl_SubgroupInvocationID;
    for (uint i = gl_LocalInvocationID.x; i < SUBGROUPS * RADIX_MAX_DIGITS; i += THREADS)
        counters[i] = 0;
    barrier();

    uint keys[ITEMS], ranks[ITEMS];
    for (uint i = 0; i < ITEMS; ++i) {
        const uint index = begin + i * gl_SubgroupSize;
        const bool valid = index < n;
        keys[i] = valid ? keys_in[index] : 0;
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
    // Counts become places: keys of earlier subgroups go first.
    for (uint d = gl_LocalInvocationID.x; d < args.digits; d += THREADS) {
        uint place = block_offset(d);
        for (uint s = 0; s < gl_NumSubgroups; ++s) {
            const uint count = counters[s * RADIX_MAX_DIGITS + d];
            counters[s * RADIX_MAX_DIGITS + d] = place;
            place += count;
        }
    }
    barrier();
    for (uint i = 0; i < ITEMS; ++i) {
        const uint index = begin + i * gl_SubgroupSize;
        if (index >= n) break;
        const uint place = counters[row + digit_of(keys[i])] + ranks[i];
        keys_out[place] = keys[i];
        values_out[place] = value_of(index);
    }
}
