// SPDX-License-Identifier: MIT
#include "engine/reference/projection.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/reference/reference_lens.h"
#include "engine/reference/reference_sigma_points.h"
#include "engine/scene/pose_metric.h"
#include "shaders/shared/lens.h"

namespace darb::reference {
namespace {

template <class T>
bool inside(T value, double limit) {
    return value > T(-limit) && value < T(limit);
}

template <class T>
T sigmoid_of_clamped(T logit) {
    const T limit = T(OPACITY_LOGIT_LIMIT);
    return 1 / (1 + std::exp(-std::clamp(logit, -limit, limit)));
}

/// What the low-pass filter's blur leaves of the peak; 1 where the model does not antialias.
template <class T>
T antialias_factor(const Splats<T>& splats, const CovarianceTerms<T>& terms) {
    return splats.antialias ? std::sqrt(terms.det_sharp / terms.det) : T(1);
}

/// The exponent of a splat whose kernel has shapes; else 0, which no kernel reads.
template <class T>
T exponent_of(const Splats<T>& splats, size_t index) {
    if (!kernel_has_shape(splats.kernel)) return 0;
    const auto shape = static_cast<double>(splats.shape[index]);
    return std::isnan(shape)
               ? splats.shape[index]
               : static_cast<T>(splat_exponent(splats.kernel, splats.footprint, shape));
}

template <class T>
T filter_of(const Splats<T>& splats, size_t index) {
    return splats.smoothing.empty() ? T(0) : splats.smoothing[index];
}

/// The share of the opacity that both filters leave.
template <class T>
T opacity_factor(const Splats<T>& splats, const CovarianceTerms<T>& terms) {
    return antialias_factor(splats, terms) * terms.smooth.factor;
}

template <class T>
struct ViewTerms {
    Vec3<T> direction{0};  // from the camera centre to the splat, unit length
    T distance = 0;        // world units
};

template <class T>
ViewTerms<T> view_terms(const T* position, const Camera& camera) {
    const Vec3<T> ray = Vec3<T>(position[0], position[1], position[2]) - Vec3<T>(camera.centre());
    const T distance = glm::length(ray);
    return {ray / distance, distance};
}

template <class T>
int active_degree(const Splats<T>& splats, const RenderSettings& settings) {
    return std::min(splats.sh_degree, settings.sh_degree);
}

template <class T>
Vec3<T> colour_of(const Splats<T>& splats, size_t index, int degree, const Vec3<T>& direction) {
    const ShBasis<T> basis = sh_basis(degree, direction);
    const T* dc = &splats.sh_dc[index * 3];
    const T* rest = splats.sh_rest.data() + index * splats.rest_count();
    Vec3<T> colour(T(0.5));
    for (int c = 0; c < 3; ++c) {
        colour[c] += basis[0] * dc[c];
        for (int k = 1; k < (degree + 1) * (degree + 1); ++k) {
            colour[c] += basis[k] * rest[(k - 1) * 3 + c];
        }
        colour[c] = colour[c] < 0 ? T(0) : colour[c];  // keeps NaN
    }
    return colour;
}

/// dL/d(A, B, C) of S' = [[A, B], [B, C]] from the factor of its inverse, l11 = sqrt(C / det),
/// l21 = -B / sqrt(C det), l22 = 1 / sqrt(C).
template <class T>
Vec3<T> factor_backward(const ProjectedSplat<T>& p, const ProjectedGradient<T>& g) {
    const T conic_xx = p.l11 * p.l11;  // det S'^-1 = conic_xx conic_yy - ... = (l11 l22)^2
    const T d_a = T(-0.5) * p.l11 * conic_xx * g.d_l11 - T(0.5) * conic_xx * p.l21 * g.d_l21;
    const T d_b = -conic_xx * p.l21 * g.d_l11 - p.l11 * (p.l21 * p.l21 + p.l22 * p.l22) * g.d_l21;
    const T d_c = T(-0.5) * p.l11 * p.l21 * p.l21 * g.d_l11 -
                  p.l21 * (p.l22 * p.l22 + T(0.5) * p.l21 * p.l21) * g.d_l21 -
                  T(0.5) * p.l22 * p.l22 * p.l22 * g.d_l22;
    return {d_a, d_b, d_c};
}

template <class T>
struct RowGradients {
    Vec3<T> d_r1{0}, d_r2{0};
};

/// dL/d(rows of M): through the factor, and through the antialiasing factor of the opacity.
template <class T>
RowGradients<T> row_gradients(const Splats<T>& splats, const CovarianceTerms<T>& terms,
                              const ProjectedSplat<T>& splat,
                              const ProjectedGradient<T>& gradient) {
    Vec3<T> d_cov = factor_backward(splat, gradient);
    RowGradients<T> d;
    if (splats.antialias && terms.det_sharp > 0) {
        // opacity = sigmoid |n| / sqrt(det), n = r1 x r2; det = A C - B^2.
        // With the rows shrunk, as the determinants are.
        const T shrink = terms.shrink, area = shrink * shrink;
        const Vec3<T> r1 = terms.r1 * shrink, r2 = terms.r2 * shrink, n = glm::cross(r1, r2);
        const Vec3<T> d_n = gradient.d_opacity * splat.opacity / terms.det_sharp * n;
        d.d_r1 = shrink * glm::cross(r2, d_n);
        d.d_r2 = shrink * glm::cross(d_n, r1);
        const T d_det = T(-0.5) * gradient.d_opacity * splat.opacity / terms.det;
        const Vec3<T> adjugate(splat.cov_yy, -2 * splat.cov_xy, splat.cov_xx);
        d_cov += d_det * area * (area * adjugate);
    }
    d.d_r1 += 2 * d_cov[0] * terms.r1 + d_cov[1] * terms.r2;
    d.d_r2 += 2 * d_cov[2] * terms.r2 + d_cov[1] * terms.r1;
    return d;
}

/// dL/d(A, B, C) from the gradients of rows that are a triangular factor of the covariance.
template <class T>
Vec3<T> covariance_backward(const CovarianceTerms<T>& terms, const RowGradients<T>& d) {
    const T d_b = d.d_r1.y / terms.r2.y;
    return {(d.d_r1.x - d_b * terms.r2.x) / (2 * terms.r1.x), d_b, d.d_r2.y / (2 * terms.r2.y)};
}

/// dL/d(mean in the camera) through the entries of the Jacobian, clamp included.
template <class T>
Vec3<T> jacobian_backward(const Vec3<T>& mean, const CovarianceTerms<T>& terms,
                          const Camera& camera, const Vec3<T>& d_j1, const Vec3<T>& d_j2) {
    const T fx = T(camera.fx), fy = T(camera.fy), z = mean.z;
    Vec3<T> d(0);
    d.z = -(d_j1.x * fx + d_j2.y * fy) / (z * z) +
          (d_j1.z * fx * terms.ratio.x + d_j2.z * fy * terms.ratio.y) / (z * z);
    if (terms.ratio.x_inside) {
        const T d_ratio = -d_j1.z * fx / z;
        d.x += d_ratio / z;
        d.z -= d_ratio * mean.x / (z * z);
    }
    if (terms.ratio.y_inside) {
        const T d_ratio = -d_j2.z * fy / z;
        d.y += d_ratio / z;
        d.z -= d_ratio * mean.y / (z * z);
    }
    return d;
}

/// Writes dL/d(sh_dc, sh_rest), returns dL/d(position) through the view direction.
template <class T>
Vec3<T> colour_backward(const Splats<T>& splats, size_t index, int degree, const ViewTerms<T>& view,
                        const ProjectedSplat<T>& splat, const ProjectedGradient<T>& gradient,
                        SplatGradients<T>& out) {
    const ShBasis<T> basis = sh_basis(degree, view.direction);
    const ShBasisGradient<T> basis_gradient = sh_basis_gradient(degree, view.direction);
    const T* rest = splats.sh_rest.data() + index * splats.rest_count();
    T* d_rest = out.sh_rest.data() + index * splats.rest_count();
    Vec3<T> d_direction(0);
    for (int c = 0; c < 3; ++c) {
        const T d_colour = splat.colour[c] > 0 ? gradient.d_colour[c] : T(0);
        out.sh_dc[index * 3 + c] = basis[0] * d_colour;
        for (int k = 1; k < (degree + 1) * (degree + 1); ++k) {
            d_rest[(k - 1) * 3 + c] = basis[k] * d_colour;
            d_direction += d_colour * rest[(k - 1) * 3 + c] * basis_gradient[k];
        }
    }
    return (d_direction - view.direction * glm::dot(view.direction, d_direction)) / view.distance;
}

/// What is left of a projected splat in half precision, as the device stores it; see
/// lib/covariance.glsl.
template <class T>
void round_storage(ProjectedSplat<T>& p) {
    constexpr double kLeast = 6.103515625e-05;  // the smallest normal half
    const auto rounded = [](T x) { return static_cast<T>(round_to_half(static_cast<double>(x))); };
    p.l11 = std::max(rounded(p.l11), T(kLeast));
    p.l21 = rounded(p.l21);
    p.l22 = std::max(rounded(p.l22), T(kLeast));
    p.cov_yy = 1 / (p.l22 * p.l22);
    p.cov_xy = -p.l21 * p.cov_yy / p.l11;
    p.cov_xx = (p.l21 * p.l21 + p.l22 * p.l22) * p.cov_yy / (p.l11 * p.l11);
    for (int c = 0; c < 3; ++c) {
        p.colour[c] = rounded(p.colour[c]);
    }
}

/// dL/d(mean in the camera) through the Jacobian and the pixel.
template <class T>
Vec3<T> mean_backward(const Vec3<T>& mean, const CovarianceTerms<T>& terms, const Camera& camera,
                      const Vec3<T>& d_j1, const Vec3<T>& d_j2, const Vec2<T>& d_px) {
    const T fx = T(camera.fx), fy = T(camera.fy), z = mean.z;
    if (!camera.lens.active) {
        return jacobian_backward(mean, terms, camera, d_j1, d_j2) +
               Vec3<T>(d_px.x * fx / z, d_px.y * fy / z,
                       -(d_px.x * fx * mean.x + d_px.y * fy * mean.y) / (z * z));
    }
    // Rows of J: f_i (D_i0 (1, 0, -u) + D_i1 (0, 1, -v)) / z, D the lens's Jacobian at (u, v).
    const Vec2<T> uv(terms.ratio.x, terms.ratio.y), free(mean.x / z, mean.y / z);
    const LensPoint<T> at = lens_point(camera.lens, uv);
    Mat2<T> d_lens;  // [column][row]
    d_lens[0] = Vec2<T>(fx * (d_j1.x - uv.x * d_j1.z), fy * (d_j2.x - uv.x * d_j2.z)) / z;
    d_lens[1] = Vec2<T>(fx * (d_j1.y - uv.y * d_j1.z), fy * (d_j2.y - uv.y * d_j2.z)) / z;
    Vec2<T> d_uv = lens_jacobian_backward(camera.lens, uv, d_lens);
    for (int c = 0; c < 2; ++c)
        d_uv[c] -= (fx * at.jacobian[c][0] * d_j1.z + fy * at.jacobian[c][1] * d_j2.z) / z;
    if (!terms.ratio.x_inside) d_uv.x = 0;
    if (!terms.ratio.y_inside) d_uv.y = 0;
    d_uv +=
        glm::transpose(lens_point(camera.lens, free).jacobian) * Vec2<T>(fx * d_px.x, fy * d_px.y);
    const T scaled = glm::dot(terms.own1, d_j1) + glm::dot(terms.own2, d_j2);  // scale as 1 / z
    return {d_uv.x / z, d_uv.y / z, -(glm::dot(d_uv, free) + scaled) / z};
}

/// What the rows of J and the pixel say of the row's time, and of the rows at a given time.
template <class T>
struct ShutterGradients {
    Vec3<T> d_own1{0}, d_own2{0}, d_mean{0}, d_velocity{0};
    T d_time = 0;  // at a held mean
};

template <class T>
ShutterGradients<T> shutter_backward(const CovarianceTerms<T>& terms, const RowCamera<T>& row,
                                     const Vec3<T>& d_j1, const Vec3<T>& d_j2,
                                     const SigmaGradients<T>& by_sigma) {
    const RowMotion<T>& m = terms.motion;
    // j1 = own1 + u s own2, j2 = own2 + v s own2, with (u, v) = own . velocity, s = 1 / (H - v).
    const Vec2<T> d_shear =
        Vec2<T>(glm::dot(d_j1, terms.own2), glm::dot(d_j2, terms.own2)) + by_sigma.d_shear;
    const T by_u = m.per_row * d_shear.x;
    const T by_v = m.per_row * d_shear.y + m.per_row * m.per_row * glm::dot(m.pixel, d_shear);
    ShutterGradients<T> d;
    d.d_own1 = d_j1 + by_u * m.velocity;
    d.d_own2 = d_j2 + m.per_row * (m.pixel.x * d_j1 + m.pixel.y * d_j2) + by_v * m.velocity;
    d.d_velocity = by_u * terms.own1 + by_v * terms.own2;
    // velocity = turn x mean - swing, and the rows that turn with the camera are j1 W and j2 W.
    d.d_mean = glm::cross(d.d_velocity, row.turn);
    d.d_time = -glm::dot(d.d_velocity, glm::cross(row.turn, row.swing)) -
               glm::dot(d_j1, glm::cross(row.turn, terms.j1)) -
               glm::dot(d_j2, glm::cross(row.turn, terms.j2));
    for (int k = 0; k < 3; ++k)
        d.d_time += glm::dot(by_sigma.d_axis[k], glm::cross(row.turn, terms.sigma.axis[k]));
    return d;
}

/// dL/d(camera). j: rows of the Jacobian by world coordinates, J W, where W is the rotation. d_j:
/// gradient by J alone; d_k: by J W. d_view: dL/d(position) through the view direction.
template <class T>
struct CameraInputs {
    Vec3<T> mean{0};      // in the camera
    Vec3<T> position{0};  // world
    Vec3<T> d_mean{0}, d_own1{0}, d_own2{0}, d_k1{0}, d_k2{0}, d_view{0};
    Vec2<T> d_px{0};
};

template <class T>
CameraGradients<T> camera_backward(const CameraInputs<T>& in, const CovarianceTerms<T>& terms,
                                   const Camera& camera) {
    CameraGradients<T> d;
    // p = W x + t; k = j W; the centre that the view direction begins at is -W^T t.
    const Vec3<T> t(camera.translation), d_centre = -in.d_view;
    d.d_translation = in.d_mean - view_rotation<T>(camera) * d_centre;
    d.d_rotation = glm::outerProduct(in.d_mean, in.position) +
                   glm::outerProduct(terms.j1, in.d_k1) + glm::outerProduct(terms.j2, in.d_k2) -
                   glm::outerProduct(t, d_centre);
    const Vec2<T> free(in.mean.x / in.mean.z, in.mean.y / in.mean.z);
    const Vec2<T> value = camera.lens.active ? lens_point(camera.lens, free).value : free;
    d.d_focal = {in.d_px.x * value.x + glm::dot(in.d_own1, terms.own1) / T(camera.fx),
                 in.d_px.y * value.y + glm::dot(in.d_own2, terms.own2) / T(camera.fy)};
    d.d_principal = in.d_px;
    if (camera.lens.active) return d;
    // A clamped ratio is that of a corner of the picture, (pixel - c) / f, so f times the ratio in
    // its row does not depend on f, and changes by -c.
    if (!terms.ratio.x_inside) {
        d.d_focal.x += in.d_own1.z * terms.ratio.x / in.mean.z;
        d.d_principal.x += in.d_own1.z / in.mean.z;
    }
    if (!terms.ratio.y_inside) {
        d.d_focal.y += in.d_own2.z * terms.ratio.y / in.mean.z;
        d.d_principal.y += in.d_own2.z / in.mean.z;
    }
    return d;
}

}  // namespace

template <class T>
CameraGradients<T>& CameraGradients<T>::operator+=(const CameraGradients& other) {
    d_rotation += other.d_rotation;
    d_translation += other.d_translation;
    d_focal += other.d_focal;
    d_principal += other.d_principal;
    d_turn += other.d_turn;
    d_move += other.d_move;
    return *this;
}

double round_to_half(double x) {
    int exponent = 0;
    const double mantissa = std::frexp(x, &exponent);
    return std::ldexp(std::nearbyint(std::ldexp(mantissa, 11)), exponent - 11);
}

std::string_view cull_name(Cull cull) {
    constexpr std::string_view kNames[kCullCount] = {
        "none", "near_plane", "rotation", "opacity", "covariance", "outside", "colour"};
    return kNames[static_cast<int>(cull)];
}

template <class T>
void SplatGradients<T>::resize_like(const Splats<T>& splats) {
    for (int a = 0; a < kAttributeCount; ++a)
        attribute_values(*this, a).resize(attribute_values(splats, a).size());
}

/// Covariance, its Cholesky factor and the slope of the depth along it.
template <class T>
void set_shape(const RenderSettings& settings, const CovarianceTerms<T>& terms,
               ProjectedSplat<T>& p) {
    const T area = terms.shrink * terms.shrink;  // scale of det after shrinking, per px^2
    p.cov_xx = glm::dot(terms.r1, terms.r1) + T(settings.low_pass);
    p.cov_xy = glm::dot(terms.r1, terms.r2);
    p.cov_yy = glm::dot(terms.r2, terms.r2) + T(settings.low_pass);
    const T xy = p.cov_xy * area, yy = p.cov_yy * area;
    p.l11 = terms.shrink * std::sqrt(yy / terms.det);
    p.l21 = -terms.shrink * xy / (std::sqrt(yy) * std::sqrt(terms.det));
    p.l22 = 1 / std::sqrt(p.cov_yy);
    const Vec3<T>& r3 = terms.r3;
    const T c1 = glm::dot(r3, terms.r1), c2 = glm::dot(r3, terms.r2);
    p.depth_slope = {p.l11 * c1 + p.l21 * c2, p.l22 * c2};
    const Vec3<T> n1 = terms.r1 * terms.shrink, n2 = terms.r2 * terms.shrink;
    const T h = T(settings.low_pass) * area, volume = glm::dot(glm::cross(n1, n2), r3);
    const Vec3<T> across1 = glm::cross(n1, r3), across2 = glm::cross(n2, r3);
    p.depth_deviation =
        std::sqrt((volume * volume + h * (glm::dot(across1, across1) + glm::dot(across2, across2)) +
                   h * h * glm::dot(r3, r3)) /
                  terms.det);
}

template <class T>
ProjectedSplat<T> project(const Splats<T>& splats, size_t index, const Camera& given,
                          const RenderSettings& settings, const KernelTable& kernel) {
    if (index >= splats.size())
        throw Error("reference", fmt::format("there is no splat {} among {}", index, splats.size()),
                    "Splats count from 0.");
    ProjectedSplat<T> p;
    const RowCamera<T> row = row_camera(&splats.position[index * 3], given);
    const Camera& camera = row.camera;
    const Vec3<T> mean = mean_in_camera(&splats.position[index * 3], camera);
    if (!(mean.z > T(settings.near_z)) || !std::isfinite(mean.x + mean.y + mean.z)) {
        p.cull = Cull::near_plane;
        return p;
    }
    const RotationTerms<T> rotation = rotation_terms(&splats.rotation[index * 4]);
    if (!(rotation.norm * rotation.norm >= T(ROTATION_MIN_SQUARE)) ||
        !std::isfinite(rotation.norm)) {
        p.cull = Cull::rotation;
        return p;
    }
    const CovarianceTerms<T> terms = covariance_terms(
        mean, rotation, &splats.log_scale[index * 3], filter_of(splats, index), row, settings,
        kernel.covariance_scale(static_cast<double>(exponent_of(splats, index))));
    p.exponent = exponent_of(splats, index);
    p.opacity = sigmoid_of_clamped(splats.opacity_logit[index]) * opacity_factor(splats, terms);
    const bool half = settings.storage == STORAGE_FLOAT16;
    if (half) {
        p.opacity = static_cast<T>(round_to_half(static_cast<double>(p.opacity)));
    }
    if (!(p.opacity >= T(settings.alpha_cutoff)) || std::isnan(p.exponent)) {
        p.cull = Cull::opacity;
        return p;
    }
    const T area = terms.shrink * terms.shrink;  // scale of det after shrinking, per px^2
    if (!(terms.det > T(DETERMINANT_MIN) * area * area)) {
        p.cull = Cull::covariance;
        return p;
    }
    p.mean_px = {T(camera.fx) * mean.x / mean.z + T(camera.cx),
                 T(camera.fy) * mean.y / mean.z + T(camera.cy)};
    if (camera.lens.active) {
        const LensPoint<T> at = lens_point(camera.lens, Vec2<T>(mean) / mean.z);
        if (!at.seen) {
            p.cull = Cull::outside;
            return p;
        }
        p.mean_px = {T(camera.fx) * at.value.x + T(camera.cx),
                     T(camera.fy) * at.value.y + T(camera.cy)};
    }
    p.mean_px += terms.sigma.shift;
    p.depth = mean.z;
    set_shape(settings, terms, p);
    p.reach = T(kernel.reach(static_cast<double>(p.opacity), settings.alpha_cutoff,
                             static_cast<double>(p.exponent)));
    const ViewTerms<T> view = view_terms(&splats.position[index * 3], camera);
    p.colour = colour_of(splats, index, active_degree(splats, settings), view.direction);
    if (!std::isfinite(p.colour.x + p.colour.y + p.colour.z)) {
        p.cull = Cull::colour;
    }
    if (half) {
        round_storage(p);
    }
    return p;
}

template <class T>
void project_backward(const Splats<T>& splats, size_t index, const Camera& given,
                      const RenderSettings& settings, const KernelTable& kernel,
                      const ProjectedPair<T>& projected, SplatGradients<T>& out,
                      CameraGradients<T>* d_camera) {
    const auto& [splat, gradient] = projected;
    if (splat.cull != Cull::none) {
        return;
    }
    const RowCamera<T> row = row_camera(&splats.position[index * 3], given);
    const Camera& camera = row.camera;
    const Vec3<T> mean = mean_in_camera(&splats.position[index * 3], camera);
    const RotationTerms<T> rotation = rotation_terms(&splats.rotation[index * 4]);
    const CovarianceTerms<T> terms = covariance_terms(
        mean, rotation, &splats.log_scale[index * 3], filter_of(splats, index), row, settings,
        kernel.covariance_scale(static_cast<double>(splat.exponent)));
    const Mat3<T> view_matrix = view_rotation<T>(camera);

    // r1 = root (k1 R) diag(scale), r2 alike.
    RowGradients<T> d_rows = row_gradients(splats, terms, splat, gradient);
    SigmaGradients<T> by_sigma;
    if (terms.sigma.used) {  // nothing of the shape goes through the Jacobian
        by_sigma = sigma_backward(mean, terms.sigma, camera, covariance_backward(terms, d_rows),
                                  gradient.d_mean_px);
        d_rows = {};
    }
    const Vec3<T> e1 = terms.root * d_rows.d_r1, e2 = terms.root * d_rows.d_r2;
    Vec3<T> d_scale = (terms.k1 * rotation.matrix) * e1 + (terms.k2 * rotation.matrix) * e2;
    Mat3<T> d_matrix = glm::outerProduct(terms.k1, e1 * terms.scale) +
                       glm::outerProduct(terms.k2, e2 * terms.scale);
    for (int k = 0; k < 3; ++k) {
        const Vec3<T> d_axis = by_sigma.d_axis[k] * view_matrix;
        d_scale[k] += terms.root * glm::dot(d_axis, rotation.matrix[k]);
        d_matrix[k] += terms.root * terms.scale[k] * d_axis;
    }
    const Vec4<T> d_rotation = rotation_backward(rotation, d_matrix);
    const Vec3<T> d_k1 = rotation.matrix * (e1 * terms.scale);
    const Vec3<T> d_k2 = rotation.matrix * (e2 * terms.scale);
    const Vec3<T> d_j1 = view_matrix * d_k1, d_j2 = view_matrix * d_k2;

    const ShutterGradients<T> d = row.rolls ? shutter_backward(terms, row, d_j1, d_j2, by_sigma)
                                            : ShutterGradients<T>{d_j1, d_j2};
    Vec3<T> d_mean =
        mean_backward(mean, terms, camera, d.d_own1, d.d_own2, gradient.d_mean_px) + d.d_mean;
    d_mean += by_sigma.d_mean;
    d_mean.z += gradient.d_depth;
    const ViewTerms<T> view = view_terms(&splats.position[index * 3], camera);
    const Vec3<T> d_view =
        colour_backward(splats, index, active_degree(splats, settings), view, splat, gradient, out);
    // The time of the row moves with the splat, and the camera with the time.
    const RowMotion<T>& motion = terms.motion;
    const T by_row = motion.per_row * (d.d_time + glm::dot(d_mean, motion.velocity) -
                                       glm::dot(d_view, row.swing * view_matrix));
    d_mean += by_row * terms.own2;
    const Vec3<T> d_position = d_mean * view_matrix + d_view;
    if (d_camera) {
        const Vec3<T> position(splats.position[index * 3], splats.position[index * 3 + 1],
                               splats.position[index * 3 + 2]);
        *d_camera = camera_backward({mean, position, d_mean, d.d_own1, d.d_own2, d_k1, d_k2, d_view,
                                     gradient.d_mean_px + Vec2<T>(0, by_row)},
                                    terms, camera);
        d_camera->d_focal += by_sigma.d_focal;
        for (int k = 0; k < 3; ++k)
            d_camera->d_rotation += glm::outerProduct(
                by_sigma.d_axis[k], terms.root * terms.scale[k] * rotation.matrix[k]);
        const Mat3<T> back(glm::transpose(row.turned));
        d_camera->d_rotation = back * d_camera->d_rotation;
        d_camera->d_translation = back * d_camera->d_translation;
        // A turn of the row's camera on the left, and the shutter's terms in the velocity.
        Vec3<T> twist = glm::cross(mean, d_mean) + glm::cross(d_j1, terms.j1) +
                        glm::cross(d_j2, terms.j2) - glm::cross(row.swing, d.d_velocity);
        for (int k = 0; k < 3; ++k) twist += glm::cross(terms.sigma.axis[k], by_sigma.d_axis[k]);
        const Mat3<T> jacobian(left_jacobian(double(row.time) * glm::dvec3(row.turn)));
        d_camera->d_turn =
            row.time * (glm::transpose(jacobian) * twist) + glm::cross(mean, d.d_velocity);
        d_camera->d_move = -(back * (row.time * (d_mean + view_matrix * d_view) + d.d_velocity));
    }

    for (int c = 0; c < 3; ++c) {
        const bool free = inside(splats.log_scale[index * 3 + c], LOG_SCALE_LIMIT);
        out.position[index * 3 + c] = d_position[c];
        // d ln(scale)/d ln(s) = share, and the filter's factor of the opacity falls with s / scale.
        const T share = terms.smooth.share[c];
        const T d_log =
            d_scale[c] * terms.scale[c] * share + gradient.d_opacity * splat.opacity * (1 - share);
        out.log_scale[index * 3 + c] = free ? d_log : T(0);
    }
    for (int c = 0; c < 4; ++c) {
        out.rotation[index * 4 + c] = d_rotation[c];
    }
    if (kernel_has_shape(splats.kernel)) {
        // Through the profile, and through psi, which scales every row of M by its root.
        const ShapedKernel& shaped = shaped_kernel(splats.kernel);
        const auto shape = static_cast<double>(splats.shape[index]);
        const T by_shape = static_cast<T>(shaped.exponent_slope(splats.footprint, shape));
        const T d_length = glm::dot(d_scale, terms.scale);
        const T length_slope = static_cast<T>(
            shaped.length_slope(splats.footprint, static_cast<double>(splat.exponent)));
        out.shape[index] = by_shape * (gradient.d_exponent + length_slope * d_length);
    }
    const T sigmoid = sigmoid_of_clamped(splats.opacity_logit[index]);
    out.opacity_logit[index] =
        inside(splats.opacity_logit[index], OPACITY_LOGIT_LIMIT)
            ? gradient.d_opacity * opacity_factor(splats, terms) * sigmoid * (1 - sigmoid)
            : T(0);
}

#define DARB_INSTANTIATE(T)                                                                        \
    template struct CameraGradients<T>;                                                            \
    template struct SplatGradients<T>;                                                             \
    template ProjectedSplat<T> project(const Splats<T>&, size_t, const Camera&,                    \
                                       const RenderSettings&, const KernelTable&);                 \
    template void project_backward(const Splats<T>&, size_t, const Camera&, const RenderSettings&, \
                                   const KernelTable&, const ProjectedPair<T>&,                    \
                                   SplatGradients<T>&, CameraGradients<T>*);
DARB_INSTANTIATE(double)
DARB_INSTANTIATE(float)
#undef DARB_INSTANTIATE

template <class T>
RotationTerms<T> rotation_terms(const T* q) {
    RotationTerms<T> terms;
    terms.norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    terms.unit = Vec4<T>(q[0], q[1], q[2], q[3]) / terms.norm;
    const T w = terms.w(), x = terms.x(), y = terms.y(), z = terms.z();
    // Columns: images of the splat's axes.
    terms.matrix[0] = {1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)};
    terms.matrix[1] = {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)};
    terms.matrix[2] = {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)};
    return terms;
}

