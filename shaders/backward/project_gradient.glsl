// SPDX-License-Identifier: MIT
// Takes the summed partials of one splat to the gradients of its parameters: the exact derivative of project.comp.
// Source: docs/math.md, Gradients. Needs camera data, covariance.glsl, rest.glsl and the parameter buffers.

struct SplatGradient {
    vec3 position, log_scale;  // with LINEAR_VALUES those of the scale and, below, of the opacity
    vec4 rotation;
    float opacity_logit, shape;
    vec3 colour;  // gradient of the SH sum before it is clamped
    vec3 direction;  // unit, camera to splat; the SH basis is evaluated there
    vec2 mean;            // px
};

struct Partial {
    vec4 a;               // sums over pixels of G x, G x x, G x dy, G dy; G = opacity dL/dalpha dw/dq
    float b;              // G dy dy
    float d_opacity, d_exponent, d_depth;  // d_depth: 0 without DEPTH_SUM
    vec3 d_colour;
};

// The rows of N = L M, with the factor L = [[l11, l21], [0, l22]] and M with the rows r1 and r2. As (x, y) = L d, a
// change of M moves q by -2 (x, y) L dM N^T (x, y)^T. Entries are at most 1 whatever the splat's shape. The form l11 r1
// + l21 r2 cancels on needles; the equal r2 x (r1 x r2) = |r2|^2 r1 - (r1 r2) r2 does not. l11 / c of the shrunk rows
// is 1 / sqrt(c determinant).
void whitened_rows(Factor f, vec3 r1, vec3 r2, out vec3 n1, out vec3 n2) {
    r1 *= f.shrink;
    r2 *= f.shrink;
    const float h = args.low_pass * f.shrink * f.shrink, l22 = inversesqrt(dot(r2, r2) + h);
    n1 = (cross(r2, cross(r1, r2)) + h * r1) * l22 * inversesqrt(f.determinant);
    n2 = l22 * r2;
}

// dL/d(r1) and dL/d(r2), the rows of M; dL/d(log scale), which is d_r1 r1 + d_r2 r2 without its cancellation; dL/dmean.
// peak: the opacity before compensation(), whose share is added with ANTIALIAS.
void factor_gradient(Factor f, Partial p, vec3 r1, vec3 r2, float peak, out vec3 d_r1, out vec3 d_r2,
                     out vec3 d_log_scale, out vec2 d_mean) {
    d_mean = 2.0 * vec2(f.l11 * p.a.x, f.l21 * p.a.x + f.l22 * f.l22 * p.a.w);
    vec3 n1, n2;
    whitened_rows(f, r1, r2, n1, n2);
    const float xx = p.a.y, xy = f.l22 * p.a.z, yy = f.l22 * f.l22 * p.b;  // sums of G (x, y)^T (x, y)
    vec3 p1 = -2.0 * (xx * n1 + xy * n2), p2 = -2.0 * (xy * n1 + yy * n2);
    if (ANTIALIAS == 1)
        add_compensation_gradient(f, r1, r2, args.low_pass, p.d_opacity * peak, p1, p2);
    d_log_scale = p1 * n1 + p2 * n2;
    d_r1 = f.l11 * p1;
    d_r2 = f.l21 * p1 + f.l22 * p2;
}

// dL/dq of a unit quaternion, from dL/d(columns of its matrix).
vec4 quaternion_gradient(vec4 q, mat3 d) {
    const float w = q.x, x = q.y, y = q.z, z = q.w;
    return 2.0 *
           vec4(x * (d[1][2] - d[2][1]) + y * (d[2][0] - d[0][2]) + z * (d[0][1] - d[1][0]),
                y * (d[1][0] + d[0][1]) + z * (d[2][0] + d[0][2]) + w * (d[1][2] - d[2][1]) -
                    2.0 * x * (d[1][1] + d[2][2]),
                x * (d[1][0] + d[0][1]) + z * (d[2][1] + d[1][2]) + w * (d[2][0] - d[0][2]) -
                    2.0 * y * (d[0][0] + d[2][2]),
                x * (d[2][0] + d[0][2]) + y * (d[2][1] + d[1][2]) + w * (d[0][1] - d[1][0]) -
                    2.0 * z * (d[0][0] + d[1][1]));
}

