#include "engine/scene/splat_moments.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <numbers>

#include "engine/scene/sh_basis.h"

namespace darb {

namespace {

constexpr double kThinnest = 1e-3;  // share of the mean variance that a projection has at least

constexpr double kLeastOpacity = 1e-13;  // the limit of logits
constexpr double kMostOpacity = 0.99;    // where blending clamps
// Opaque neighbours hide each other: of what is more than opaque this power is real area. Measured,
// docs/experiments/merging.md.
constexpr double kGrowth = 0.4;

/// Symmetric 2x2: xx, xy, yy.
struct Covariance2 {
    double xx, xy, yy;
    double determinant() const { return std::max(xx * yy - xy * xy, 0.0); }
};

Covariance2 projection(const Symmetric3& c, int axis) {
    const double least = kThinnest * (c[0] + c[3] + c[5]) / 3;
    switch (axis) {
        case 0:
            return {c[3] + least, c[4], c[5] + least};
        case 1:
            return {c[0] + least, c[2], c[5] + least};
        default:
            return {c[0] + least, c[1], c[3] + least};
    }
}

/// A splat as a picture along an axis sees it.
struct Blob {
    Covariance2 covariance;
    double root;  // of the determinant
    double x, y, opacity;
};

/// Integral of the product of two Gaussians of peak 1 over 2 pi.
double overlap(const Blob& a, const Blob& b, double second_moment) {
    const Covariance2 sum{a.covariance.xx + b.covariance.xx, a.covariance.xy + b.covariance.xy,
                          a.covariance.yy + b.covariance.yy};
    const double determinant = sum.determinant();
    if (!(determinant > 0)) return 0;
    const double dx = a.x - b.x, dy = a.y - b.y;
    const double q = (sum.yy * dx * dx - 2 * sum.xy * dx * dy + sum.xx * dy * dy) / determinant;
    return a.root * b.root / std::sqrt(determinant) * std::exp(-0.5 * q / second_moment);
}

}  // namespace

double mean_area(const Symmetric3& c) {
    const double minors = std::max(c[0] * c[3] - c[1] * c[1], 0.0) +
                          std::max(c[3] * c[5] - c[4] * c[4], 0.0) +
                          std::max(c[0] * c[5] - c[2] * c[2], 0.0);
    return std::sqrt(minors / 3);
}

SplatMoments moments_of(const SplatModel& model, std::size_t i) {
    SplatMoments m;
    const float* p = &model.position[3 * i];
    const float* r = &model.rotation[4 * i];
    m.mean = {p[0], p[1], p[2]};
    const glm::dmat3 turn = glm::mat3_cast(glm::normalize(glm::dquat(r[0], r[1], r[2], r[3])));
    glm::dmat3 axes = turn;
    for (int k = 0; k < 3; ++k)
        axes[k] *= std::exp(std::clamp(double{model.log_scale[3 * i + static_cast<std::size_t>(k)]},
                                       -LOG_SCALE_LIMIT, LOG_SCALE_LIMIT));
    const glm::dmat3 c = axes * glm::transpose(axes);
    m.covariance = {c[0][0], c[1][0], c[2][0], c[1][1], c[2][1], c[2][2]};
    m.mass = sigmoid(model.opacity_logit[i]) * mean_area(m.covariance);
    for (int k = 0; k < 3; ++k)
        m.colour[k] =
            std::clamp(0.5 + SH_C0 * model.sh_dc[3 * i + static_cast<std::size_t>(k)], 0.0, 1.0);
    return m;
}

SplatMoments merge_moments(const SplatMoments& a, const SplatMoments& b, double second_moment,
                           double* share_of_b) {
    SplatMoments m;
    m.mass = a.mass + b.mass;
    const double w = m.mass > 0 ? b.mass / m.mass : 0.5;
    if (share_of_b) *share_of_b = w;
    const glm::dvec3 d = b.mean - a.mean;
    m.mean = a.mean + w * d;
    m.colour = a.colour + w * (b.colour - a.colour);
    const double spread = w * (1 - w) / second_moment;
    const double outer[] = {d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z};
    for (std::size_t k = 0; k < 6; ++k)
        m.covariance[k] = (1 - w) * a.covariance[k] + w * b.covariance[k] + spread * outer[k];
    return m;
}

double merge_error(const SplatMoments& a, const SplatMoments& b, const SplatMoments& merged,
                   double second_moment) {
    const SplatMoments* const splats[] = {&a, &b, &merged};
    double colours[3][3];
    for (int i = 0; i < 3; ++i)
        for (int j = i; j < 3; ++j)
            colours[i][j] = 1 + glm::dot(splats[i]->colour, splats[j]->colour);
    double opacity[3];
    for (int i = 0; i < 3; ++i) {
        const double area = mean_area(splats[i]->covariance);
        const double o = area > 0 ? splats[i]->mass / area : 0;
        opacity[i] = i == 2 ? -o : o;
    }
    double error = 0;
    for (int axis = 0; axis < 3; ++axis) {
        Blob blobs[3];
        const int x = axis == 0 ? 1 : 0, y = axis == 2 ? 1 : 2;
        for (int i = 0; i < 3; ++i) {
            const SplatMoments& s = *splats[i];
            const Covariance2 c = projection(s.covariance, axis);
            blobs[i] = {c, std::sqrt(c.determinant()), s.mean[x], s.mean[y], opacity[i]};
        }
        for (int i = 0; i < 3; ++i) {
            error += colours[i][i] * opacity[i] * opacity[i] * blobs[i].root / 2;
            for (int j = i + 1; j < 3; ++j)
                error += 2 * colours[i][j] * opacity[i] * opacity[j] *
                         overlap(blobs[i], blobs[j], second_moment);
        }
    }
    return std::isfinite(error) ? std::max(error, 0.0) : std::numeric_limits<double>::max();
}

void set_moments(const SplatMoments& m, std::size_t i, SplatModel& model) {
    const Symmetric3& c = m.covariance;
    Eigen::Matrix3d matrix;
    matrix << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(matrix);
    const Eigen::Vector3d variance = solver.eigenvalues();
    const Eigen::Matrix3d axes = solver.eigenvectors();
    glm::dmat3 turn;
    for (int k = 0; k < 3; ++k) turn[k] = {axes(0, k), axes(1, k), axes(2, k)};
    if (glm::determinant(turn) < 0) turn[2] = -turn[2];
    const glm::dquat q = glm::normalize(glm::quat_cast(turn));
    const double area = mean_area(c), opacity = area > 0 ? m.mass / area : 0;
    const double shown = std::clamp(opacity, kLeastOpacity, kMostOpacity);
    const double growth = opacity > shown ? kGrowth / 2 * std::log(opacity / shown) : 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const double least = std::exp(-2 * LOG_SCALE_LIMIT);
        model.position[3 * i + k] = static_cast<float>(m.mean[static_cast<int>(k)]);
        model.log_scale[3 * i + k] = static_cast<float>(
            std::log(std::max(variance[static_cast<Eigen::Index>(k)], least)) / 2 + growth);
    }
    const double wxyz[] = {q.w, q.x, q.y, q.z};
    for (std::size_t k = 0; k < 4; ++k) model.rotation[4 * i + k] = static_cast<float>(wxyz[k]);
    model.opacity_logit[i] = static_cast<float>(std::log(shown / (1 - shown)));
}

}  // namespace darb