template <class T>
Vec4<T> rotation_backward(const RotationTerms<T>& terms, const Mat3<T>& d) {
    const T w = terms.w(), x = terms.x(), y = terms.y(), z = terms.z();
    // d[column][row]. Sum over the entries of matrix in which each component stands.
    const T d_w = 2 * (z * (d[0][1] - d[1][0]) + y * (d[2][0] - d[0][2]) + x * (d[1][2] - d[2][1]));
    const T d_x = 2 * (y * (d[0][1] + d[1][0]) + z * (d[0][2] + d[2][0]) + w * (d[1][2] - d[2][1]) -
                       2 * x * (d[1][1] + d[2][2]));
    const T d_y = 2 * (x * (d[0][1] + d[1][0]) + z * (d[1][2] + d[2][1]) + w * (d[2][0] - d[0][2]) -
                       2 * y * (d[0][0] + d[2][2]));
    const T d_z = 2 * (x * (d[0][2] + d[2][0]) + y * (d[1][2] + d[2][1]) + w * (d[0][1] - d[1][0]) -
                       2 * z * (d[0][0] + d[1][1]));
    const Vec4<T> d_unit(d_w, d_x, d_y, d_z);
    return (d_unit - terms.unit * glm::dot(terms.unit, d_unit)) / terms.norm;
}

