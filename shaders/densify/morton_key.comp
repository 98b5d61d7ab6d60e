// SPDX-License-Identifier: MIT
// The place of each splat on a space-filling curve: the bits of its cell's three numbers in turn (Morton 1966). Splats
// outside the grid count as in the cell at its border, and those without a finite position as in the last cell of all.
// Place: before the sort of splats after density control.
// Work: one thread per splat. Shared memory: none.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/order_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/finite.glsl"
#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { MortonArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Position { vec3 position[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Key { uint key[]; };

// Spreads ten bits two places apart.
uint spread(uint bits) {
    bits = (bits | (bits << 16)) & 0x030000FFu;
    bits = (bits | (bits << 8)) & 0x0300F00Fu;
    bits = (bits | (bits << 4)) & 0x030C30C3u;
    return (bits | (bits << 2)) & 0x09249249u;
}

uint axis(float at) {
    const float cells = float(1u << MORTON_AXIS_BITS);
    if (!magnitude_below(at, 1e30)) return (1u << MORTON_AXIS_BITS) - 1u;
    return uint(clamp(at, 0.0, cells - 1.0));
}

void main() {
    const uint i = linear_id();
    if (i >= args.splat_count) return;
    const vec3 at = (position[i] - args.low) * args.inverse_cell;
    key[i] = spread(axis(at.x)) | spread(axis(at.y)) << 1 | spread(axis(at.z)) << 2;
}
