// Writes one pair for each tile that a visible splat touches, in depth order: the tile as sort key and the
// splat. Place: after the scan of the pair counts. Work: one thread a visible splat. Shared memory: none. Counts the
// huge splats; with COOPERATE it lists their ranks instead of writing their pairs.
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
layout(set = 0, binding = 9, scalar) writeonly buffer HugeRank { uint huge_rank[]; };  // with COOPERATE
#include "forward/emit_cell.glsl"

void main() {
    const uint rank = linear_id();
    if (rank >= status.visible) return;
    const uint splat = depth_order[rank];
    const TileCover c = unpack_cover(cover[splat]);
    float l22;
    const vec4 shape = load_shape(splat, l22);  // mean, l11, l21
    const EllipseRows e = ellipse_rows(shape.xy, shape.z, shape.w, l22, splat_bound[splat].y);
    uint slot = pair_offset[rank];
    pair_begin[splat] = slot;
    // Offsets only grow, unless their sum left 32 bits.
    const uint next = rank + 1u < status.visible ? pair_offset[rank + 1u] : status.pairs;
    if (next < slot) {
        atomicOr(status.overflow, OVERFLOW_TOTAL);
        atomicMax(status.pairs, 0xFFFFFFFFu);
    }
    if (slot >= args.pair_capacity) return;  // the frame is repeated
    if (next > slot && next - slot > HUGE_PAIRS) {
        // Less than pair_capacity / HUGE_PAIRS + 1, unless the sum of the counts left 32 bits.
        const uint at = atomicAdd(status.huge_splats, 1u);
        if (COOPERATE == 1) {
            if (at <= args.pair_capacity / HUGE_PAIRS) huge_rank[at] = rank;
            return;
        }
    }
    if (any(notEqual(c.bits, uvec2(0)))) emit_cells(c, c.bits, splat, e, slot);
}