template <class T>
RatioTerms<T> ratio_terms(const Vec3<T>& mean_camera, const Camera& camera) {
    const RayBounds bounds = ray_bounds(camera);
    const T min_x = T(bounds.low.x), max_x = T(bounds.high.x);
    const T min_y = T(bounds.low.y), max_y = T(bounds.high.y);
    const T x = mean_camera.x / mean_camera.z;
    const T y = mean_camera.y / mean_camera.z;
    return {std::clamp(x, min_x, max_x), std::clamp(y, min_y, max_y), x >= min_x && x <= max_x,
            y >= min_y && y <= max_y};
}

template <class T>
T clamped_scale(T log_scale) {
    return std::exp(std::clamp(log_scale, T(-LOG_SCALE_LIMIT), T(LOG_SCALE_LIMIT)));
}

template <class T>
SmoothedScale<T> smoothed_scale(const T* log_scale, T filter) {
    SmoothedScale<T> s;
    for (int c = 0; c < 3; ++c) {
        const T sharp = clamped_scale(log_scale[c]);
        s.scale[c] = filter > 0 ? std::sqrt(sharp * sharp + filter * filter) : sharp;
        const T kept = filter > 0 ? sharp / s.scale[c] : T(1);
        s.share[c] = kept * kept;
        s.factor *= kept;
    }
    return s;
}

