// SPDX-License-Identifier: MIT
// Moves one attribute to the next generation's order; new splats copy their source or, for moments, start at zero.
// Place: after densify_sources, once for each attribute and pair of ranges; every source lies in one range.
// Work: one thread per float, or with COLUMNS per column of what lies in blocks (lib/rows.glsl). Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/attribute_list.h"
#include "shared/optim_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;
layout(constant_id = 1) const int COLUMNS = 0;

#include "lib/linear_id.glsl"
#include "lib/rows.glsl"

layout(push_constant, scalar) uniform Push { GatherArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Sources { uvec2 sources[]; };
layout(set = 0, binding = 1, scalar) readonly buffer From { float from[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer To { float to[]; };

layout(set = 0, binding = 1, scalar) readonly buffer FromColumn { vec4 from_column[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer ToColumn { vec4 to_column[]; };

void main() {
    const uint at = linear_id();
    const uint splat = COLUMNS == 1 ? at / (args.stride * ROW_BLOCK) * ROW_BLOCK + at % ROW_BLOCK : at / args.stride;
    if (splat >= args.to_count) return;
    const uvec2 source = sources[args.to_first + splat];
    const uint row = source.x - args.from_first;  // also beyond the range where the source lies before it
    if (row >= args.from_count) return;
    const bool zero = args.clear_new == 1u && source.y != DENSIFY_KEEP;
    if (COLUMNS == 1)
        to_column[at] = zero ? vec4(0.0) : from_column[column_at(row, at / ROW_BLOCK % args.stride, args.stride)];
    else
        to[at] = zero ? 0.0 : from[row * args.stride + at % args.stride];
}
