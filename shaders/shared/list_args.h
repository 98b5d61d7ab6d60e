// SPDX-License-Identifier: MIT
// Arguments of the passes that count the lists of the tiles (shaders/sort/list_*.comp,
// engine/raster/tile_lists.h).
#ifndef DARB_SHARED_LIST_ARGS_H
#define DARB_SHARED_LIST_ARGS_H

#include "types.h"

#define LIST_BLOCK 8192u  // intersections that a workgroup counts, and scatters
#define LIST_THREADS 256  // of the workgroups that count, and of the one that makes the ranges
#define LIST_MAX_TILES 8192u
#define LIST_COLUMNS 32u  // tiles of a workgroup of the pass that adds up the blocks
#define LIST_PARTS 8u     // threads that share a tile there

#ifdef __cplusplus
namespace darb::gpu {
#endif

struct ListArgs {
    uint tile_count;
    uint list_capacity;  // the longest list of a tile that the blend dispatches process
};

#ifdef __cplusplus
static_assert(sizeof(ListArgs) == 8);
}  // namespace darb::gpu
#endif

#endif