template <class T>
Mat3<T> view_rotation(const Camera& camera) {
    return Mat3<T>(camera.rotation);
}

template <class T>
Vec3<T> mean_in_camera(const T* position, const Camera& camera) {
    return view_rotation<T>(camera) * Vec3<T>(position[0], position[1], position[2]) +
           Vec3<T>(camera.translation);
}

/// Keeps fourth powers of the rows within the range of float; in double, the scaling is exact.
template <class T>
T row_shrink(const Vec3<T>& r1, const Vec3<T>& r2) {
    T longest = 0;
    for (int k = 0; k < 3; ++k) longest = std::max({longest, std::abs(r1[k]), std::abs(r2[k])});
    return longest > T(ROW_LIMIT) ? std::ldexp(T(1), -std::ilogb(longest)) : T(1);
}

template <class T>
Vec2<T> pixel_at(const Vec3<T>& mean, const Camera& camera) {
    const Vec2<T> ray(mean.x / mean.z, mean.y / mean.z);
    const Vec2<T> value = camera.lens.active ? lens_point(camera.lens, ray).value : ray;
    return Vec2<T>(camera.fx, camera.fy) * value + Vec2<T>(camera.cx, camera.cy);
}

template <class T>
void set_rows(const Vec3<T>& mean_camera, const Camera& camera, CovarianceTerms<T>& c) {
    c.ratio = ratio_terms(mean_camera, camera);
    const T fx = T(camera.fx), fy = T(camera.fy), z = mean_camera.z;
    c.own1 = {fx / z, 0, -fx * c.ratio.x / z};
    c.own2 = {0, fy / z, -fy * c.ratio.y / z};
    if (camera.lens.active) {
        const Vec3<T> along_x(1 / z, 0, -c.ratio.x / z), along_y(0, 1 / z, -c.ratio.y / z);
        const Mat2<T> d = lens_point(camera.lens, Vec2<T>(c.ratio.x, c.ratio.y)).jacobian;
        c.own1 = fx * (d[0][0] * along_x + d[1][0] * along_y);
        c.own2 = fy * (d[0][1] * along_x + d[1][1] * along_y);
    }
}

