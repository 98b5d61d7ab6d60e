// SPDX-License-Identifier: MIT
// Finds the centre nearest to each row of numbers, which is the expensive step of k-means. It compares squared
// distances without the term that all centres of a row share, |c|^2 - 2 x c; among equal ones the first wins.
// Place: SOG's palette of harmonics, engine/publish.
// Work: a workgroup takes up to ROWS times THREADS rows of one batch, and a thread ROWS of them, which it keeps in
// registers: on lavapipe a load within a loop costs as much as many products. Shared memory: none. Reads groups, rows
// and centres; writes labels.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/cluster_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;
layout(constant_id = 1) const uint QUADS = 12;  // quads per row, padded with zeros to whole ones
layout(constant_id = 2) const uint ROWS = 1;    // rows per thread

layout(push_constant, scalar) uniform Push { NearestCentreArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Groups { ClusterGroup groups[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Rows { vec4 row_values[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Centres { vec4 centre_values[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Squares { float centre_square[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Labels { uint label[]; };

vec4 x[ROWS * QUADS];  // -2 row
float best[ROWS];
uint nearest[ROWS];

void take(uint k, uint centre, vec4 sum) {
    const float distance = (sum.x + sum.y) + (sum.z + sum.w);
    nearest[k] = distance < best[k] ? centre : nearest[k];
    best[k] = min(distance, best[k]);
}

void search(uint first, uint end) {
    for (uint c = first; c < end; ++c) {
        vec4 sum[ROWS];
        for (uint k = 0; k < ROWS; ++k) sum[k] = vec4(centre_square[c], 0.0, 0.0, 0.0);
        for (uint d = 0; d < QUADS; ++d)
            for (uint k = 0; k < ROWS; ++k) sum[k] += x[k * QUADS + d] * centre_values[c * QUADS + d];
        for (uint k = 0; k < ROWS; ++k) take(k, c, sum[k]);
    }
}

void main() {
    const uint at = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (at >= args.groups) return;
    const ClusterGroup group = groups[at];
    for (uint k = 0; k < ROWS; ++k) {
        const uint row = group.first_row + min(k * THREADS + gl_LocalInvocationID.x, group.rows - 1);
        for (uint d = 0; d < QUADS; ++d) x[k * QUADS + d] = -2.0 * row_values[row * QUADS + d];
        best[k] = 1.0 / 0.0;
        nearest[k] = group.first_centre;
    }
    search(group.first_centre, group.first_centre + group.centres);
    for (uint k = 0; k < ROWS; ++k) {
        const uint row = k * THREADS + gl_LocalInvocationID.x;
        if (row < group.rows) label[group.first_row + row] = nearest[k];
    }
}
