// SPDX-License-Identifier: MIT
#include "engine/scene/pose_metric.h"

#include <algorithm>
#include <cmath>

namespace darb {

namespace {

constexpr std::size_t kFewest = 20;  // points
// Added to the diagonal, as a share of it, so that steps stay bounded along directions in which the
// picture shifts by less than a tenth of what turn and move would shift it separately.
constexpr double kDamping = 1e-2;

glm::dmat3 cross_matrix(const glm::dvec3& v) {  // columns
    return {{0, v.z, -v.y}, {-v.z, 0, v.x}, {v.y, -v.x, 0}};
}

glm::dvec3 turn_of(const PoseVector& step) {
    return {step[0], step[1], step[2]};
}
glm::dvec3 move_of(const PoseVector& step) {
    return {step[3], step[4], step[5]};
}

// Places at five depths, spread over the picture.
std::vector<glm::dvec3> spread_places(const Camera& c, double depth) {
    constexpr int kSide = 6;
    constexpr std::array kDepths{0.5, 0.75, 1.0, 1.5, 2.0};
    std::vector<glm::dvec3> places;
    for (int j = 0; j < kSide; ++j)
        for (int i = 0; i < kSide; ++i) {
            const double z = depth * kDepths[static_cast<std::size_t>(i + 2 * j) % kDepths.size()];
            places.emplace_back(z * (c.width * (i + 0.5) / kSide - c.cx) / c.fx,
                                z * (c.height * (j + 0.5) / kSide - c.cy) / c.fy, z);
        }
    return places;
}

}  // namespace

glm::dmat3 exp_rotation(const glm::dvec3& v) {
    const double square = glm::dot(v, v), angle = std::sqrt(square);
    const double a = angle > 1e-4 ? std::sin(angle) / angle : 1 - square / 6;
    const double b = angle > 1e-4 ? (1 - std::cos(angle)) / square : 0.5 - square / 24;
    const glm::dmat3 k = cross_matrix(v);
    return glm::dmat3(1.0) + a * k + b * (k * k);
}

glm::dmat3 left_jacobian(const glm::dvec3& v) {
    const double square = glm::dot(v, v), angle = std::sqrt(square);
    const double a = angle > 1e-4 ? (1 - std::cos(angle)) / square : 0.5 - square / 24;
    const double b =
        angle > 1e-3 ? (angle - std::sin(angle)) / (square * angle) : 1.0 / 6 - square / 120;
    const glm::dmat3 k = cross_matrix(v);
    return glm::dmat3(1.0) + a * k + b * (k * k);
}

Camera moved_camera(const Camera& camera, const PoseVector& step) {
    Camera moved = camera;
    const glm::dmat3 turn = exp_rotation(turn_of(step));
    moved.rotation = turn * camera.rotation;
    moved.translation = turn * camera.translation + move_of(step);
    return moved;
}

Camera camera_at_row(const Camera& camera, double time) {
    Camera row = camera;
    row.shutter = {};
    if (!camera.shutter.active) return row;
    const glm::dmat3 turn = exp_rotation(time * camera.shutter.turn);
    row.rotation = turn * camera.rotation;
    row.translation = turn * (camera.translation - time * camera.shutter.move);
    return row;
}

std::array<PoseVector, 2> pixel_by_pose(const Camera& camera, const glm::dvec3& p) {
    const std::array<glm::dvec3, 2> rows{
        glm::dvec3(camera.fx / p.z, 0, -camera.fx * p.x / (p.z * p.z)),
        glm::dvec3(0, camera.fy / p.z, -camera.fy * p.y / (p.z * p.z))};
    std::array<PoseVector, 2> all;
    for (std::size_t r = 0; r < 2; ++r) {
        const glm::dvec3 by_turn = glm::cross(p, rows[r]);  // row . (w x p) = w . (p x row)
        all[r] = {by_turn.x, by_turn.y, by_turn.z, rows[r].x, rows[r].y, rows[r].z};
    }
    return all;
}

PoseMetric::PoseMetric(const Camera& camera, std::span<const glm::dvec3> points, double depth) {
    std::vector<glm::dvec3> seen;
    for (const glm::dvec3& point : points) {
        const glm::dvec3 p = camera.rotation * point + camera.translation;
        if (!(p.z > 0)) continue;
        const double u = camera.fx * p.x / p.z + camera.cx, v = camera.fy * p.y / p.z + camera.cy;
        if (u >= 0 && v >= 0 && u < camera.width && v < camera.height) seen.push_back(p);
    }
    if (seen.size() < kFewest) seen = spread_places(camera, depth);
    for (const glm::dvec3& p : seen)
        for (const PoseVector& row : pixel_by_pose(camera, p))
            for (std::size_t i = 0; i < 6; ++i)
                for (std::size_t j = 0; j < 6; ++j)
                    square_[i][j] += row[i] * row[j] / static_cast<double>(seen.size());
    for (std::size_t i = 0; i < 6; ++i)
        for (std::size_t j = 0; j <= i; ++j) {
            double sum = square_[i][j] * (i == j ? 1 + kDamping : 1);
            for (std::size_t k = 0; k < j; ++k) sum -= lower_[i][k] * lower_[j][k];
            lower_[i][j] = i == j ? std::sqrt(std::max(sum, 1e-300)) : sum / lower_[j][j];
        }
}

PoseVector PoseMetric::to_step(const PoseVector& x) const {
    PoseVector step = x;  // lower^T step = x
    for (std::size_t i = 6; i-- > 0;) {
        for (std::size_t k = i + 1; k < 6; ++k) step[i] -= lower_[k][i] * step[k];
        step[i] /= lower_[i][i];
    }
    return step;
}

PoseVector PoseMetric::gradient(const PoseVector& d_step) const {
    PoseVector d = d_step;  // lower d = d_step
    for (std::size_t i = 0; i < 6; ++i) {
        for (std::size_t k = 0; k < i; ++k) d[i] -= lower_[i][k] * d[k];
        d[i] /= lower_[i][i];
    }
    return d;
}

PoseVector PoseMetric::from_step(const PoseVector& step) const {
    PoseVector x{};
    for (std::size_t i = 0; i < 6; ++i)
        for (std::size_t k = i; k < 6; ++k) x[i] += lower_[k][i] * step[k];
    return x;
}

double PoseMetric::shift_px(const PoseVector& step) const {
    double sum = 0;
    for (std::size_t i = 0; i < 6; ++i)
        for (std::size_t j = 0; j < 6; ++j) sum += step[i] * square_[i][j] * step[j];
    return std::sqrt(std::max(sum, 0.0));
}

// The steps that leave pictures unchanged when the world turns about the cameras' middle by w,
// moves by t and grows by s: turn -R w, move (R w) x p + s p - R t, where p is the middle in camera
// space.
Gauge::Gauge(std::span<const Camera> cameras, std::span<const PoseMetric> metrics) {
    glm::dvec3 middle(0.0);
    for (const Camera& c : cameras) middle += c.centre() / static_cast<double>(cameras.size());
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        const glm::dmat3& r = cameras[i].rotation;
        const glm::dvec3 p = r * middle + cameras[i].translation;
        std::array<PoseVector, 7> columns{};
        for (int k = 0; k < 3; ++k) {
            const glm::dvec3 w = r[k], move = glm::cross(w, p);
            columns[static_cast<std::size_t>(k)] = {-w.x, -w.y, -w.z, move.x, move.y, move.z};
            columns[static_cast<std::size_t>(k) + 3] = {0, 0, 0, -w.x, -w.y, -w.z};
        }
        columns[6] = {0, 0, 0, p.x, p.y, p.z};
        for (PoseVector& column : columns) column = metrics[i].from_step(column);
        basis_.push_back(columns);
    }
    // Gram-Schmidt; a vector that depends on the others is left out.
    for (std::size_t k = 0; k < 7; ++k) {
        const auto dot = [&](std::size_t a, std::size_t b) {
            double sum = 0;
            for (const auto& columns : basis_)
                for (std::size_t i = 0; i < 6; ++i) sum += columns[a][i] * columns[b][i];
            return sum;
        };
        const double before = dot(k, k);
        for (int repeat = 0; repeat < 2; ++repeat)
            for (std::size_t j = 0; j < k; ++j) {
                const double share = dot(j, k);
                for (auto& columns : basis_)
                    for (std::size_t i = 0; i < 6; ++i) columns[k][i] -= share * columns[j][i];
            }
        const double left = dot(k, k);
        const double scale = left > 1e-10 * before && left > 0 ? 1 / std::sqrt(left) : 0;
        for (auto& columns : basis_)
            for (double& value : columns[k]) value *= scale;
    }
}

void Gauge::remove(std::span<PoseVector> x) const {
    for (std::size_t k = 0; k < 7; ++k) {
        double share = 0;
        for (std::size_t c = 0; c < x.size(); ++c)
            for (std::size_t i = 0; i < 6; ++i) share += basis_[c][k][i] * x[c][i];
        for (std::size_t c = 0; c < x.size(); ++c)
            for (std::size_t i = 0; i < 6; ++i) x[c][i] -= share * basis_[c][k][i];
    }
}

}  // namespace darb
