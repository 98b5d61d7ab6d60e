// SPDX-License-Identifier: MIT
// Arguments of the exclusive prefix sum (shaders/sort/scan_*.comp, engine/primitives/scan.h).
#ifndef DARB_SHARED_SCAN_ARGS_H
#define DARB_SHARED_SCAN_ARGS_H

#include "types.h"

#ifdef __cplusplus
namespace darb::gpu {
#endif

struct ScanPrepareArgs {
    uint capacity;         // elements that counts and offsets hold
    uint count_word;       // index of the element count in its buffer, in words
    uint chunk;            // elements that one team (a thread or a subgroup) sums
    uint teams_per_group;  // teams of one workgroup
};

// What the prepare pass leaves for the other passes. The first three words are a dispatch command.
struct ScanPlan {
    uint groups_x;
    uint groups_y;
    uint groups_z;
    uint count;   // elements, at most the capacity
    uint chunks;  // chunks that hold them
};

struct ScanTopArgs {
    uint total_word;  // index of the total in its buffer, in words
};

#ifdef __cplusplus
static_assert(sizeof(ScanPrepareArgs) == 16 && sizeof(ScanPlan) == 20 && sizeof(ScanTopArgs) == 4);
}  // namespace darb::gpu
#endif

#endif
