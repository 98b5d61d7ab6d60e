// SPDX-License-Identifier: MIT
// The unscented projection: six points of a splat, sqrt(3) standard deviations from its centre along its axes, each
// through the camera. The footprint has their mean and covariance. With offsets o+ and o- of the two points of axis k
// from the centre's pixel,
//   d = (o+ - o-) / (2 sqrt 3),  m = (o+ + o-) / 2,  mean = sum m / 3,  S = sum d d^T + sum (m - mean) (m - mean)^T / 3
// S = X X^T with X of two rows and six columns, which a rotation of its columns makes triangular. Its three columns then
// take the place of the rows M of covariance.glsl, and nothing cancels on needles. Source: 3DGUT (Wu et al. 2024);
// docs/math.md, Sigma points. Needs covariance.glsl, camera_model.glsl and shared/accuracy_list.h.

const float SIGMA_REACH = 1.7320508;  // standard deviations

struct SigmaRow {
    vec3 along, beside;  // d, and (m - mean) / sqrt 3, of the three axes
};

struct SigmaPoints {
    bool used;        // false: the splat is left to the Jacobian
    mat3 axes;        // columns: one standard deviation each, in the camera
    vec2 offset[6];   // px from the centre's pixel: of axis k in 2 k and 2 k + 1
    vec2 shear;       // that a shutter adds to an offset, by its y
    vec2 shift;       // px, from the centre's pixel to the mean
    SigmaRow q1, q2;  // the rotation: x = r1.x q1, y = r2.x q1 + r2.y q2
    vec3 r1, r2, r3;  // the triangular rows of x, y and depth
};

float dot_rows(SigmaRow a, SigmaRow b) { return dot(a.along, b.along) + dot(a.beside, b.beside); }
SigmaRow add_rows(float s, SigmaRow a, float t, SigmaRow b) {
    return SigmaRow(s * a.along + t * b.along, s * a.beside + t * b.beside);
}
float inverse_or_zero(float length_of) { return length_of > 0.0 ? 1.0 / length_of : 0.0; }

// The pixel of p + a less that of p. False where the point is too near, or beyond the lens's fold.
bool offset_of(CameraData camera, vec3 p, vec3 a, vec2 centre, out vec2 offset) {
    const float z = p.z + a.z;
    const vec2 ratio = p.xy / p.z, by = (a.xy - ratio * a.z) / z;
    offset = camera.focal * by;
    if (!(z > SIGMA_NEAREST * p.z)) return false;
    if (!distorts(camera)) return true;
    const LensPoint at = lens_point(camera, ratio + by);
    offset = camera.focal * (at.value - centre);
    return lens_sees(camera, at);
}

// Whether the Jacobian, of rows j, changes by more than PROJECTION_SHARE along the longest axis, away from the camera.
bool jacobian_changes(CameraData camera, vec3 p, mat3 axes, mat2x3 j) {
    vec3 longest = axes[0];
    for (int k = 1; k < 3; ++k)
        if (dot(axes[k], axes[k]) > dot(longest, longest)) longest = axes[k];
    vec3 j0, j1;
    jacobian_rows(camera, longest.z < 0.0 ? p - longest : p + longest, j0, j1);
    j0 -= j[0];
    j1 -= j[1];
    return dot(j0, j0) + dot(j1, j1) > PROJECTION_SHARE * PROJECTION_SHARE * (dot(j[0], j[0]) + dot(j[1], j[1]));
}

void set_sigma_rows(inout SigmaPoints s) {
    SigmaRow x, y;
    for (int k = 0; k < 3; ++k) {
        const vec2 more = s.offset[2 * k] + s.shear * s.offset[2 * k].y;
        const vec2 less = s.offset[2 * k + 1] + s.shear * s.offset[2 * k + 1].y;
        const vec2 d = (more - less) / (2.0 * SIGMA_REACH), m = 0.5 * (more + less);
        x.along[k] = d.x;
        y.along[k] = d.y;
        x.beside[k] = m.x;
        y.beside[k] = m.y;
    }
    const vec3 third = vec3(1.0 / 3.0);
    s.shift = vec2(dot(x.beside, third), dot(y.beside, third));
    x.beside = (x.beside - s.shift.x) / SIGMA_REACH;
    y.beside = (y.beside - s.shift.y) / SIGMA_REACH;
    const SigmaRow z = SigmaRow(vec3(s.axes[0].z, s.axes[1].z, s.axes[2].z), vec3(0.0));
    s.r1 = vec3(sqrt(dot_rows(x, x)), 0.0, 0.0);
    s.q1 = add_rows(inverse_or_zero(s.r1.x), x, 0.0, x);
    const float yx = dot_rows(y, s.q1);
    SigmaRow rest = add_rows(1.0, y, -yx, s.q1);
    rest = add_rows(1.0, rest, -dot_rows(rest, s.q1), s.q1);  // once more, for needles
    s.r2 = vec3(yx, sqrt(dot_rows(rest, rest)), 0.0);
    s.q2 = add_rows(inverse_or_zero(s.r2.y), rest, 0.0, rest);
    const vec2 zxy = vec2(dot_rows(z, s.q1), dot_rows(z, s.q2));
    const SigmaRow deep = add_rows(1.0, add_rows(1.0, z, -zxy.x, s.q1), -zxy.y, s.q2);
    s.r3 = vec3(zxy, sqrt(dot_rows(deep, deep)));
}

