// Writes one pair for each tile that a visible splat touches, in depth order: the tile as sort key and the
// splat. Place: after the scan of the pair counts. Work: one thread a visible splat. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"
#include "lib/tile.glsl"

layout(push_constant, scalar) uniform Push { PairArgs args; };
layout(set = 0, binding = 0, scalar) buffer Status { FrameStatus status; };
layout(set = 0, binding = 1, scalar) readonly buffer DepthOrder { uint depth_order[]; };
layout(set = 0, binding = 2, scalar) readonly buffer PairOffset { uint pair_offset[]; };  // by rank
layout(set = 0, binding = 3, scalar) readonly buffer Cover { uvec4 cover[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer PairTile { uint pair_tile[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer PairSplat { uint pair_splat[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer PairBegin { uint pair_begin[]; };  // by splat
#define SHAPE_BINDING 7
#define BOUND_BINDING 8
#include "lib/projected.glsl"

struct Ellipse {
    vec4 shape;  // mean, l11, l21
    vec2 bound;  // l22, reach
};

uint touched_blocks(Ellipse e, uvec2 tile) {
    uint bits = 0u;
    for (uint block = 0u; block < 4u; ++block) {
        const vec2 low = vec2(tile * TILE_SIZE + uvec2(block & 1u, block >> 1) * 8u) + 0.5;
        const float q = smallest_q(e.shape.xy, e.shape.z, e.shape.w, e.bound.x, low, low + 7.0);
        if (reaches(q, e.bound.y)) bits |= 1u << block;
    }
    return bits << PAIR_BLOCK_SHIFT;
}

uint emit_cell(TileCover c, uint cell, uint splat, Ellipse e, uint slot) {
    const uvec2 size = cell_size(c.extent);
    const uvec2 first = uvec2(cell & 7u, cell >> 3) * size;
    const uvec2 last = min(first + size, c.extent);
    for (uint y = first.y; y < last.y; ++y) {
        for (uint x = first.x; x < last.x; ++x) {
            if (slot < args.pair_capacity) {
                const uvec2 tile = c.origin + uvec2(x, y);
                pair_tile[slot] = tile.y * args.tiles_x + tile.x;
                pair_splat[slot] = splat | touched_blocks(e, tile);
            }
            ++slot;
        }
    }
    return slot;
}

void main() {
    const uint rank = linear_id();
    if (rank >= status.visible) return;
    const uint splat = depth_order[rank];
    const TileCover c = unpack_cover(cover[splat]);
    Ellipse e;
    e.shape = load_shape(splat, e.bound.x);
    e.bound.y = splat_bound[splat].y;
    uint slot = pair_offset[rank];
    pair_begin[splat] = slot;
    // Offsets only grow, unless their sum left 32 bits.
    if ((rank + 1u < status.visible ? pair_offset[rank + 1u] : status.pairs) < slot) {
        atomicOr(status.overflow, OVERFLOW_TOTAL);
        atomicMax(status.pairs, 0xFFFFFFFFu);
    }
    if (slot >= args.pair_capacity) return;  // the frame is repeated
    for (uint bits = c.bits.x; bits != 0u; bits &= bits - 1u)
        slot = emit_cell(c, uint(findLSB(bits)), splat, e, slot);
    for (uint bits = c.bits.y; bits != 0u; bits &= bits - 1u)
        slot = emit_cell(c, uint(findLSB(bits)) + 32u, splat, e, slot);
}
