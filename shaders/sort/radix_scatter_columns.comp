// Radix sort, step 3 of 3 of a pass, for lavapipe: every thread walks ITEMS contiguous keys with a
// private column of counters, so that neither ranking nor order needs other threads.
// One workgroup a block of THREADS * ITEMS keys. Shared memory: THREADS KiB.
// Reads offsets [RADIX_MAX_DIGITS][blocks], keys and values [n]; writes keys and values [n].
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shaders/shared/radix_args.h"
#include "shaders/sort/radix_scatter.glsl"

shared uint columns[RADIX_MAX_DIGITS * THREADS];  // [digit][thread]

void main() {
    const uint thread = gl_LocalInvocationID.x;
    const uint n = plan.count;
    const uint begin = min((gl_WorkGroupID.x * THREADS + thread) * ITEMS, n);
    const uint end = min(begin + ITEMS, n);

    for (uint d = 0; d < args.digits; ++d) columns[d * THREADS + thread] = 0;
    for (uint i = begin; i < end; ++i) columns[digit_of(keys_in[i]) * THREADS + thread] += 1;
    barrier();
    // Counts become places: keys of earlier threads go first.
    for (uint d = thread; d < args.digits; d += THREADS) {
        uint place = block_offset(d);
        for (uint t = 0; t < THREADS; ++t) {
            const uint count = columns[d * THREADS + t];
            columns[d * THREADS + t] = place;
            place += count;
        }
    }
    barrier();
    for (uint i = begin; i < end; ++i) {
        const uint key = keys_in[i];
        const uint column = digit_of(key) * THREADS + thread;
        const uint place = columns[column];
        columns[column] = place + 1;
        keys_out[place] = key;
        values_out[place] = value_of(i);
    }
}