template <class T>
void set_motion(const Vec3<T>& mean_camera, const RowCamera<T>& row, CovarianceTerms<T>& c) {
    c.motion.velocity = glm::cross(row.turn, mean_camera) - row.swing;
    c.motion.pixel = {glm::dot(c.own1, c.motion.velocity), glm::dot(c.own2, c.motion.velocity)};
    const T rows = T(row.camera.height);
    if (std::abs(row.time) < T(SHUTTER_LONGEST))
        c.motion.per_row = 1 / std::max(rows - c.motion.pixel.y, T(SHUTTER_SLOWEST) * rows);
}

template <class T>
RowCamera<T> row_camera(const T* position, const Camera& camera) {
    RowCamera<T> row;
    row.camera = camera;
    row.rolls = camera.shutter.active;
    if (!row.rolls) return row;
    constexpr int kSteps = 30;  // the shader makes SHUTTER_STEPS of Newton's
    row.turn = Vec3<T>(camera.shutter.turn);
    for (int step = 0;; ++step) {
        row.camera = camera_at_row(camera, double(row.time));
        row.turned = exp_rotation(double(row.time) * camera.shutter.turn);
        row.swing = Vec3<T>(row.turned * camera.shutter.move);
        if (step == kSteps) return row;
        const Vec3<T> mean = mean_in_camera(position, row.camera);
        CovarianceTerms<T> c;
        set_rows(mean, row.camera, c);
        set_motion(mean, row, c);
        const T rows = T(camera.height);
        const T miss = pixel_at(mean, row.camera).y - rows * (T(0.5) + row.time);
        const T slope = std::max(rows - c.motion.pixel.y, T(SHUTTER_SLOWEST) * rows);
        row.time = std::clamp(row.time + miss / slope, -T(SHUTTER_LONGEST), T(SHUTTER_LONGEST));
    }
}

