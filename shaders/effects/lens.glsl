// SPDX-License-Identifier: MIT
// Lens distortion in the projection: the models of engine/data/lens_model.h on the plane z = 1, their Jacobian and the
// gradient through it. A lens begins with a front, u a(|u|^2) with a = atan(c r) / (w r) (fisheye, FOV; none where w =
// 0). It is followed by v = w g(|w|^2), where g is a quotient of polynomials, and v + tangential + thin prism, which are
// polynomials of w or, where `after` is set, of v. Matrices: m[column][row].

// a, a' and a'' of the front as functions of the squared radius.
vec3 lens_front(CameraData camera, float square) {
    const float c = camera.lens_front.x, w = camera.lens_front.y;
    if (w == 0.0) return vec3(1.0, 0.0, 0.0);
    if (w < 0.0) {  // EUCM and the division models: 1 / (alpha sqrt(1 + beta s) + 1 - alpha)
        const float q = sqrt(max(1.0 + c * square, 1e-6)), a = 1.0 / (1.0 - w * (q - 1.0));
        const float d1 = -0.5 * w * c / q, d2 = 0.25 * w * c * c / (q * q * q);
        return vec3(a, -d1 * a * a, (2.0 * d1 * d1 * a - d2) * a * a);
    }
    const float t = c * c * square;  // below: atan(y) / y with t = y^2, and its derivatives by t
    vec3 phi = vec3(0.0);
    if (t < 0.15) {
        for (int k = 12; k >= 0; --k) {  // the series sum (-t)^k / (2 k + 1), by Horner with derivatives
            phi.z = phi.z * t + phi.y;
            phi.y = phi.y * t + phi.x;
            phi.x = phi.x * t + ((k & 1) == 0 ? 1.0 : -1.0) / float(2 * k + 1);
        }
        phi.z *= 2.0;
    } else {
        const float y = sqrt(t), inverse = 1.0 / (1.0 + t);
        phi.x = atan(y) / y;
        phi.y = (inverse - phi.x) / (2.0 * t);
        phi.z = -(3.0 * phi.y + inverse * inverse) / (2.0 * t);
    }
    return c / w * phi * vec3(1.0, c * c, c * c * c * c);
}

// g, g' and g'' of the plane's radial factor.
vec3 lens_radial(CameraData camera, float s) {
    const vec4 k = camera.lens_radial;
    const vec2 h = camera.lens_radial_high;
    const vec3 d = camera.lens_rational;
    const float b = 1.0 + s * (d.x + s * (d.y + s * d.z));
    const float b1 = d.x + s * (2.0 * d.y + s * 3.0 * d.z), b2 = 2.0 * d.y + s * 6.0 * d.z;
    const float g = (1.0 + s * (k.x + s * (k.y + s * (k.z + s * (k.w + s * (h.x + s * h.y)))))) / b;
    const float t1 = k.x + s * (2.0 * k.y + s * (3.0 * k.z + s * (4.0 * k.w + s * (5.0 * h.x + s * 6.0 * h.y))));
    const float t2 = 2.0 * k.y + s * (6.0 * k.z + s * (12.0 * k.w + s * (20.0 * h.x + s * 30.0 * h.y)));
    const float g1 = (t1 - g * b1) / b;
    return vec3(g, g1, (t2 - 2.0 * g1 * b1 - g * b2) / b);
}

mat2 radial_jacobian(vec2 v, vec3 g) { return mat2(g.x) + 2.0 * g.y * outerProduct(v, v); }

// The sum over i, j of C[j][i] d^2(v_i g) / (dv_j dv_k), for each k.
vec2 radial_second(vec2 v, vec3 g, mat2 C) {
    const vec2 along = C * v;
    return 2.0 * g.y * ((C[0][0] + C[1][1]) * v + along + v * C) + 4.0 * g.z * dot(v, along) * v;
}

struct LensPoint {
    vec2 w;      // after the front
    vec2 bent;   // where tangential and prism are taken: w, or that times the radial factor
    vec2 value;  // the distorted ray
    vec3 front, radial;
    mat2 front_jacobian, radial_part, bent_part, plane_jacobian;
};

