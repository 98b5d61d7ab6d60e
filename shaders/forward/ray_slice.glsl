// SPDX-License-Identifier: MIT
// What the passes that ask for light along rays share: constants and buffers, and a splat's slice along the ray of a pixel,
// a(z) = alpha f(q + s^2)/f(q), s = (z - mean)/deviation (docs/math.md, Depth of a surface). A subgroup has a block of
// 8 x 8 pixels; each lane loads a splat of the list, and those that matter are broadcast in turn, as in blend.comp.

#include "shared/depth_args.h"
#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 8;  // SUBGROUP_SIZE: a workgroup is a subgroup
layout(constant_id = 1) const int READING = DEPTH_READING_FRONT;
layout(constant_id = 2) const float MIN_TRANSMITTANCE = TRANSMITTANCE_STOP * (1.0 - TRANSMITTANCE_SLACK);
layout(constant_id = 3) const uint SUBGROUP_SIZE = 8;

#include "kernels/kernel.glsl"
layout(set = 0, binding = 0, scalar) readonly buffer TileRange { uvec2 tile_range[]; };
layout(set = 0, binding = 1, scalar) readonly buffer IntersectionFromSorted { uint intersection_from_sorted[]; };
layout(set = 0, binding = 2, scalar) readonly buffer SplatFromIntersection { uint splat_from_intersection[]; };
layout(set = 0, binding = 6, scalar) readonly buffer SplatExponent { float splat_exponent[]; };  // where SHAPED
layout(set = 0, binding = 7, scalar) readonly buffer SplatPlane { vec3 splat_plane[]; };         // slope, deviation

#define SHAPE_BINDING 3
#define LIGHT_BINDING 4
#define BOUND_BINDING 5
#include "lib/projected.glsl"
#include "lib/area.glsl"

const float NO_EDGE = 3e38;

#ifdef RAY_WALK
// Splats that begin behind it do not matter to the block. A splat begins at the front of its ellipsoid.
float block_farthest = NO_EDGE;
bool hit_matters(uint splat) {
    const vec4 bound = splat_bound[splat];
    vec3 plane = splat_plane[splat];
    if (READING == DEPTH_READING_PLANE) plane.z = 0.0;
    return bound.z - sqrt(bound.y * dot(plane, plane)) * 1.0001 <= block_farthest;
}
#define HIT_MATTERS hit_matters
#endif
const uint CHUNK = 128u;
#include "lib/hits.glsl"

// A splat of the list; `number` is its place there.
struct RaySplat {
    vec4 shape;
    vec3 plane;
    float l22, opacity, exponent, reach, z;
    uint number;
};

RaySplat load_ray_splat(uint splat, uint number) {
    RaySplat s;
    s.number = number;
    s.shape = load_shape(splat, s.l22);
    s.opacity = load_light(splat).w;
    s.exponent = 0.0;
    if (SHAPED) s.exponent = splat_exponent[splat];
    const vec4 bound = splat_bound[splat];
    s.reach = bound.y;
    s.z = bound.z;
    s.plane = splat_plane[splat];
    return s;
}

RaySplat load_hit(uint hit) {
    return load_ray_splat(hit_splat[hits_base() + hit], hit_index[hits_base() + hit]);
}

RaySplat broadcast_hit(RaySplat s, uint lane) {
    RaySplat to;
    to.shape = subgroupBroadcast(s.shape, lane);
    to.plane = subgroupBroadcast(s.plane, lane);
    to.l22 = subgroupBroadcast(s.l22, lane);
    to.opacity = subgroupBroadcast(s.opacity, lane);
    to.exponent = 0.0;
    if (SHAPED) to.exponent = subgroupBroadcast(s.exponent, lane);
    to.reach = subgroupBroadcast(s.reach, lane);
    to.z = subgroupBroadcast(s.z, lane);
    to.number = subgroupBroadcast(s.number, lane);
    return to;
}

// A splat on the ray of a pixel. alpha: as the picture has it; 0: not drawn.
struct Slice {
    float alpha, w, q, mean;
};

// centre: of the pixel.
Slice slice_of(RaySplat s, vec2 centre) {
    const vec2 d = s.shape.xy - centre;
    const float x = s.shape.z * d.x + s.shape.w * d.y, y = s.l22 * d.y;
    Slice slice;
    slice.q = x * x + y * y;
    slice.w = kernel_value(slice.q, s.exponent);
    const float raw = min(s.opacity * slice.w, ALPHA_MAX);
    slice.alpha = raw >= ALPHA_CUTOFF ? raw : 0.0;
    slice.mean = s.z - s.plane.x * x - s.plane.y * y;
    return slice;
}

// What a slice (mean, 1 / deviation, strength, alpha) leaves of the light up to depth z. strength: alpha / w(q).
float left_by(vec4 slice, float q, float exponent, float z) {
    const float at = (z - slice.x) * slice.y;
    if (READING == DEPTH_READING_PLANE) return at >= 0.0 ? 1.0 - slice.w : 1.0;
    const float ahead = READING == DEPTH_READING_FRONT ? min(at, 0.0) : at;
    const float a = min(slice.z * kernel_value(q + ahead * ahead, exponent), slice.w);
    const float taken = a >= ALPHA_CUTOFF ? a : 0.0;
    if (READING == DEPTH_READING_FRONT) return 1.0 - (at >= 0.0 ? slice.w : taken);
    const float root = sqrt(1.0 - taken);
    return at >= 0.0 ? (1.0 - slice.w) / root : root;
}
