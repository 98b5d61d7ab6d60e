// SPDX-License-Identifier: MIT
// Writes what emit.comp writes, into the same slots, so that the lists are bit-equal, with a thread for each
// intersection. A splat over many tiles then keeps no thread longer than another, and huge splats need no pass of their
// own.
// Place: after the scan of the intersection counts.
// Work: a workgroup has THREADS neighbouring slots. As a visible splat has at least one, they belong to at most THREADS
// neighbouring ranks. The workgroup searches for the first of them together, THREADS places at a time, and each thread
// then for the rank of its own slot. Before that, threads note where the intersections of a rank begin. Shared memory:
// THREADS words and one more.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;  // a power of two

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
layout(set = 0, binding = 9, scalar) readonly buffer IntersectionsInUse { uint intersections_in_use; };
#include "forward/emit_cell.glsl"

shared uint found;           // which of the THREADS places of a round of the search
shared uint begin[THREADS];  // where the intersections of the workgroup's ranks begin

// What emit.comp does for each visible splat, besides its intersections.
void note_rank(uint rank) {
    const uint slot = offset_by_depth[rank];
    first_intersection[splat_from_depth[rank]] = slot;
    // Offsets only grow, unless their sum exceeds 32 bits.
    const uint next = rank + 1u < status.visible ? offset_by_depth[rank + 1u] : status.intersections;
    if (next < slot) {
        atomicOr(status.overflow, OVERFLOW_TOTAL);
        atomicMax(status.intersections, 0xFFFFFFFFu);
    }
    if (slot < args.intersection_capacity && next > slot && next - slot > HUGE_INTERSECTIONS)
        atomicAdd(status.huge_splats, 1u);
}

// The last rank whose intersections begin at `slot` or before. Where sums exceed 32 bits it is any rank.
uint rank_at(uint slot) {
    uint low = 0u, span = status.visible;
    while (span > 1u) {
        const uint stride = (span + THREADS - 1u) / THREADS, mine = gl_LocalInvocationID.x * stride;
        const bool begun = mine < span && offset_by_depth[low + mine] <= slot;
        const bool last = gl_LocalInvocationID.x + 1u == THREADS || mine + stride >= span ||
                          offset_by_depth[low + mine + stride] > slot;
        if (begun && last) found = mine;
        barrier();
        low += found;
        span = min(stride, span - found);
        barrier();
    }
    return low;
}

// Tile `t` of a cover in the order of emit_cells: cell by cell, and row by row within a cell. The cells of a row are
// contiguous, and all but the cover's last one are equally wide.
uvec2 tile_of_cover(TileCover c, uint t) {
    const uvec2 size = cell_size(c.extent);
    uint row = 0u, from = 0u, height = 1u;
    for (; row < 8u; ++row) {
        const uint bits = ((row < 4u ? c.bits.x : c.bits.y) >> (8u * (row & 3u))) & 0xFFu;
        if (bits == 0u) continue;
        from = uint(findLSB(bits));
        const uint width = min((uint(findMSB(bits)) + 1u) * size.x, c.extent.x) - from * size.x;
        height = min((row + 1u) * size.y, c.extent.y) - row * size.y;
        if (t < width * height) break;
        t -= width * height;
    }
    if (size.x * height == 1u) return uvec2(from + t, row * size.y);
    const uint cell = t / (size.x * height), left = (from + cell) * size.x;
    t -= cell * size.x * height;
    const uint wide = max(min(size.x, c.extent.x - left), 1u);
    return uvec2(left + t % wide, row * size.y + t / wide);
}

void main() {
    const uint slot = linear_id(), threads = gl_NumWorkGroups.x * gl_NumWorkGroups.y * THREADS;
    for (uint rank = slot; rank < status.visible; rank += threads) note_rank(rank);
    const uint first = slot - gl_LocalInvocationID.x;
    if (first >= intersections_in_use || status.visible == 0u) return;
    const uint low = rank_at(first), own = low + gl_LocalInvocationID.x;
    begin[gl_LocalInvocationID.x] = own < status.visible ? offset_by_depth[own] : 0xFFFFFFFFu;
    barrier();
    if (slot >= intersections_in_use) return;
    uint at = 0u;
    for (uint step = THREADS / 2u; step > 0u; step /= 2u)
        if (begin[at + step] <= slot) at += step;
    const uint splat = splat_from_depth[low + at];
    const TileCover c = unpack_cover(cover[splat]);
    float l22;
    const vec4 shape = load_shape(splat, l22);  // mean, l11, l21
    const EllipseRows e = ellipse_rows(shape.xy, shape.z, shape.w, l22, splat_bound[splat].y);
    const uvec2 tile = c.origin + tile_of_cover(c, slot - begin[at]);
    tile_from_intersection[slot] = tile.y * args.tiles_x + tile.x;
    splat_from_intersection[slot] = splat | touched_blocks(e, tile);
}