/// The triangular factor of the points' covariance with the depth.
template <class T>
void set_rows_of_points(CovarianceTerms<T>& c) {
    const SigmaTerms<T>& s = c.sigma;
    const auto root = [](T square) { return std::sqrt(std::max(square, T(0))); };
    c.r1 = {root(s.xx), 0, 0};
    c.r2 = {s.xy / c.r1.x, 0, 0};
    c.r2.y = root(s.yy - c.r2.x * c.r2.x);
    c.r3 = {s.xz / c.r1.x, 0, 0};
    c.r3.y = (s.yz - c.r2.x * c.r3.x) / c.r2.y;
    c.r3.z = root(s.zz - c.r3.x * c.r3.x - c.r3.y * c.r3.y);
}

template <class T>
CovarianceTerms<T> covariance_terms(const Vec3<T>& mean_camera, const RotationTerms<T>& rotation,
                                    const T* log_scale, T filter, const RowCamera<T>& row,
                                    const RenderSettings& settings, double covariance_scale) {
    CovarianceTerms<T> c;
    const Camera& camera = row.camera;
    set_rows(mean_camera, camera, c);
    c.j1 = c.own1;
    c.j2 = c.own2;
    if (row.rolls) {
        set_motion(mean_camera, row, c);
        c.j1 += c.motion.pixel.x * c.motion.per_row * c.own2;
        c.j2 += c.motion.pixel.y * c.motion.per_row * c.own2;
    }
    const Mat3<T> view = view_rotation<T>(camera);
    c.k1 = c.j1 * view;
    c.k2 = c.j2 * view;
    c.smooth = smoothed_scale(log_scale, filter);
    c.scale = c.smooth.scale;
    c.root = T(std::sqrt(covariance_scale));
    c.r1 = c.root * (c.k1 * rotation.matrix) * c.scale;
    c.r2 = c.root * (c.k2 * rotation.matrix) * c.scale;
    c.r3 = c.root * (Vec3<T>(0, 0, 1) * view * rotation.matrix) * c.scale;
    std::array<Vec3<T>, 3> axis;
    for (int k = 0; k < 3; ++k) axis[k] = c.root * c.scale[k] * (view * rotation.matrix[k]);
    c.sigma = sigma_terms(mean_camera, axis, c, camera, settings.projection);
    if (c.sigma.used) set_rows_of_points(c);
    c.shrink = row_shrink(c.r1, c.r2);
    const Vec3<T> r1 = c.r1 * c.shrink, r2 = c.r2 * c.shrink, cross = glm::cross(r1, r2);
    const T h = T(settings.low_pass) * c.shrink * c.shrink;
    c.det_sharp = glm::dot(cross, cross);
    // det(M M^T + h I) without the cancellation of A C - B^2 (Lagrange's identity).
    c.det = c.det_sharp + h * (glm::dot(r1, r1) + glm::dot(r2, r2)) + h * h;
    return c;
}

