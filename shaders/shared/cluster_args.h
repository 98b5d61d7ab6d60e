// SPDX-License-Identifier: MIT
// Arguments of the search for the nearest centre (shaders/publish/nearest_centre.comp,
// engine/publish/device_clusters.h).
#ifndef DARB_SHARED_CLUSTER_ARGS_H
#define DARB_SHARED_CLUSTER_ARGS_H

#include "types.h"

#ifdef __cplusplus
namespace darb::gpu {
#endif

// Rows [first_row, first_row + rows) of the buffers search the centres [first_centre, first_centre
// + centres); a workgroup takes some rows of one batch.
struct ClusterGroup {
    uint first_row, rows, first_centre, centres;
};

struct NearestCentreArgs {
    uint groups;
};

#ifdef __cplusplus
static_assert(sizeof(ClusterGroup) == 16 && sizeof(NearestCentreArgs) == 4);
}  // namespace darb::gpu
#endif

#endif
