// SPDX-License-Identifier: MIT
// Radix sort, step 3 of 3 of a pass, for lavapipe: every thread walks ITEMS contiguous keys with a private column of
// counters, so that neither ranking nor order needs other threads. One workgroup, which is one subgroup, per block of
// THREADS * ITEMS keys. The columns are an array of registers: on lavapipe these cost half as much as shared memory,
// and their rows are vectors. Reads offsets [digits][blocks], keys and values [n]; writes keys and values [n].
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "shaders/shared/radix_args.h"
#include "shaders/sort/radix_scatter.glsl"

void main() {
    const uint n = plan.count;
    const uint begin = min((gl_WorkGroupID.x * THREADS + gl_LocalInvocationID.x) * ITEMS, n);
    const uint end = min(begin + ITEMS, n);

    uint column[DIGITS];
    for (uint d = 0; d < DIGITS; ++d) column[d] = 0;
    for (uint i = begin; i < end; ++i) column[digit_of(keys_in[i])] += 1;
    // Turns counts into places: keys of earlier threads go first.
    for (uint d = 0; d < args.digits; ++d)
        column[d] = block_offset(d) + subgroupExclusiveAdd(column[d]);
    for (uint i = begin; i < end; ++i) {
        const uint key = keys_in[i];
        const uint digit = digit_of(key);
        const uint place = column[digit];
        column[digit] = place + 1;
        keys_out[place] = key;
        values_out[place] = value_of(i);
    }
}
