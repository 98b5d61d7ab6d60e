// SPDX-License-Identifier: MIT
// Takes a point in the camera to its pixel, with the rows of the Jacobian there and their gradients. The camera is a
// pinhole unless OFF_CENTRE and LENS of effects/constants.glsl say more. Needs covariance.glsl.

#include "shared/lens.h"
#include "effects/lens.glsl"

vec2 principal_point(CameraData camera) {
    return OFF_CENTRE == 1 ? camera.principal : 0.5 * vec2(camera.width, camera.height);
}

// (x/z, y/z) as the Jacobian sees them: limited to the image and a margin around it. Without the limit a splat beside
// the camera that is large against its depth would fan out over the picture. The limit costs nothing where there is no
// such splat.
vec2 clamped_ratio(CameraData camera, vec2 ratio) {
    if (NEAR_CARE == 0) return ratio;
    return clamp(ratio, OFF_CENTRE == 1 ? camera.ratio_min : -camera.ratio_max, camera.ratio_max);
}

// A camera without lens terms is a pinhole, by the same arithmetic whether lenses are compiled in or not.
bool distorts(CameraData camera) { return LENS == 1 && camera.lens_fold < LENS_FOLD_NONE; }

// Returns false where no pixel sees the point.
bool pixel_of(CameraData camera, vec3 p, out vec2 pixel) {
    if (distorts(camera)) {
        const LensPoint at = lens_point(camera, p.xy / p.z);
        pixel = camera.focal * at.value + principal_point(camera);
        return lens_sees(camera, at);
    }
    pixel = camera.focal * (p.xy / p.z) + principal_point(camera);
    return true;
}

// Rows j0, j1 of the projection's Jacobian at p, in camera space.
void jacobian_rows(CameraData camera, vec3 p, out vec3 j0, out vec3 j1) {
    const vec2 ratio = clamped_ratio(camera, p.xy / p.z);
    j0 = vec3(camera.focal.x / p.z, 0.0, -camera.focal.x * ratio.x / p.z);
    j1 = vec3(0.0, camera.focal.y / p.z, -camera.focal.y * ratio.y / p.z);
    if (distorts(camera)) {
        const mat2 d = lens_jacobian(lens_point(camera, ratio));
        const vec3 k0 = vec3(1.0, 0.0, -ratio.x) / p.z, k1 = vec3(0.0, 1.0, -ratio.y) / p.z;
        j0 = camera.focal.x * (d[0][0] * k0 + d[1][0] * k1);
        j1 = camera.focal.y * (d[0][1] * k0 + d[1][1] * k1);
    }
}

// The share of one row of the pinhole's Jacobian, (f/z, ., -f ratio/z), in dL/d(coordinate) and dL/dz. d: gradients of
// the row's first and last entry.
vec2 jacobian_row_gradient(float focal, float coordinate, float z, float ratio, vec2 limits, vec2 d) {
    const float inverse = 1.0 / z;
    float d_z = focal * inverse * inverse * (ratio * d.y - d.x);
    float d_coordinate = 0.0;
    const float free_ratio = coordinate * inverse;
    if (NEAR_CARE == 0 || (free_ratio > limits.x && free_ratio < limits.y)) {
        const float d_ratio = -focal * inverse * d.y;
        d_coordinate = d_ratio * inverse;
        d_z -= d_ratio * free_ratio * inverse;
    }
    return vec2(d_coordinate, d_z);
}

vec3 lens_point_gradient(CameraData camera, vec3 p, vec3 d_j0, vec3 d_j1, vec2 d_pixel) {
    const float inverse = 1.0 / p.z;
    const vec2 free = p.xy * inverse, ratio = clamped_ratio(camera, free);
    const vec2 f = camera.focal * inverse;
    const LensPoint at = lens_point(camera, ratio);
    const mat2 d = lens_jacobian(at);
    const mat2 C = mat2(f.x * (d_j0.x - ratio.x * d_j0.z), f.y * (d_j1.x - ratio.x * d_j1.z),
                        f.x * (d_j0.y - ratio.y * d_j0.z), f.y * (d_j1.y - ratio.y * d_j1.z));
    const vec2 d_row = -f * vec2(d_j0.z, d_j1.z);
    vec2 d_ratio = d_row * d + lens_second(camera, ratio, at, C);
    if (NEAR_CARE == 1) d_ratio = mix(vec2(0.0), d_ratio, equal(ratio, free));
    // The Jacobian as a whole scales with 1/z.
    const float along = C[0][0] * d[0][0] + C[0][1] * d[0][1] + C[1][0] * d[1][0] + C[1][1] * d[1][1];
    const vec2 d_free = (camera.focal * d_pixel) * lens_jacobian(lens_point(camera, free)) + d_ratio;
    return vec3(d_free * inverse, -(dot(d_free, free) + along) * inverse);
}

// dL/dp from the gradients of the Jacobian's rows and of the pixel.
vec3 camera_point_gradient(CameraData camera, vec3 p, vec3 d_j0, vec3 d_j1, vec2 d_pixel) {
    if (distorts(camera)) return lens_point_gradient(camera, p, d_j0, d_j1, d_pixel);
    const vec2 ratio = clamped_ratio(camera, p.xy / p.z);
    const vec2 low = OFF_CENTRE == 1 ? camera.ratio_min : -camera.ratio_max;
    const vec2 from_x = jacobian_row_gradient(camera.focal.x, p.x, p.z, ratio.x,
                                              vec2(low.x, camera.ratio_max.x), d_j0.xz);
    const vec2 from_y = jacobian_row_gradient(camera.focal.y, p.y, p.z, ratio.y,
                                              vec2(low.y, camera.ratio_max.y), d_j1.yz);
    const vec2 m = d_pixel * camera.focal / p.z;
    return vec3(from_x.x + m.x, from_y.x + m.y, from_x.y + from_y.y - dot(m, p.xy) / p.z);
}
