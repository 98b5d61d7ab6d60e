// SPDX-License-Identifier: MIT
// What a splat is along the rays of a picture: given the image position its depth has the mean z - slope . (x, y),
// (x, y) the whitened offset of blend.comp, and one deviation for all pixels. The affine projection in three dimensions,
// with S' the covariance in the image, h the low-pass and r1, r2, r3 the rows of M for x, y and depth:
//   slope = L c, c = (r3 . r1, r3 . r2)
//   deviation^2 = (det(r1, r2, r3)^2 + h (|r1 x r3|^2 + |r2 x r3|^2) + h^2 |r3|^2) / det S'
// The last is the Schur complement with all terms positive, so nothing cancels on needles and discs.
// Place: after project.comp, for depths of surfaces. Work: one thread a splat. Shared memory: none. Reads parameters and
// which splats are visible; writes slope and deviation of those.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/accuracy_list.h"
#include "shared/attribute_list.h"
#include "shared/depth_args.h"
#include "shared/limits.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "effects/constants.glsl"
#include "lib/splat_values.glsl"
#include "kernels/kernel.glsl"
#include "lib/linear_id.glsl"
#include "lib/covariance.glsl"
#include "effects/antialias.glsl"
#include "effects/camera_model.glsl"
#include "effects/sigma_points.glsl"

layout(push_constant, scalar) uniform Push { DepthPlaneArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Cameras { CameraData cameras[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Position { vec3 position[]; };
layout(set = 0, binding = 2, scalar) readonly buffer LogScale { vec3 log_scale[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Rotation { vec4 rotation[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Shape { float shape[]; };          // with SHAPED
layout(set = 0, binding = 5, scalar) readonly buffer Smoothing { float smoothing[]; };  // with SMOOTHING
layout(set = 0, binding = 6, scalar) readonly buffer Visible { uint visible[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer SplatPlane { vec3 splat_plane[]; };  // slope, deviation

const float LEAST_DEVIATION = 1e-7;  // of the depth: what float32 holds of it

void main() {
    const uint i = linear_id();
    if (i >= args.splat_count || visible[i] == 0u) return;
    const CameraData camera = cameras[args.camera_index];
    const vec3 p = to_camera(camera, from_centre(camera, position[i]));
    vec4 unit;
    float norm;
    normalise_rotation(rotation[i], unit, norm);
    float exponent = 0.0, by_shape;
    if (SHAPED) exponent = shape_exponent(shape[i], by_shape);
    vec3 s = scale_of(log_scale[i]), share;
    if (SMOOTHING == 1) smooth_scale(s, smoothing[i], share);
    s *= sqrt(kernel_covariance_scale(exponent));
    vec3 j0, j1;
    jacobian_rows(camera, p, j0, j1);
    const mat3 axes = rotation_matrix(unit);
    vec3 r1 = (to_world(camera, j0) * axes) * s, r2 = (to_world(camera, j1) * axes) * s;
    vec3 r3 = (camera.row2 * axes) * s;
    if (PROJECTION != PROJECTION_JACOBIAN) {
        const SigmaPoints points = sigma_points(camera, p, axes, s, mat2x3(j0, j1), vec2(0.0));
        if (points.used) {
            r1 = points.r1;
            r2 = points.r2;
            r3 = points.r3;
        }
    }
    const Factor f = cholesky_factor(r1, r2, args.low_pass);
    const vec2 c = vec2(dot(r3, r1), dot(r3, r2));
    const vec2 slope = vec2(f.l11 * c.x + f.l21 * c.y, f.l22 * c.y);
    const vec3 n1 = r1 * f.shrink, n2 = r2 * f.shrink;  // as the determinant has them
    const float h = args.low_pass * f.shrink * f.shrink, volume = dot(cross(n1, n2), r3);
    const vec3 a = cross(n1, r3), b = cross(n2, r3);
    const float square = volume * volume + h * (dot(a, a) + dot(b, b)) + h * h * dot(r3, r3);
    splat_plane[i] = vec3(slope, max(sqrt(square / f.determinant), LEAST_DEVIATION * p.z));
}
