// SPDX-License-Identifier: MIT
#include "engine/reference/reference_lens.h"

#include <algorithm>
#include <cmath>

namespace darb::reference {
namespace {

/// A factor of the squared radius with its first two derivatives.
template <class T>
struct Radial {
    T value = 1, first = 0, second = 0;
};

/// atan(y) / y as a function of t = y^2.
template <class T>
Radial<T> atan_over(T t) {
    constexpr int kTerms = 40;  // t^40 is below 1e-24
    Radial<T> a{0, 0, 0};
    if (t < T(0.25)) {
        for (int k = kTerms; k >= 0; --k) {
            const T b = T(k % 2 == 0 ? 1 : -1) / T(2 * k + 1);
            a.second = a.second * t + 2 * a.first;
            a.first = a.first * t + a.value;
            a.value = a.value * t + b;
        }
        return a;
    }
    const T y = std::sqrt(t), inverse = 1 / (1 + t);
    a.value = std::atan(y) / y;
    a.first = (inverse - a.value) / (2 * t);
    a.second = -(3 * a.first + inverse * inverse) / (2 * t);
    return a;
}

template <class T>
Radial<T> front_factor(const LensTerms& lens, T square) {
    if (lens.front_scale == 0) return {};
    if (lens.front_scale < 0) {  // a = 1 / (alpha q + 1 - alpha), q = sqrt(1 + beta s)
        const T alpha = T(-lens.front_scale), beta = T(lens.front_tan);
        const T q = std::sqrt(std::max(1 + beta * square, T(1e-6)));
        const T bottom = alpha * q + 1 - alpha;
        const T first = alpha * beta / (2 * q), second = -alpha * beta * beta / (4 * q * q * q);
        Radial<T> a;
        a.value = 1 / bottom;
        a.first = -first / (bottom * bottom);
        a.second = (2 * first * first / bottom - second) / (bottom * bottom);
        return a;
    }
    const T c2 = T(lens.front_tan * lens.front_tan);
    const T scale = T(lens.front_tan / lens.front_scale);
    const Radial<T> a = atan_over(c2 * square);
    return {scale * a.value, scale * c2 * a.first, scale * c2 * c2 * a.second};
}

/// Value and derivatives of 1 + c0 s + c1 s^2 + ...
template <class T, size_t N>
Radial<T> polynomial(const std::array<double, N>& c, T s) {
    Radial<T> p{0, 0, 0};
    for (size_t i = N + 1; i-- > 0;) {
        p.second = p.second * s + 2 * p.first;
        p.first = p.first * s + p.value;
        p.value = p.value * s + (i == 0 ? T(1) : T(c[i - 1]));
    }
    return p;
}

template <class T>
Radial<T> plane_factor(const LensTerms& lens, T s) {
    const Radial<T> top = polynomial(lens.k, s), bottom = polynomial(lens.d, s);
    Radial<T> g;
    g.value = top.value / bottom.value;
    g.first = (top.first - g.value * bottom.first) / bottom.value;
    g.second = (top.second - 2 * g.first * bottom.first - g.value * bottom.second) / bottom.value;
    return g;
}

template <class T>
Mat2<T> radial_jacobian(const Vec2<T>& v, const Radial<T>& g) {
    return Mat2<T>(g.value) + 2 * g.first * glm::outerProduct(v, v);
}

/// sum over i, j of c_ij d^2 (v_i g) / (dv_j dv_k), c_ij = c[j][i].
template <class T>
Vec2<T> radial_second(const Vec2<T>& v, const Radial<T>& g, const Mat2<T>& c) {
    Vec2<T> d(0);
    for (int k = 0; k < 2; ++k)
        for (int i = 0; i < 2; ++i)
            for (int j = 0; j < 2; ++j) {
                const T first =
                    (i == j ? v[k] : T(0)) + (i == k ? v[j] : T(0)) + (j == k ? v[i] : T(0));
                d[k] += c[j][i] * (2 * g.first * first + 4 * g.second * v[i] * v[j] * v[k]);
            }
    return d;
}

/// d^2 value_i / (dw_j dw_k) of the tangential and prism terms that are quadratic.
template <class T>
T quadratic_second(const LensTerms& lens, int i, int j, int k) {
    const T p0 = T(lens.tangential.x), p1 = T(lens.tangential.y);
    const T prism = T(i == 0 ? lens.prism.x : lens.prism.y);
    if (j != k) return i == 0 ? 2 * p0 : 2 * p1;
    const T own = i == 0 ? p1 : p0;  // coefficient of 3 w_i^2 + w_other^2
    return (i == j ? 6 * own : 2 * own) + 2 * prism;
}

/// The tangential and prism terms at v, with d value_i / dv_j as [j][i]: the quadratic ones, and
/// prism_high |v|^4.
template <class T>
struct Bend {
    Vec2<T> value{0};
    Mat2<T> jacobian{0};
};
template <class T>
Bend<T> bend(const LensTerms& lens, const Vec2<T>& v) {
    const T square = glm::dot(v, v);
    const Vec2<T> high(lens.prism_high);
    Bend<T> out{square * square * high, glm::outerProduct(high, 4 * square * v)};
    for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j)
            for (int k = 0; k < 2; ++k) {
                const T second = quadratic_second<T>(lens, i, j, k);
                out.value[i] += second * v[j] * v[k] / 2;
                out.jacobian[j][i] += second * v[k];
            }
    return out;
}

/// sum over i, j of c_ij d^2 value_i / (dv_j dv_k) of all these terms.
template <class T>
Vec2<T> bend_second(const LensTerms& lens, const Vec2<T>& v, const Mat2<T>& c) {
    Vec2<T> d(0);
    for (int k = 0; k < 2; ++k)
        for (int i = 0; i < 2; ++i)
            for (int j = 0; j < 2; ++j) {
                const T high = T(lens.prism_high[i]) *
                               (8 * v[j] * v[k] + (j == k ? 4 * glm::dot(v, v) : T(0)));
                d[k] += c[j][i] * (quadratic_second<T>(lens, i, j, k) + high);
            }
    return d;
}

template <class T>
struct Parts {
    Radial<T> front, plane;
    Vec2<T> w{0}, bent{0};  // bent: where the terms of Bend are taken
    Bend<T> bend;
    Mat2<T> front_jacobian{1}, radial_jacobian{1}, plane_jacobian{1};
};

template <class T>
Parts<T> parts_at(const LensTerms& lens, const Vec2<T>& ray) {
    Parts<T> at;
    at.front = front_factor(lens, glm::dot(ray, ray));
    at.w = ray * at.front.value;
    at.plane = plane_factor(lens, glm::dot(at.w, at.w));
    at.front_jacobian = radial_jacobian(ray, at.front);
    at.radial_jacobian = radial_jacobian(at.w, at.plane);
    at.bent = lens.after ? at.w * at.plane.value : at.w;
    at.bend = bend(lens, at.bent);
    at.plane_jacobian = at.radial_jacobian +
                        (lens.after ? at.bend.jacobian * at.radial_jacobian : at.bend.jacobian);
    return at;
}

}  // namespace

