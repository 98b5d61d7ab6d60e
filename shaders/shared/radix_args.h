// SPDX-License-Identifier: MIT
// Arguments of the radix sort (shaders/sort/radix_*.comp, engine/primitives/radix_sort.h).
#ifndef DARB_SHARED_RADIX_ARGS_H
#define DARB_SHARED_RADIX_ARGS_H

#include "types.h"

#define RADIX_MAX_DIGITS 256   // 8 bits a pass, usually
#define RADIX_WIDE_DIGITS 512  // 9 bits
#define RADIX_MAX_PASSES 4
#define RADIX_THREADS 64  // threads of the pass that prepares

#ifdef __cplusplus
namespace darb::gpu {
#endif

struct RadixPrepareArgs {
    uint capacity;    // pairs that the buffers hold
    uint count_word;  // index of the pair count in its buffer, in words
    uint block;       // pairs of one workgroup
    uint totals;      // totals of all passes
};

// What the prepare pass leaves for the other passes. The first three words are a dispatch command.
struct RadixPlan {
    uint groups_x;  // blocks that hold the pairs
    uint groups_y;
    uint groups_z;
    uint count;  // pairs, at most the capacity
};

struct RadixPassArgs {
    uint shift;   // first bit of this pass's digit
    uint digits;  // values of the digit, a power of two
    uint first;   // where the pass's totals begin: the most digits times its number
};

#ifdef __cplusplus
static_assert(sizeof(RadixPrepareArgs) == 16 && sizeof(RadixPlan) == 16);
static_assert(sizeof(RadixPassArgs) == 12);
}  // namespace darb::gpu
#endif

#endif
