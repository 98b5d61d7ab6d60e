#include "viewer/bounds.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/core/quantile.h"
#include "shaders/shared/limits.h"

namespace darb {

namespace {

constexpr size_t kLooked = 100'000;
constexpr double kTail = 0.02;  // left out at each end
constexpr double kReach = 2.5;  // of the median distance: background farther away is cut
constexpr float kLogitOfTenth = -2.2f;
constexpr double kFramed = 1.35, kUnframed = 0.002;            // radii; share of the splats in them
constexpr double kStray = 0.005, kFoot = 0.05, kSurely = 1.5;  // of guess_up

std::vector<glm::dvec3> sample(const SplatModel& m, float least_logit) {
    std::vector<glm::dvec3> points;
    const size_t step = std::max<size_t>(1, m.size() / kLooked);
    for (size_t i = 0; i < m.size(); i += step)
        if (m.opacity_logit[i] >= least_logit)
            points.emplace_back(m.position[3 * i], m.position[3 * i + 1], m.position[3 * i + 2]);
    return points;
}

/// A splat by its height.
struct Layered {
    double y, x, z, weight;
};

/// Weight of a layer times its width.
double footing(const std::vector<Layered>& splats, double from, double to) {
    double weight = 0, x = 0, z = 0, square = 0;
    for (const Layered& s : splats) {
        if (s.y < from || s.y > to) continue;
        weight += s.weight;
        x += s.weight * s.x;
        z += s.weight * s.z;
        square += s.weight * (s.x * s.x + s.z * s.z);
    }
    if (!(weight > 0)) return 0;
    const double variance = square / weight - (x * x + z * z) / (weight * weight);
    return weight * std::sqrt(std::max(variance, 0.0));
}

}  // namespace

Bounds scene_bounds(const SplatModel& model) {
    std::vector<glm::dvec3> points = sample(model, kLogitOfTenth);
    if (points.empty()) points = sample(model, -1e30f);
    if (points.empty()) return {model.origin, 1};
    Bounds bounds;
    std::vector<double> values(points.size());
    for (int axis = 0; axis < 3; ++axis) {
        for (size_t i = 0; i < points.size(); ++i) values[i] = points[i][axis];
        bounds.centre[axis] = (nearest_rank(values, kTail) + nearest_rank(values, 1 - kTail)) / 2;
    }
    for (size_t i = 0; i < points.size(); ++i) values[i] = glm::distance(points[i], bounds.centre);
    const double middle = nearest_rank(values, 0.5);
    bounds.radius = std::max(std::min(nearest_rank(values, 1 - kTail), kReach * middle), 1e-3);
    bounds.centre += model.origin;
    return bounds;
}

double framing_distance(const SplatModel& model, const Bounds& bounds, const glm::dmat3& axes,
                        double tan_x, double tan_y) {
    std::vector<glm::dvec3> points = sample(model, kLogitOfTenth);
    if (points.empty()) points = sample(model, -1e30f);
    std::vector<double> distances;
    for (const glm::dvec3& point : points) {
        const glm::dvec3 p = glm::transpose(axes) * (point + model.origin - bounds.centre);
        if (glm::length(p) > kFramed * bounds.radius) continue;
        distances.push_back(std::max(std::abs(p.x) / tan_x, std::abs(p.y) / tan_y) - p.z);
    }
    return distances.empty() ? 0 : std::max(nearest_rank(distances, 1 - kUnframed), 0.0);
}

float near_plane_for(const Bounds& bounds) {
    return std::min(static_cast<float>(NEAR_DEFAULT), static_cast<float>(bounds.radius * 0.1));
}

glm::dvec3 guess_up(const SplatModel& m) {
    std::vector<Layered> splats;
    double total = 0;
    const size_t step = std::max<size_t>(1, m.size() / kLooked);
    for (size_t i = 0; i < m.size(); i += step) {
        const float* p = &m.position[3 * i];
        const float* s = &m.log_scale[3 * i];
        const double log_area = double{s[0]} + s[1] + s[2] - std::min({s[0], s[1], s[2]});
        const double weight = sigmoid(m.opacity_logit[i]) * std::exp(std::min(log_area, 50.0));
        if (m.opacity_logit[i] < kLogitOfTenth || !(weight > 0)) continue;
        splats.push_back({p[1], p[0], p[2], weight});
        total += weight;
    }
    const glm::dvec3 usual(0, -1, 0);
    if (splats.size() < 100) return usual;
    std::sort(splats.begin(), splats.end(),
              [](const Layered& a, const Layered& b) { return a.y < b.y; });
    const auto height_of = [&](double share) {
        double sum = 0;
        for (const Layered& s : splats)
            if ((sum += s.weight) >= share * total) return s.y;
        return splats.back().y;
    };
    const double low = height_of(kStray), high = height_of(1 - kStray);
    const double slab = kFoot * (high - low);
    const double at_top = footing(splats, splats.front().y, low + slab);  // y is down
    const double at_bottom = footing(splats, high - slab, splats.back().y);
    return at_top > kSurely * at_bottom ? -usual : usual;
}

}  // namespace darb
