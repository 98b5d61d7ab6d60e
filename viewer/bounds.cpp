// SPDX-License-Identifier: MIT
#include "viewer/bounds.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/core/quantile.h"
#include "shaders/shared/limits.h"

namespace darb {

namespace {

constexpr size_t kLooked = 100'000;
constexpr double kTail = 0.02;  // share left out at each end
constexpr double kReach = 2.5;  // in median distances: background farther away is cut
constexpr float kLogitOfTenth = -2.2f;
constexpr double kFramed = 1.35, kUnframed = 0.0005;  // radii; share of the splats in them
// standard deviations to which a splat is framed; the most, in radii
constexpr double kWide = 1.5, kWidest = 0.1;

struct Sample {
    glm::dvec3 position;  // relative to the origin
    double reach;         // largest standard deviation, world units
};

std::vector<Sample> sample(const SplatModel& m, float least_logit) {
    std::vector<Sample> points;
    const size_t step = std::max<size_t>(1, m.size() / kLooked);
    for (size_t i = 0; i < m.size(); i += step) {
        if (m.opacity_logit[i] < least_logit) continue;
        const float *p = &m.position[3 * i], *s = &m.log_scale[3 * i];
        points.push_back({{p[0], p[1], p[2]}, std::exp(double{std::max({s[0], s[1], s[2]})})});
    }
    return points;
}

}  // namespace

Bounds scene_bounds(const SplatModel& model) {
    std::vector<Sample> points = sample(model, kLogitOfTenth);
    if (points.empty()) points = sample(model, -1e30f);
    if (points.empty()) return {model.origin, 1};
    Bounds bounds;
    std::vector<double> values(points.size());
    for (int axis = 0; axis < 3; ++axis) {
        for (size_t i = 0; i < points.size(); ++i) values[i] = points[i].position[axis];
        bounds.centre[axis] = (nearest_rank(values, kTail) + nearest_rank(values, 1 - kTail)) / 2;
    }
    for (size_t i = 0; i < points.size(); ++i)
        values[i] = glm::distance(points[i].position, bounds.centre);
    const double middle = nearest_rank(values, 0.5);
    bounds.radius = std::max(std::min(nearest_rank(values, 1 - kTail), kReach * middle), 1e-3);
    bounds.centre += model.origin;
    return bounds;
}

double framing_distance(const SplatModel& model, const Bounds& bounds, const glm::dmat3& axes,
                        double tan_x, double tan_y) {
    std::vector<Sample> points = sample(model, kLogitOfTenth);
    if (points.empty()) points = sample(model, -1e30f);
    const double cos_x = 1 / std::hypot(1, tan_x), cos_y = 1 / std::hypot(1, tan_y);
    std::vector<double> distances;
    for (const Sample& one : points) {
        const glm::dvec3 p = glm::transpose(axes) * (one.position + model.origin - bounds.centre);
        if (glm::length(p) > kFramed * bounds.radius) continue;
        const double r = std::min(kWide * one.reach, kWidest * bounds.radius);
        distances.push_back(
            std::max((std::abs(p.x) + r / cos_x) / tan_x, (std::abs(p.y) + r / cos_y) / tan_y) -
            p.z);
    }
    return distances.empty() ? 0 : std::max(nearest_rank(distances, 1 - kUnframed), 0.0);
}

float near_plane_for(const Bounds& bounds) {
    return std::min(static_cast<float>(NEAR_DEFAULT), static_cast<float>(bounds.radius * 0.1));
}

}  // namespace darb