#define DARB_INSTANTIATE(T)                                                               \
    template RotationTerms<T> rotation_terms(const T*);                                   \
    template Vec4<T> rotation_backward(const RotationTerms<T>&, const Mat3<T>&);          \
    template RatioTerms<T> ratio_terms(const Vec3<T>&, const Camera&);                    \
    template T clamped_scale(T);                                                          \
    template SmoothedScale<T> smoothed_scale(const T*, T);                                \
    template Mat3<T> view_rotation(const Camera&);                                        \
    template Vec3<T> mean_in_camera(const T*, const Camera&);                             \
    template RowCamera<T> row_camera(const T*, const Camera&);                            \
    template CovarianceTerms<T> covariance_terms(const Vec3<T>&, const RotationTerms<T>&, \
                                                 const T*, T, const RowCamera<T>&,        \
                                                 const RenderSettings&, double);          \
    template Vec2<T> pixel_at(const Vec3<T>&, const Camera&);                             \
    template void set_rows(const Vec3<T>&, const Camera&, CovarianceTerms<T>&);
DARB_INSTANTIATE(double)
DARB_INSTANTIATE(float)
#undef DARB_INSTANTIATE

template <class T>
ShBasis<T> sh_basis(int degree, const Vec3<T>& direction) {
    return darb::sh_basis(degree, direction.x, direction.y, direction.z);
}

