// SPDX-License-Identifier: MIT
// Projects every splat: camera space, Cholesky factor of the projected covariance, colour from SH, reach, and the tiles
// that it touches.
// Place: first pass of a frame. Source: docs/math.md, Projection.
// Work: one thread per splat. Shared memory: none. Reads parameters; writes the projected splat and its cover.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_ballot : require

#include "shared/accuracy_list.h"
#include "shared/attribute_list.h"
#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;
layout(constant_id = 1) const int SH_DEGREE = 0;   // degree in use
layout(constant_id = 2) const int SH_STORED = 0;   // degree of the buffer's layout

#include "effects/constants.glsl"
#include "lib/splat_values.glsl"
#include "kernels/kernel.glsl"
#include "lib/linear_id.glsl"
#include "lib/sh.glsl"
#include "lib/covariance.glsl"
#include "lib/tile.glsl"
#include "lib/depth.glsl"
#include "effects/antialias.glsl"
#include "effects/camera_model.glsl"
#include "effects/sigma_points.glsl"
#include "effects/shutter.glsl"

#define FRAME_BINDING (1 + ATTRIBUTES)
layout(push_constant, scalar) uniform Push { ProjectArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Cameras { CameraData cameras[]; };
layout(set = 0, binding = 1 + ATTRIBUTE_POSITION, scalar) readonly buffer Position { vec3 position[]; };
layout(set = 0, binding = 1 + ATTRIBUTE_LOG_SCALE, scalar) readonly buffer LogScale { vec3 log_scale[]; };
layout(set = 0, binding = 1 + ATTRIBUTE_ROTATION, scalar) readonly buffer Rotation { vec4 rotation[]; };
layout(set = 0, binding = 1 + ATTRIBUTE_OPACITY_LOGIT, scalar) readonly buffer Opacity { float opacity_logit[]; };
layout(set = 0, binding = 1 + ATTRIBUTE_SH_DC, scalar) readonly buffer ShDc { vec3 sh_dc[]; };
layout(set = 0, binding = 1 + ATTRIBUTE_SH_REST, scalar) readonly buffer ShRest { vec4 sh_rest[]; };  // from first_splat on
layout(set = 0, binding = 1 + ATTRIBUTE_SHAPE, scalar) readonly buffer Shape { float shape[]; };  // with SHAPED
layout(set = 0, binding = FRAME_BINDING, scalar) writeonly buffer SplatShape { vec4 splat_shape[]; };  // mean, l11, l21
layout(set = 0, binding = FRAME_BINDING, scalar) writeonly buffer SplatShapeHalf { uvec4 splat_shape_half[]; };
layout(set = 0, binding = FRAME_BINDING + 1, scalar) writeonly buffer SplatLight { vec4 splat_light[]; };  // rgb, opacity
layout(set = 0, binding = FRAME_BINDING + 1, scalar) writeonly buffer SplatLightHalf { uvec2 splat_light_half[]; };
layout(set = 0, binding = FRAME_BINDING + 2, scalar) writeonly buffer SplatBound { vec4 splat_bound[]; };  // l22, reach, depth, slope
layout(set = 0, binding = FRAME_BINDING + 3, scalar) writeonly buffer Cover { uvec4 cover[]; };
layout(set = 0, binding = FRAME_BINDING + 4, scalar) writeonly buffer IntersectionCount { uint intersection_count[]; };
layout(set = 0, binding = FRAME_BINDING + 5, scalar) writeonly buffer Visible { uint visible[]; };
layout(set = 0, binding = FRAME_BINDING + 6, scalar) buffer Status { FrameStatus status; };
layout(set = 0, binding = FRAME_BINDING + 7, scalar) readonly buffer Smoothing { float smoothing[]; };  // [N] world, with SMOOTHING
layout(set = 0, binding = FRAME_BINDING + 8, scalar) writeonly buffer SplatExponent { float splat_exponent[]; };  // with SHAPED

#include "lib/rest.glsl"

// Not clamped, because max may drop NaN.
vec3 splat_colour(uint i, vec3 direction) {
    vec3 colour = first_band(sh_dc[i]);
    if (SH_DEGREE > 0) {
        float basis[SH_REST_MAX];
        sh_basis(direction, basis);
        for (int t = 0; t < FOURS; ++t) {
            vec3 rest[4];
            load_four(i - args.first_splat, t, rest);
            for (int k = 0; k < 4; ++k)
                if (4 * t + k < SH_USED) colour += basis[4 * t + k] * rest[k];
        }
    }
    return colour;
}

// At a given image position, a splat's depth has the mean z - slope . (x, y), where (x, y) is the whitened offset of
// blend.comp, slope = L c, and c the covariance of depth and image position. r3: the row of M for the depth. Returned
// as two halves.
float depth_slope(Factor f, vec3 r1, vec3 r2, vec3 r3) {
    const vec2 c = vec2(dot(r3, r1), dot(r3, r2));
    const float x = f.l11 * c.x + f.l21 * c.y, y = f.l22 * c.y;
    return uintBitsToFloat(packHalf2x16(vec2(round_half(x), round_half(y))));
}

void store_splat(uint i, vec2 mean, Factor f, vec3 colour, float opacity) {
    if (STORAGE == STORAGE_FLOAT32) {
        splat_shape[i] = vec4(mean, f.l11, f.l21);
        splat_light[i] = vec4(colour, opacity);
    } else {
        splat_shape_half[i] = uvec4(floatBitsToUint(mean), packHalf2x16(vec2(f.l11, f.l21)),
                                    packHalf2x16(vec2(f.l22, 0.0)));
        splat_light_half[i] = uvec2(packHalf2x16(vec2(round_half(colour.r), round_half(colour.g))),
                                    packHalf2x16(vec2(round_half(colour.b), opacity)));
    }
}

// Returns the number of tiles; the cover is empty where the ellipse misses the image.
uint find_cover(CameraData camera, vec2 mean, Factor f, float reach, out TileCover c) {
    const vec2 half_extent = sqrt(reach * vec2(f.a, f.c)) * 1.001 + 0.01;
    const vec2 tiles = vec2(camera.tiles_x, camera.tiles_y);
    const vec2 low = clamp(floor((mean - half_extent) / float(TILE_SIZE)), vec2(0.0), tiles);
    const vec2 high = clamp(floor((mean + half_extent) / float(TILE_SIZE)) + 1.0, vec2(0.0), tiles);
    c = TileCover(uvec2(low), uvec2(max(high - low, 0.0)), uvec2(0));
    if (c.extent.x == 0u || c.extent.y == 0u) return 0u;
    const uvec2 size = cell_size(c.extent), cells = (c.extent + size - 1u) / size;
    const vec2 cell = vec2(size * TILE_SIZE), corner = vec2(c.origin * TILE_SIZE) + 0.5;
    const vec2 last = min(vec2((c.origin + c.extent) * TILE_SIZE), vec2(camera.width, camera.height)) - 0.5;
    const EllipseRows e = ellipse_rows(mean, f.l11, f.l21, f.l22, reach);
    uint count = 0u, y = 0u;
    do {  // tested at the bottom: see emit_cells
        const float low_y = corner.y + float(y) * cell.y;
        const vec2 x = columns_between(e, low_y, min(low_y + cell.y - 1.0, last.y));
        // No pixel centre lies between the last pixel of a cell and the first of the next.
        const vec2 k = (x - corner.x + vec2(1.0, 0.0)) / cell.x;
        const uint from = uint(clamp(ceil(k.x) - 1.0, 0.0, float(cells.x - 1u)));
        const uint to = uint(clamp(floor(k.y), 0.0, float(cells.x - 1u)));
        if (from <= to && x.x <= x.y && x.x <= last.x && x.y >= corner.x) {
            const uint row = ((2u << to) - (1u << from)) << (8u * (y & 3u));
            if (y < 4u) c.bits.x |= row; else c.bits.y |= row;
            count += (min((to + 1u) * size.x, c.extent.x) - from * size.x) *
                     (min((y + 1u) * size.y, c.extent.y) - y * size.y);
        }
    } while (++y < cells.y);
    return count;
}

// Returns the number of intersections, or 0 and the reason.
uint project(uint i, out int reason) {
    CameraData camera = cameras[args.camera_index];
    float time = 0.0;
    if (SHUTTER == 1) time = take_row(camera, position[i]);
    const vec3 to_splat = from_centre(camera, position[i]);
    const vec3 p = to_camera(camera, to_splat);
    reason = CULL_NEAR;
    if (!magnitude_below(p, 1e30) || !(p.z > camera.near_plane)) return 0u;

    vec4 unit;
    float norm;
    reason = CULL_ROTATION;
    if (!normalise_rotation(rotation[i], unit, norm)) return 0u;

    reason = CULL_OPACITY;
    const float logit = opacity_logit[i];
    float opacity = opacity_of(logit);
    if (STORAGE == STORAGE_FLOAT16 && !FILTERED) opacity = round_half(opacity);
    float exponent = 0.0, by_shape;
    if (SHAPED) {
        if (is_nan(shape[i])) return 0u;
        exponent = shape_exponent(shape[i], by_shape);
    }
    if (!(opacity >= ALPHA_CUTOFF) || is_nan(logit)) return 0u;

    reason = CULL_COVARIANCE;
    const vec3 raw_scale = log_scale[i];
    vec3 s = scale_of(raw_scale), share;
    if (SMOOTHING == 1) opacity *= smooth_scale(s, smoothing[i], share);
    s *= sqrt(kernel_covariance_scale(exponent));
    vec3 j0, j1;
    jacobian_rows(camera, p, j0, j1);
    const mat2x3 moment = mat2x3(j0, j1);
    vec2 shear = vec2(0.0), shift = vec2(0.0);
    if (SHUTTER == 1) {
        const ShutterMotion motion = shutter_motion(camera, time, p, j0, j1);
        shear = motion.per_row * motion.pixel;
        add_shutter(motion, j0, j1);
    }
    const mat3 axes = rotation_matrix(unit);
    vec3 r1 = (to_world(camera, j0) * axes) * s;
    vec3 r2 = (to_world(camera, j1) * axes) * s;
    vec3 r3 = vec3(0.0);  // of the depth
    if (DEPTH_ORDER == DEPTH_ORDER_PIXEL) r3 = (camera.row2 * axes) * s;
    if (PROJECTION != PROJECTION_JACOBIAN) {
        const SigmaPoints points = sigma_points(camera, p, axes, s, moment, shear);
        if (points.used) {
            r1 = points.r1;
            r2 = points.r2;
            r3 = points.r3;
            shift = points.shift;
        }
    }
    const Factor f = cholesky_factor(r1, r2, args.low_pass);
    const float unit_area = f.shrink * f.shrink;
    if (!is_finite(f.determinant) || any_nan(raw_scale)) return 0u;
    if (!(f.determinant > DETERMINANT_MIN * unit_area * unit_area)) return 0u;

    reason = CULL_OPACITY;
    if (ANTIALIAS == 1) opacity *= compensation(r1, r2, f);
    if (STORAGE == STORAGE_FLOAT16 && FILTERED) opacity = round_half(opacity);
    const float reach = kernel_reach(opacity, exponent);
    if (!(reach > 0.0)) return 0u;

    reason = CULL_OUTSIDE;
    vec2 mean;
    if (!pixel_of(camera, p, mean)) return 0u;
    if (PROJECTION != PROJECTION_JACOBIAN) mean += shift;
    TileCover c;
    const uint count = find_cover(camera, mean, f, reach, c);
    if (count == 0u) return 0u;

    reason = CULL_COLOUR;
    const vec3 signed_colour = splat_colour(i, normalize(to_splat)), colour = shown_colour(signed_colour);
    if (any_nan(signed_colour) || !magnitude_below(colour, 1e30)) return 0u;

    float slope = 0.0;
    if (DEPTH_ORDER == DEPTH_ORDER_PIXEL) slope = depth_slope(f, r1, r2, r3);
    store_splat(i, mean, f, colour, opacity);
    splat_bound[i] = vec4(f.l22, reach, p.z, slope);
    if (SHAPED) splat_exponent[i] = exponent;
    cover[i] = pack_cover(c);
    return count;
}

// One addition to memory per subgroup and reason.
void count_culled(bool culled, int reason) {
    for (int r = 0; r <= CULL_COLOUR; ++r) {
        const uint n = subgroupBallotBitCount(subgroupBallot(culled && reason == r));
        if (n > 0u && subgroupElect()) atomicAdd(status.culled[r], n);
    }
}

void main() {
    const uint i = args.first_splat + linear_id();
    if (i >= args.splat_end) return;
    int reason;
    const uint count = project(i, reason);
    intersection_count[i] = count;
    visible[i] = count > 0u ? 1u : 0u;
    count_culled(count == 0u, reason);
}
