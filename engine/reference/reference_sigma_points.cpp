// SPDX-License-Identifier: MIT
#include "engine/reference/reference_sigma_points.h"

#include <cmath>
#include <optional>

#include "engine/kernels/kernel_family.h"
#include "engine/reference/reference_lens.h"

namespace darb::reference {
namespace {

constexpr int kSigmaPoints = 6;

/// Which axis point i lies on, and how many of its standard deviations away.
int axis_of(int i) {
    return i / 2;
}
template <class T>
T reach_of(int i) {
    return i % 2 == 0 ? std::sqrt(T(3)) : -std::sqrt(T(3));
}

/// The rows are exposed later below the centre, so the picture is sheared.
template <class T>
Vec2<T> sheared(const Vec2<T>& offset, const Vec2<T>& shear) {
    return offset + shear * offset.y;
}

/// dL/d(point) from dL/d(its pixel).
template <class T>
Vec3<T> pixel_backward(const Vec3<T>& point, const Camera& camera, const Vec2<T>& d_pixel) {
    const Vec2<T> ray(point.x / point.z, point.y / point.z);
    Vec2<T> d_ray(T(camera.fx) * d_pixel.x, T(camera.fy) * d_pixel.y);
    if (camera.lens.active) d_ray = glm::transpose(lens_point(camera.lens, ray).jacobian) * d_ray;
    return Vec3<T>(d_ray.x, d_ray.y, -glm::dot(d_ray, ray)) / point.z;
}

/// Whether the Jacobian changes by more than PROJECTION_SHARE along the longest axis, away from the
/// camera.
template <class T>
bool jacobian_changes(const Vec3<T>& mean, const std::array<Vec3<T>, 3>& axis,
                      const CovarianceTerms<T>& terms, const Camera& camera) {
    Vec3<T> longest = axis[0];
    for (const Vec3<T>& a : axis)
        if (glm::dot(a, a) > glm::dot(longest, longest)) longest = a;
    CovarianceTerms<T> there;
    set_rows(longest.z < 0 ? mean - longest : mean + longest, camera, there);
    const Vec3<T> d1 = there.own1 - terms.own1, d2 = there.own2 - terms.own2;
    const T size = glm::dot(terms.own1, terms.own1) + glm::dot(terms.own2, terms.own2);
    return glm::dot(d1, d1) + glm::dot(d2, d2) > T(PROJECTION_SHARE * PROJECTION_SHARE) * size;
}

/// The ray, on the plane z = 1, that a lens takes to a value; none where Newton's steps find none.
std::optional<glm::dvec2> ray_of(const LensTerms& lens, const glm::dvec2& value) {
    glm::dvec2 ray = value;
    for (int step = 0; step < 100; ++step) {
        const LensPoint<double> at = lens_point(lens, ray);
        const glm::dvec2 miss = at.value - value;
        if (glm::length(miss) < 1e-12) return at.seen ? std::optional(ray) : std::nullopt;
        glm::dvec2 by = glm::inverse(at.jacobian) * miss;
        for (int halved = 0; halved < 40; ++halved, by *= 0.5)
            if (glm::length(lens_point(lens, ray - by).value - value) < glm::length(miss)) break;
        ray -= by;
    }
    return std::nullopt;
}

}  // namespace

template <class T>
SigmaTerms<T> sigma_terms(const Vec3<T>& mean, const std::array<Vec3<T>, 3>& axis,
                          const CovarianceTerms<T>& terms, const Camera& camera, int projection) {
    SigmaTerms<T> s;
    if (projection == PROJECTION_JACOBIAN) return s;
    if (!terms.ratio.x_inside || !terms.ratio.y_inside) return s;
    if (projection == PROJECTION_AUTO && !jacobian_changes(mean, axis, terms, camera)) return s;
    s.axis = axis;
    s.shear = terms.motion.per_row * terms.motion.pixel;
    const Vec2<T> centre = pixel_at(mean, camera);
    for (int i = 0; i < kSigmaPoints; ++i) {
        const Vec3<T> point = mean + reach_of<T>(i) * axis[axis_of(i)];
        if (!(point.z > T(SIGMA_NEAREST) * mean.z)) return s;
        const Vec2<T> ray(point.x / point.z, point.y / point.z);
        if (camera.lens.active && !lens_point(camera.lens, ray).seen) return s;
        s.offset[i] = pixel_at(point, camera) - centre;
        s.shift += sheared(s.offset[i], s.shear) / T(kSigmaPoints);
    }
    for (int i = 0; i < kSigmaPoints; ++i) {
        const Vec2<T> y = sheared(s.offset[i], s.shear) - s.shift;
        s.xx += y.x * y.x / T(kSigmaPoints);
        s.xy += y.x * y.y / T(kSigmaPoints);
        s.yy += y.y * y.y / T(kSigmaPoints);
        const T z = reach_of<T>(i) * axis[axis_of(i)].z;
        s.xz += y.x * z / T(kSigmaPoints);
        s.yz += y.y * z / T(kSigmaPoints);
        s.zz += z * z / T(kSigmaPoints);
    }
    s.used = std::isfinite(s.xx + s.xy + s.yy);
    return s;
}

template <class T>
SigmaGradients<T> sigma_backward(const Vec3<T>& mean, const SigmaTerms<T>& sigma,
                                 const Camera& camera, const Vec3<T>& d_cov,
                                 const Vec2<T>& d_shift) {
    SigmaGradients<T> g;
    if (!sigma.used) return g;
    for (int i = 0; i < kSigmaPoints; ++i) {
        const Vec2<T>& o = sigma.offset[i];
        const Vec2<T> y = sheared(o, sigma.shear) - sigma.shift;
        // The mean's own share of the covariance cancels, as the points' offsets from it add up to
        // 0.
        const Vec2<T> d_y =
            (Vec2<T>(2 * d_cov[0] * y.x + d_cov[1] * y.y, d_cov[1] * y.x + 2 * d_cov[2] * y.y) +
             d_shift) /
            T(kSigmaPoints);
        g.d_shear += d_y * o.y;
        const Vec2<T> d(d_y.x, d_y.y + glm::dot(sigma.shear, d_y));
        g.d_focal += d * o / Vec2<T>(camera.fx, camera.fy);
        const T reach = reach_of<T>(i);
        const Vec3<T> d_point = pixel_backward(mean + reach * sigma.axis[axis_of(i)], camera, d);
        g.d_mean += d_point - pixel_backward(mean, camera, d);
        g.d_axis[axis_of(i)] += reach * d_point;
    }
    return g;
}

double integrated_footprint(const Splats<double>& splats, size_t index, const Camera& camera,
                            const glm::dvec2& pixel) {
    const glm::dvec3 mean = mean_in_camera(&splats.position[index * 3], camera);
    const glm::dmat3 axes = camera.rotation * rotation_terms(&splats.rotation[index * 4]).matrix;
    const auto light = [&](const glm::dvec3& ray) {
        // |mean - t ray|^2 in standard deviations, t the depth: c t^2 - 2 b t + a.
        double a = 0, b = 0, c = 0;
        for (int k = 0; k < 3; ++k) {
            const double s = clamped_scale(splats.log_scale[index * 3 + k]);
            const double m = glm::dot(axes[k], mean) / s, r = glm::dot(axes[k], ray) / s;
            a += m * m;
            b += m * r;
            c += r * r;
        }
        if (!(b > 0)) return 0.0;
        const double nearest = std::max(a - b * b / c, 0.0);
        double sum = 0;
        constexpr int kSteps = 400;
        const double reach = 8;  // standard deviations: of the Gaussian nothing is left
        for (int i = 0; i < kSteps; ++i) {
            const double x = reach * (2 * (i + 0.5) / kSteps - 1);
            sum +=
                kernel_value(splats.kernel, Footprint::psi, nearest + x * x) * 2 * reach / kSteps;
        }
        return sum * glm::length(ray) / std::sqrt(c);
    };
    const glm::dvec2 value((pixel.x - camera.cx) / camera.fx, (pixel.y - camera.cy) / camera.fy);
    const auto ray = camera.lens.active ? ray_of(camera.lens, value) : std::optional(value);
    return ray ? light({ray->x, ray->y, 1}) / light(mean / mean.z) : 0;
}

#define DARB_INSTANTIATE(T)                                                                        \
    template SigmaTerms<T> sigma_terms(const Vec3<T>&, const std::array<Vec3<T>, 3>&,              \
                                       const CovarianceTerms<T>&, const Camera&, int);             \
    template SigmaGradients<T> sigma_backward(const Vec3<T>&, const SigmaTerms<T>&, const Camera&, \
                                              const Vec3<T>&, const Vec2<T>&);
DARB_INSTANTIATE(double)
DARB_INSTANTIATE(float)
#undef DARB_INSTANTIATE

}  // namespace darb::reference
