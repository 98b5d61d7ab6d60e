// SPDX-License-Identifier: MIT
// Writes one intersection for each tile that a visible splat touches, in depth order: the tile as sort key, and the
// splat.
// Place: after the scan of the intersection counts.
// Work: one thread per visible splat. Shared memory: none. Counts the huge splats; with COOPERATE it lists their ranks
// instead of writing their intersections.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;
layout(constant_id = 1) const int COOPERATE = 0;  // huge splats are left to emit_huge.comp

#include "lib/linear_id.glsl"
#include "lib/tile.glsl"

layout(push_constant, scalar) uniform Push { IntersectionArgs args; };
layout(set = 0, binding = 0, scalar) buffer Status { FrameStatus status; };
layout(set = 0, binding = 1, scalar) readonly buffer SplatFromDepth { uint splat_from_depth[]; };
layout(set = 0, binding = 2, scalar) readonly buffer OffsetByDepth { uint offset_by_depth[]; };  // by rank
layout(set = 0, binding = 3, scalar) readonly buffer Cover { uvec4 cover[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer TileFromIntersection { uint tile_from_intersection[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer SplatFromIntersection { uint splat_from_intersection[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer FirstIntersection { uint first_intersection[]; };  // by splat
#define SHAPE_BINDING 7
#define BOUND_BINDING 8
#include "lib/projected.glsl"
layout(set = 0, binding = 9, scalar) writeonly buffer HugeRank { uint huge_rank[]; };  // with COOPERATE
#include "forward/emit_cell.glsl"

void main() {
    const uint rank = linear_id();
    if (rank >= status.visible) return;
    const uint splat = splat_from_depth[rank];
    const TileCover c = unpack_cover(cover[splat]);
    float l22;
    const vec4 shape = load_shape(splat, l22);  // mean, l11, l21
    const EllipseRows e = ellipse_rows(shape.xy, shape.z, shape.w, l22, splat_bound[splat].y);
    uint slot = offset_by_depth[rank];
    first_intersection[splat] = slot;
    // Offsets only grow, unless their sum exceeds 32 bits.
    const uint next = rank + 1u < status.visible ? offset_by_depth[rank + 1u] : status.intersections;
    if (next < slot) {
        atomicOr(status.overflow, OVERFLOW_TOTAL);
        atomicMax(status.intersections, 0xFFFFFFFFu);
    }
    if (slot >= args.intersection_capacity) return;  // the host repeats the frame
    if (next > slot && next - slot > HUGE_INTERSECTIONS) {
        // Less than intersection_capacity / HUGE_INTERSECTIONS + 1, unless the sum of the counts exceeds 32 bits.
        const uint at = atomicAdd(status.huge_splats, 1u);
        if (COOPERATE == 1) {
            if (at <= args.intersection_capacity / HUGE_INTERSECTIONS) huge_rank[at] = rank;
            return;
        }
    }
    if (any(notEqual(c.bits, uvec2(0)))) emit_cells(c, c.bits, splat, e, slot);
}