vec3 outside_is_zero(vec3 gradient, vec3 value, float limit) {
    return mix(vec3(0.0), gradient, lessThanEqual(abs(value), vec3(limit)));
}

SplatGradient project_gradient(CameraData camera, uint i, Partial sums) {
    SplatGradient g;
    const vec3 centre_rest = camera.centre_rest;
    float time = 0.0;
    if (SHUTTER == 1) time = take_row(camera, position[i]);
    const vec3 to_splat = from_centre(camera, position[i]);
    const vec3 p = to_camera(camera, to_splat);
    const vec3 raw_scale = log_scale[i];
    vec3 s = scale_of(raw_scale), share = vec3(1.0);
    const vec3 scale = s;
    float kept = 1.0;  // share of the opacity that the filters leave
    if (SMOOTHING == 1) kept = smooth_scale(s, smoothing[i], share);
    float exponent = 0.0, by_shape = 0.0;
    if (SHAPED) exponent = shape_exponent(shape[i], by_shape);
    s *= sqrt(kernel_covariance_scale(exponent));
    vec4 unit;
    float norm;
    normalise_rotation(rotation[i], unit, norm);
    vec3 j0, j1;
    jacobian_rows(camera, p, j0, j1);
    const mat2x3 k = mat2x3(j0, j1);
    ShutterMotion motion;
    if (SHUTTER == 1) {
        motion = shutter_motion(camera, time, p, j0, j1);
        add_shutter(motion, j0, j1);
    }
    const mat3 axes = rotation_matrix(unit);
    const vec3 t0 = to_world(camera, j0), t1 = to_world(camera, j1);
    vec3 r1 = (t0 * axes) * s, r2 = (t1 * axes) * s;
    SigmaPoints points;
    if (PROJECTION != PROJECTION_JACOBIAN) {
        const vec2 shear = SHUTTER == 1 ? motion.per_row * motion.pixel : vec2(0.0);
        points = sigma_points(camera, p, axes, s, k, shear);
        if (points.used) {
            r1 = points.r1;
            r2 = points.r2;
        }
    }
    vec3 d_r1, d_r2, d_log_scale;
    const float logit = opacity_logit[i];
    const float o = LINEAR_VALUES == 1 ? logit : 1.0 / (1.0 + exp(-logit)), rest = 1.0 / (1.0 + exp(logit));
    const Factor f = cholesky_factor(r1, r2, args.low_pass);
    factor_gradient(f, sums, r1, r2, o * kept, d_r1, d_r2, d_log_scale, g.mean);
    SigmaGradient by_sigma = no_sigma_gradient();
    if (PROJECTION != PROJECTION_JACOBIAN && points.used) {  // nothing of the shape goes through the Jacobian
        by_sigma = sigma_gradient(camera, p, points, d_r1, d_r2, g.mean);
        d_log_scale = by_sigma.d_log_scale;
        d_r1 = d_r2 = vec3(0.0);
    }
    g.shape = 0.0;
    if (SHAPED) g.shape = by_shape * (sums.d_exponent + shaped_length_slope(exponent) *
                                      (d_log_scale.x + d_log_scale.y + d_log_scale.z));
    if (ANTIALIAS == 1) kept *= compensation(r1, r2, f);
    if (SMOOTHING == 1)
        d_log_scale = d_log_scale * share + sums.d_opacity * o * kept * (1.0 - share);

    if (LINEAR_VALUES == 1)
        g.log_scale = mix(vec3(0.0), d_log_scale / scale, equal(scale, raw_scale));
    else
        g.log_scale = outside_is_zero(d_log_scale, raw_scale, LOG_SCALE_LIMIT);
    const vec3 e1 = d_r1 * s, e2 = d_r2 * s;
    mat3 d_axes = mat3(e1.x * t0 + e2.x * t1, e1.y * t0 + e2.y * t1, e1.z * t0 + e2.z * t1);
    if (PROJECTION != PROJECTION_JACOBIAN)
        for (int c = 0; c < 3; ++c) d_axes[c] += to_world(camera, by_sigma.d_axes[c]) * s[c];
    const vec4 d_unit = quaternion_gradient(unit, d_axes);
    g.rotation = (d_unit - unit * dot(unit, d_unit)) / norm;

    const vec3 d_j0 = to_camera(camera, axes * e1), d_j1 = to_camera(camera, axes * e2);
    ShutterGradient by_shutter;
    vec3 d_p = SHUTTER == 1 ? shutter_point_gradient(camera, motion, p, k, mat2x3(j0, j1), mat2x3(d_j0, d_j1), g.mean,
                                                     by_sigma.d_shear, by_shutter)
                            : camera_point_gradient(camera, p, d_j0, d_j1, g.mean);
    if (PROJECTION != PROJECTION_JACOBIAN) d_p += by_sigma.d_p;
    if (DEPTH_SUM == 1) d_p.z += sums.d_depth;
    const mat3 long_axes = mat3(axes[0] * s.x, axes[1] * s.y, axes[2] * s.z);
    if (CAMERA_GRADIENT == 1 && SHUTTER == 0) {
        store_camera_gradient(camera, i, p, to_splat, d_p, mat2x3(j0, j1), mat2x3(axes * e1, axes * e2),
                              mat2x3(d_j0, d_j1), g.mean);
        if (PROJECTION != PROJECTION_JACOBIAN) add_sigma_camera_gradient(i, long_axes, by_sigma);
    }
    g.position = to_world(camera, d_p);
    if (LINEAR_VALUES == 1)
        g.opacity_logit = sums.d_opacity * kept;
    else
        g.opacity_logit = abs(logit) <= OPACITY_LOGIT_LIMIT ? sums.d_opacity * kept * o * rest : 0.0;

    const float range = length(to_splat);
    g.direction = to_splat / range;
    vec3 colour = first_band(sh_dc[i]);
    float basis[SH_REST_MAX], along[SH_REST_MAX];
    vec3 coefficient[SH_REST_MAX];
    sh_basis(g.direction, basis);
    for (int t = 0; t < FOURS; ++t) {
        vec3 four[4];
        load_four(i - args.first_splat, t, four);
        for (int k = 0; k < 4; ++k)
            if (4 * t + k < SH_USED) coefficient[4 * t + k] = four[k];
    }
    for (int k = 0; k < SH_USED; ++k) colour += basis[k] * coefficient[k];
    vec3 d_view = vec3(0.0);  // dL/d(position) through the direction
    g.colour = sums.d_colour;
    if (DIRECT_COLOUR == 0) g.colour = mix(g.colour, vec3(0.0), lessThan(colour, vec3(0.0)));
    if (SH_DEGREE > 0) {
        for (int k = 0; k < SH_USED; ++k) along[k] = dot(g.colour, coefficient[k]);
        const vec3 d = sh_direction_gradient(g.direction, along);
        d_view = (d - g.direction * dot(g.direction, d)) / range;
        g.position += d_view;
    }
    if (SHUTTER == 1) {  // the time of the row moves with the splat
        if (PROJECTION != PROJECTION_JACOBIAN && points.used)
            for (int c = 0; c < 3; ++c)
                by_shutter.d_time += dot(by_sigma.d_axes[c], cross(camera.shutter_turn, points.axes[c]));
        const float d_time = by_shutter.d_time + dot(d_p, motion.velocity) -
                             dot(d_view, to_world(camera, motion.swing));
        const float by_row = d_time * motion.per_row;
        g.position += to_world(camera, by_row * k[1]);
        d_p += by_row * k[1];
        if (CAMERA_GRADIENT == 1) {
            const vec2 shear = motion.per_row * motion.pixel;
            const mat2x3 d_t = mat2x3(axes * e1, axes * (e2 + shear.x * e1 + shear.y * e2));
            vec3 twist = cross(p, d_p) + cross(d_j0, j0) + cross(d_j1, j1);
            if (PROJECTION != PROJECTION_JACOBIAN && points.used)
                for (int c = 0; c < 3; ++c) twist += cross(points.axes[c], by_sigma.d_axes[c]);
            store_shutter_gradient(camera, i, time, p, d_p, twist, d_view, motion, by_shutter);
            camera.centre_rest = centre_rest;
            store_camera_gradient(camera, i, p, from_centre(camera, position[i]), d_p, k, d_t, by_shutter.d_k,
                                  g.mean + vec2(0.0, by_row));
            if (PROJECTION != PROJECTION_JACOBIAN) add_sigma_camera_gradient(i, long_axes, by_sigma);
            turn_back_camera_gradient(camera, i, time, d_view);
        }
    }
    return g;
}