template <class T>
ShBasisGradient<T> sh_basis_gradient(int degree, const Vec3<T>& direction) {
    const T x = direction.x, y = direction.y, z = direction.z;
    const T xx = x * x, yy = y * y, zz = z * z;
    ShBasisGradient<T> g{};
    if (degree >= 1) {
        g[1].y = -T(kShBand1);
        g[2].z = T(kShBand1);
        g[3].x = -T(kShBand1);
    }
    if (degree >= 2) {
        g[4] = T(kShBand2Xy) * Vec3<T>(y, x, 0);
        g[5] = -T(kShBand2Xy) * Vec3<T>(0, z, y);
        g[6] = T(kShBand2Zz) * Vec3<T>(-2 * x, -2 * y, 4 * z);
        g[7] = -T(kShBand2Xy) * Vec3<T>(z, 0, x);
        g[8] = T(kShBand2Xx) * Vec3<T>(2 * x, -2 * y, 0);
    }
    if (degree >= 3) {
        g[9] = -T(kShBand3Three) * Vec3<T>(6 * x * y, 3 * xx - 3 * yy, 0);
        g[10] = T(kShBand3Xyz) * Vec3<T>(y * z, x * z, x * y);
        g[11] = -T(kShBand3One) * Vec3<T>(-2 * x * y, 4 * zz - xx - 3 * yy, 8 * y * z);
        g[12] = T(kShBand3Zero) * Vec3<T>(-6 * x * z, -6 * y * z, 6 * zz - 3 * xx - 3 * yy);
        g[13] = -T(kShBand3One) * Vec3<T>(4 * zz - 3 * xx - yy, -2 * x * y, 8 * x * z);
        g[14] = T(kShBand3Two) * Vec3<T>(2 * x * z, -2 * y * z, xx - yy);
        g[15] = -T(kShBand3Three) * Vec3<T>(3 * xx - 3 * yy, -6 * x * y, 0);
    }
    return g;
}

template ShBasis<double> sh_basis(int, const Vec3<double>&);
template ShBasis<float> sh_basis(int, const Vec3<float>&);
template ShBasisGradient<double> sh_basis_gradient(int, const Vec3<double>&);
template ShBasisGradient<float> sh_basis_gradient(int, const Vec3<float>&);

}  // namespace darb::reference
