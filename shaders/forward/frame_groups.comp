// SPDX-License-Identifier: MIT
// Sizes the dispatches over visible splats and over intersections, and notes an overflow of the intersection buffers.
// Place: after the scan of the flags (STAGE 0), and again after the scan of the counts (STAGE 1).
// Work: one thread. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 1;

layout(constant_id = 1) const int STAGE = 0;

layout(push_constant, scalar) uniform Push { IntersectionArgs args; };
layout(set = 0, binding = 0, scalar) buffer Status { FrameStatus status; };
layout(set = 0, binding = 1, scalar) buffer Groups { FrameGroups groups; };
layout(set = 0, binding = 2, scalar) readonly buffer Total { uint total; };  // total of the scan
layout(set = 0, binding = 3, scalar) writeonly buffer InUse { uint in_use; };  // the count for later passes

uvec2 split_groups(uint count) {
    const uint n = max((count + uint(SPLAT_GROUP) - 1u) / uint(SPLAT_GROUP), 1u);
    const uint y = (n + MAX_GROUPS - 1u) / MAX_GROUPS;
    return uvec2((n + y - 1u) / y, y);
}

void main() {
    if (STAGE == 0) {
        status.visible = total;
        in_use = total;
        const uvec2 n = split_groups(total);
        groups.visible_x = n.x;
        groups.visible_y = n.y;
        groups.visible_z = 1u;
    } else {
        const uint stored = min(total, args.intersection_capacity);
        status.intersections = total;
        if (total > args.intersection_capacity) status.overflow |= OVERFLOW_INTERSECTIONS;
        in_use = stored;
        const uvec2 n = split_groups(stored);
        groups.intersections_x = n.x;
        groups.intersections_y = n.y;
        groups.intersections_z = 1u;
    }
}
