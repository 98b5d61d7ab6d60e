// The centre nearest to each row of numbers: the step of k-means that costs. Squared distances less what all centres
// of a row share, |c|^2 - 2 x c; the first of equal ones wins.
// Place: SOG's palette of harmonics, engine/publish. Work: a workgroup takes up to THREADS rows of one batch, a thread
// a row, which it keeps in registers. Shared memory: none. Reads groups, rows, centres; writes labels.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/cluster_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;
layout(constant_id = 1) const uint QUADS = 12;  // of a row, padded with zeros to whole quads

layout(push_constant, scalar) uniform Push { NearestCentreArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Groups { ClusterGroup groups[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Rows { vec4 row_values[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Centres { vec4 centre_values[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Squares { float centre_square[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Labels { uint label[]; };

void main() {
    const uint at = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (at >= args.groups) return;
    const ClusterGroup group = groups[at];
    const uint within = min(gl_LocalInvocationID.x, group.rows - 1);
    const uint row = group.first_row + within;
    vec4 x[QUADS];
    for (uint d = 0; d < QUADS; ++d) x[d] = -2.0 * row_values[row * QUADS + d];
    float best = 1.0 / 0.0;
    uint nearest = group.first_centre;
    for (uint c = group.first_centre; c < group.first_centre + group.centres; ++c) {
        vec4 sum = vec4(centre_square[c], 0.0, 0.0, 0.0);
        for (uint d = 0; d < QUADS; ++d) sum += x[d] * centre_values[c * QUADS + d];
        const float distance = (sum.x + sum.y) + (sum.z + sum.w);
        if (distance < best) {
            best = distance;
            nearest = c;
        }
    }
    if (gl_LocalInvocationID.x < group.rows) label[row] = nearest;
}
