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
layout(set = 0, binding = 0, scalar) readonly buffer Status { FrameStatus status; };
layout(set = 0, binding = 1, scalar) readonly buffer DepthOrder { uint depth_order[]; };
layout(set = 0, binding = 2, scalar) readonly buffer PairOffset { uint pair_offset[]; };  // by rank
layout(set = 0, binding = 3, scalar) readonly buffer Cover { uvec4 cover[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer PairTile { uint pair_tile[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer PairSplat { uint pair_splat[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer PairBegin { uint pair_begin[]; };  // by splat

uint emit_cell(TileCover c, uint cell, uint splat, uint slot) {
    const uvec2 size = cell_size(c.extent);
    const uvec2 first = uvec2(cell & 7u, cell >> 3) * size;
    const uvec2 last = min(first + size, c.extent);
    for (uint y = first.y; y < last.y; ++y) {
        for (uint x = first.x; x < last.x; ++x) {
            if (slot < args.pair_capacity) {
                pair_tile[slot] = (c.origin.y + y) * args.tiles_x + c.origin.x + x;
                pair_splat[slot] = splat;
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
    uint slot = pair_offset[rank];
    pair_begin[splat] = slot;
    for (uint bits = c.bits.x; bits != 0u; bits &= bits - 1u)
        slot = emit_cell(c, uint(findLSB(bits)), splat, slot);
    for (uint bits = c.bits.y; bits != 0u; bits &= bits - 1u)
        slot = emit_cell(c, uint(findLSB(bits)) + 32u, splat, slot);
}