// axes: the splat's, in the world; s: its standard deviations; j: rows of the Jacobian at p, at one moment.
SigmaPoints sigma_points(CameraData camera, vec3 p, mat3 axes, vec3 s, mat2x3 j, vec2 shear) {
    SigmaPoints points;
    points.used = false;
    const vec2 ratio = p.xy / p.z;
    if (clamped_ratio(camera, ratio) != ratio) return points;
    for (int k = 0; k < 3; ++k) points.axes[k] = to_camera(camera, axes[k]) * s[k];
    if (PROJECTION == PROJECTION_AUTO && !jacobian_changes(camera, p, points.axes, j)) return points;
    vec2 centre = vec2(0.0);
    if (distorts(camera)) centre = lens_point(camera, ratio).value;
    for (int i = 0; i < 6; ++i) {
        const float reach = (i & 1) == 0 ? SIGMA_REACH : -SIGMA_REACH;
        if (!offset_of(camera, p, reach * points.axes[i / 2], centre, points.offset[i])) return points;
    }
    points.shear = shear;
    set_sigma_rows(points);
    points.used = is_finite(points.r1.x + points.r2.y);
    return points;
}

struct SigmaGradient {
    vec3 d_p;            // of the centre in the camera, at held axes
    mat3 d_axes;         // as SigmaPoints.axes
    vec3 d_log_scale;
    vec2 d_shear, d_focal;
};

SigmaGradient no_sigma_gradient() {
    return SigmaGradient(vec3(0.0), mat3(0.0), vec3(0.0), vec2(0.0), vec2(0.0));
}

// dL/dp of a point from dL/d(its pixel).
vec3 pixel_gradient(CameraData camera, vec3 p, vec2 d_pixel) {
    const vec2 ray = p.xy / p.z;
    vec2 d = camera.focal * d_pixel;
    if (distorts(camera)) d = d * lens_jacobian(lens_point(camera, ray));
    return vec3(d, -dot(d, ray)) / p.z;
}

// d_r1, d_r2: dL/d(rows); d_mean: dL/d(mean), px.
SigmaGradient sigma_gradient(CameraData camera, vec3 p, SigmaPoints s, vec3 d_r1, vec3 d_r2, vec2 d_mean) {
    SigmaGradient g = no_sigma_gradient();
    const SigmaRow x = add_rows(d_r1.x, s.q1, d_r1.y, s.q2), y = add_rows(d_r2.x, s.q1, d_r2.y, s.q2);
    const vec2 middle = vec2(x.beside.x + x.beside.y + x.beside.z, y.beside.x + y.beside.y + y.beside.z) / 3.0;
    for (int k = 0; k < 3; ++k) {
        const vec2 d_m = (vec2(x.beside[k], y.beside[k]) - middle) / SIGMA_REACH + d_mean / 3.0;
        const vec2 d_d = vec2(x.along[k], y.along[k]) / SIGMA_REACH;
        for (int side = 0; side < 2; ++side) {
            const vec2 o = s.offset[2 * k + side], d_y = 0.5 * (side == 0 ? d_m + d_d : d_m - d_d);
            const vec2 d = vec2(d_y.x, d_y.y + dot(s.shear, d_y));
            const float reach = side == 0 ? SIGMA_REACH : -SIGMA_REACH;
            const vec3 d_point = pixel_gradient(camera, p + reach * s.axes[k], d);
            g.d_shear += d_y * o.y;
            g.d_focal += d * o / camera.focal;
            g.d_p += d_point - pixel_gradient(camera, p, d);
            g.d_axes[k] += reach * d_point;
        }
        g.d_log_scale[k] = dot(g.d_axes[k], s.axes[k]);
    }
    return g;
}
