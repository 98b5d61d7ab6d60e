// SPDX-License-Identifier: MIT
// The constants and buffers that blend_backward_team.comp and blend_backward_pixels.comp share, at the same bindings.

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 128;  // AREAS * SUBGROUP_SIZE
layout(constant_id = 3) const uint SUBGROUP_SIZE = 32;
layout(constant_id = 4) const uint SEGMENT = 0;  // intersections of a list per dispatch; 0: all of them
layout(constant_id = 31) const int ALPHA_GRADIENT = 0;  // 1: d_image has one more plane, dL/d(1 - transmittance)

#include "kernels/kernel.glsl"
layout(push_constant, scalar) uniform Push { BlendArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer TileRange { uvec2 tile_range[]; };
layout(set = 0, binding = 1, scalar) readonly buffer IntersectionFromSorted { uint intersection_from_sorted[]; };
layout(set = 0, binding = 2, scalar) readonly buffer SplatFromIntersection { uint splat_from_intersection[]; };
layout(set = 0, binding = 6, scalar) readonly buffer DImage { float d_image[]; };  // [3][H][W] and more
layout(set = 0, binding = 7, scalar) buffer FinalT { float final_transmittance[]; };
layout(set = 0, binding = 8, scalar) readonly buffer LastIntersection { uint last_intersection[]; };
layout(set = 0, binding = 14, scalar) writeonly buffer PartialRest { float partial_rest[]; };  // [K][RESTS]
layout(set = 0, binding = 15, scalar) buffer Behind { float behind[]; };  // [H][W] where SEGMENT > 0
layout(set = 0, binding = 16, scalar) readonly buffer SplatExponent { float splat_exponent[]; };  // where SHAPED
layout(set = 0, binding = 17, scalar) writeonly buffer PartialExponent { float partial_exponent[]; };  // [K] where SHAPED

#define SHAPE_BINDING 3
#define LIGHT_BINDING 4
#define BOUND_BINDING 5
#include "lib/projected.glsl"
#include "lib/area.glsl"
#include "lib/depth_sum.glsl"
#include "lib/list_part.glsl"
#include "lib/own_tile.glsl"