template <class T>
LensPoint<T> lens_point(const LensTerms& lens, const Vec2<T>& ray) {
    const Parts<T> at = parts_at(lens, ray);
    LensPoint<T> out;
    out.value = at.w * at.plane.value + at.bend.value;
    out.jacobian = at.plane_jacobian * at.front_jacobian;
    out.seen = glm::dot(at.w, at.w) <= T(lens.fold * lens.fold);
    return out;
}

template <class T>
Vec2<T> lens_jacobian_backward(const LensTerms& lens, const Vec2<T>& ray,
                               const Mat2<T>& d_jacobian) {
    const Parts<T> at = parts_at(lens, ray);
    const Mat2<T> d_plane = d_jacobian * glm::transpose(at.front_jacobian);
    const Mat2<T> d_front = glm::transpose(at.plane_jacobian) * d_jacobian;
    const Mat2<T>& radial = at.radial_jacobian;
    Vec2<T> d_w(0);
    if (lens.after)
        d_w = radial_second(at.w, at.plane, d_plane + glm::transpose(at.bend.jacobian) * d_plane) +
              glm::transpose(radial) * bend_second(lens, at.bent, d_plane * glm::transpose(radial));
    else
        d_w = radial_second(at.w, at.plane, d_plane) + bend_second(lens, at.bent, d_plane);
    return glm::transpose(at.front_jacobian) * d_w + radial_second(ray, at.front, d_front);
}

RayBounds ray_bounds(const Camera& camera) {
    const glm::dvec2 size(camera.width, camera.height), focal(camera.fx, camera.fy);
    const glm::dvec2 principal(camera.cx, camera.cy);
    if (camera.lens.active) {
        const glm::dvec2 margin =
            JACOBIAN_MARGIN * 0.5 * (camera.lens.ray_max - camera.lens.ray_min);
        return {camera.lens.ray_min - margin, camera.lens.ray_max + margin};
    }
    const glm::dvec2 margin = JACOBIAN_MARGIN * 0.5 * size / focal;
    return {-principal / focal - margin, (size - principal) / focal + margin};
}

#define DARB_INSTANTIATE(T)                                             \
    template LensPoint<T> lens_point(const LensTerms&, const Vec2<T>&); \
    template Vec2<T> lens_jacobian_backward(const LensTerms&, const Vec2<T>&, const Mat2<T>&);
DARB_INSTANTIATE(double)
DARB_INSTANTIATE(float)
#undef DARB_INSTANTIATE

}  // namespace darb::reference
