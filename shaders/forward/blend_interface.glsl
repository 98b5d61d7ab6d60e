// SPDX-License-Identifier: MIT
// The constants and buffers that the forms of the forward blend share, at the same bindings.

#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 32;       // TILE_PIXELS / PIXELS
layout(constant_id = 1) const int STORE_FOR_BACKWARD = 0;
layout(constant_id = 2) const float MIN_TRANSMITTANCE = TRANSMITTANCE_STOP * (1.0 - TRANSMITTANCE_SLACK);
layout(constant_id = 3) const uint SUBGROUP_SIZE = 8;
layout(constant_id = 4) const uint SEGMENT = 0;  // intersections of a list per dispatch; 0: all of them
layout(constant_id = 8) const int CHECKPOINTS = 0;  // 1: one record per bucket for the backward pass

#include "kernels/kernel.glsl"
layout(push_constant, scalar) uniform Push { BlendArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer TileRange { uvec2 tile_range[]; };
layout(set = 0, binding = 1, scalar) readonly buffer IntersectionFromSorted { uint intersection_from_sorted[]; };
layout(set = 0, binding = 2, scalar) readonly buffer SplatFromIntersection { uint splat_from_intersection[]; };
layout(set = 0, binding = 6, scalar) buffer ImageOut { float image[]; };  // [3][H][W] and the planes of lib/depth_sum.glsl
layout(set = 0, binding = 7, scalar) buffer FinalT { float final_transmittance[]; };
layout(set = 0, binding = 8, scalar) buffer LastIntersection { uint last_intersection[]; };
layout(set = 0, binding = 9, scalar) writeonly buffer Checkpoints { float checkpoints[]; };  // where CHECKPOINTS
layout(set = 0, binding = 10, scalar) readonly buffer SplatExponent { float splat_exponent[]; };  // where SHAPED

#define SHAPE_BINDING 3
#define LIGHT_BINDING 4
#define BOUND_BINDING 5
#include "lib/projected.glsl"
#include "lib/area.glsl"
#include "lib/list_part.glsl"
#include "lib/own_tile.glsl"
#include "lib/bucket.glsl"
const uint CHUNK = CHECKPOINTS == 1 ? BUCKET : 128u;
#include "lib/hits.glsl"
#include "lib/window.glsl"
