// SPDX-License-Identifier: MIT
// Writes the intersections of the splats that emit.comp left over, into the same slots, so that the lists are
// bit-equal.
// Place: after emit.comp, in frames whose predecessor had huge splats.
// Work: a workgroup takes every EMIT_HUGE_GROUPS-th huge splat, and a thread one of the 64 cells of its cover. Shared
// memory: none. Reads covers and projected splats; writes intersections.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x = EMIT_HUGE_THREADS) in;

#include "lib/tile.glsl"

layout(push_constant, scalar) uniform Push { IntersectionArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Status { FrameStatus status; };
layout(set = 0, binding = 1, scalar) readonly buffer SplatFromDepth { uint splat_from_depth[]; };
layout(set = 0, binding = 2, scalar) readonly buffer OffsetByDepth { uint offset_by_depth[]; };  // by rank
layout(set = 0, binding = 3, scalar) readonly buffer Cover { uvec4 cover[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer TileFromIntersection { uint tile_from_intersection[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer SplatFromIntersection { uint splat_from_intersection[]; };
layout(set = 0, binding = 6, scalar) readonly buffer HugeRank { uint huge_rank[]; };
#define SHAPE_BINDING 7
#define BOUND_BINDING 8
#include "lib/projected.glsl"
#include "forward/emit_cell.glsl"

uvec2 cell_bit(uint cell) {
    return cell < 32u ? uvec2(1u << cell, 0u) : uvec2(0u, 1u << (cell - 32u));
}

bool has_cell(TileCover c, uint cell) {
    return any(notEqual(c.bits & cell_bit(cell), uvec2(0)));
}

uint cell_tiles(TileCover c, uint cell) {
    const uvec2 size = cell_size(c.extent);
    const uvec2 first = uvec2(cell & 7u, cell >> 3) * size;
    const uvec2 tiles = min(first + size, c.extent) - first;
    return tiles.x * tiles.y;
}

void main() {
    const uint mine = gl_LocalInvocationID.x;
    const uint listed = min(status.huge_splats, args.intersection_capacity / HUGE_INTERSECTIONS + 1u);
    for (uint k = gl_WorkGroupID.x; k < listed; k += EMIT_HUGE_GROUPS) {
        const uint rank = huge_rank[k];
        const uint splat = splat_from_depth[rank];
        const TileCover c = unpack_cover(cover[splat]);
        if (!has_cell(c, mine)) continue;
        uint slot = offset_by_depth[rank];
        for (uint cell = 0u; cell < mine; ++cell)
            if (has_cell(c, cell)) slot += cell_tiles(c, cell);
        float l22;
        const vec4 shape = load_shape(splat, l22);  // mean, l11, l21
        const EllipseRows e = ellipse_rows(shape.xy, shape.z, shape.w, l22, splat_bound[splat].y);
        emit_cells(c, cell_bit(mine), splat, e, slot);
    }
}
