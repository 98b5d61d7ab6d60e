// SPDX-License-Identifier: MIT
// The gradient of exposure_grid.comp with respect to the picture. d_image becomes the gradient of the picture before
// the map, and its last plane dL/d(1 - transmittance), as exposure_backward.comp leaves them. A colour also decides
// where it lies in the grid, and that counts, too.
// Place: between exposure_grid_gradient, which reads the unchanged d_image, and blend_backward.
// Work: one thread per pixel. Shared memory: none. Reads the picture before the map, transmittance, maps and d_image;
// writes d_image.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/effect_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { ExposureArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Maps { vec4 maps[]; };
layout(set = 0, binding = 1, scalar) readonly buffer ImageIn { float image[]; };
layout(set = 0, binding = 2, scalar) buffer Gradient { float d_image[]; };  // [4][H W], the last plane written
layout(set = 0, binding = 3, scalar) readonly buffer FinalT { float final_transmittance[]; };

#include "effects/covered.glsl"
#include "effects/exposure_grid.glsl"

void main() {
    const uint p = linear_id();
    if (p >= args.pixels) return;
    const vec4 colour = covered_colour(p);
    const vec3 d = vec3(d_image[p], d_image[args.pixels + p], d_image[2u * args.pixels + p]);
    const GridMap map = grid_map_at(grid_place(p, colour.rgb));
    // dL/d(level), where level is the place along the luminance.
    const float d_level = dot(d.x * map.slope[0] + d.y * map.slope[1] + d.z * map.slope[2], colour);
    const float luminance = dot(colour.rgb, LUMINANCE);
    const bool within = luminance > 0.0 && luminance < 1.0;
    const vec3 by_place = within ? d_level * float(EXPOSURE_GRID_L - 1) * LUMINANCE : vec3(0.0);
    const vec4 through_map = d.x * map.row[0] + d.y * map.row[1] + d.z * map.row[2];
    const vec3 before = through_map.rgb + by_place;
    for (uint c = 0u; c < 3u; ++c) d_image[c * args.pixels + p] = before[c];
    d_image[3u * args.pixels + p] = dot(before - d, background()) + through_map.a;
}
