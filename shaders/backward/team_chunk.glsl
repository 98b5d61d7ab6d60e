// SPDX-License-Identifier: MIT
// The chunk of a tile's list on which a team works. Needs CHUNK, THREADS, chunk_begin, chunk_slot and chunk_word.

void load_chunk(uint end) {
    for (uint i = gl_LocalInvocationIndex; chunk_begin + i < end && i < CHUNK; i += THREADS) {
        chunk_slot[i] = intersection_from_sorted[chunk_begin + i];
        chunk_word[i] = splat_from_intersection[chunk_slot[i]];
    }
}
