// SPDX-License-Identifier: MIT
// Does what exposure.comp does with a bilateral grid of maps in place of one map, for cameras whose tones change from
// place to place.
// Place: between blend and loss, only in training.
// Work: one thread per pixel. Shared memory: none. Reads picture, transmittance and maps; writes the mapped picture.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/effect_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { ExposureArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Maps { vec4 maps[]; };  // [views][vertices][3]
layout(set = 0, binding = 1, scalar) readonly buffer ImageIn { float image[]; };      // [3][H W]
layout(set = 0, binding = 2, scalar) writeonly buffer ImageOut { float mapped[]; };   // [3][H W]
layout(set = 0, binding = 3, scalar) readonly buffer FinalT { float final_transmittance[]; };  // [H W]

#include "effects/covered.glsl"
#include "effects/exposure_grid.glsl"

void main() {
    const uint p = linear_id();
    if (p >= args.pixels) return;
    const vec4 covered = covered_colour(p);
    const vec3 through = final_transmittance[p] * background();
    const GridMap map = grid_map_at(grid_place(p, covered.rgb));
    for (uint c = 0u; c < 3u; ++c) mapped[c * args.pixels + p] = dot(map.row[c], covered) + through[c];
}