// Adds the tangential and prism terms at v.
vec2 bent_by(CameraData camera, vec2 v, vec2 to) {
    const vec2 p = camera.lens_tangential;
    const float s = dot(v, v);
    return to + 2.0 * v.x * v.y * p + (s + 2.0 * v * v) * p.yx + s * (camera.lens_prism + s * camera.lens_prism_high);
}
// The Jacobian of what bent_by adds.
mat2 bend_jacobian(CameraData camera, vec2 v) {
    const vec2 p = camera.lens_tangential, prism = camera.lens_prism + 2.0 * dot(v, v) * camera.lens_prism_high;
    return mat2(vec2(2.0 * p.x * v.y + 6.0 * p.y * v.x, 2.0 * p.y * v.y + 2.0 * p.x * v.x) + 2.0 * v.x * prism,
                vec2(2.0 * p.x * v.x + 2.0 * p.y * v.y, 2.0 * p.y * v.x + 6.0 * p.x * v.y) + 2.0 * v.y * prism);
}
// The sum over i, j of C[j][i] d^2(bent_by_i) / (dv_j dv_k), for each k.
vec2 bend_second(CameraData camera, vec2 v, mat2 C) {
    const vec2 p = camera.lens_tangential, prism = camera.lens_prism + 2.0 * dot(v, v) * camera.lens_prism_high;
    const float trace_x = C[0][0], cross_x = C[1][0], trace_y = C[1][1], cross_y = C[0][1];
    const vec2 high = 8.0 * dot(camera.lens_prism_high, C * v) * v;
    return high + vec2(trace_x * (6.0 * p.y + 2.0 * prism.x) + cross_x * 2.0 * p.x +
                           cross_y * (2.0 * p.x + 2.0 * prism.y) + trace_y * 2.0 * p.y,
                       trace_x * 2.0 * p.x + cross_x * (2.0 * p.y + 2.0 * prism.x) + cross_y * 2.0 * p.y +
                           trace_y * (6.0 * p.x + 2.0 * prism.y));
}

LensPoint lens_point(CameraData camera, vec2 ray) {
    LensPoint at;
    at.front = lens_front(camera, dot(ray, ray));
    at.w = ray * at.front.x;
    at.front_jacobian = radial_jacobian(ray, at.front);
    at.radial = lens_radial(camera, dot(at.w, at.w));
    const vec2 scaled = at.w * at.radial.x;
    const bool after = camera.lens_after == 1u;
    at.bent = after ? scaled : at.w;
    at.value = bent_by(camera, at.bent, scaled);
    at.radial_part = radial_jacobian(at.w, at.radial);
    at.bent_part = bend_jacobian(camera, at.bent);
    at.plane_jacobian = at.radial_part + (after ? at.bent_part * at.radial_part : at.bent_part);
    return at;
}

// Beyond the fold the distortion is no longer one to one, and such rays reach no pixel.
bool lens_sees(CameraData camera, LensPoint at) { return dot(at.w, at.w) <= camera.lens_fold * camera.lens_fold; }

mat2 lens_jacobian(LensPoint at) { return at.plane_jacobian * at.front_jacobian; }

// dL/d(ray) from C = dL/d(lens_jacobian).
vec2 lens_second(CameraData camera, vec2 ray, LensPoint at, mat2 C) {
    const mat2 d_plane = C * at.front_jacobian;  // as the radial part's, the front's Jacobian is symmetric
    const mat2 d_front = transpose(at.plane_jacobian) * C;
    const bool after = camera.lens_after == 1u;
    const mat2 d_radial = after ? d_plane + transpose(at.bent_part) * d_plane : d_plane;
    const vec2 d_bent = bend_second(camera, at.bent, after ? d_plane * at.radial_part : d_plane);
    const vec2 d_w = radial_second(at.w, at.radial, d_radial) + (after ? at.radial_part * d_bent : d_bent);
    return d_w * at.front_jacobian + radial_second(ray, at.front, d_front);
}
