// SPDX-License-Identifier: MIT
// Arguments of the passes that put splats into another order in memory.
#ifndef DARB_ORDER_ARGS_H
#define DARB_ORDER_ARGS_H

#include "types.h"

#define MORTON_AXIS_BITS 10  // cells along a side of the grid, as a power of two: keys have 30 bits

#ifdef __cplusplus
namespace darb::gpu {
#endif

struct MortonArgs {
    uint splat_count;
    vec3 low;            // world, the corner of the grid
    float inverse_cell;  // cells per world unit
};

#ifdef __cplusplus
static_assert(sizeof(MortonArgs) == 20);
}  // namespace darb::gpu
#endif
#endif
