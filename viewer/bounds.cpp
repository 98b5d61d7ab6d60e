#include "viewer/bounds.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace darb {

namespace {

constexpr size_t kLooked = 100'000;
constexpr double kTail = 0.02;  // left out at each end
constexpr double kReach = 2.5;  // of the median distance: background farther away is cut
constexpr float kLogitOfTenth = -2.2f;

double quantile(std::vector<double>& values, double share) {
    const auto at = values.begin() + std::lround(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

std::vector<glm::dvec3> sample(const SplatModel& m, float least_logit) {
    std::vector<glm::dvec3> points;
    const size_t step = std::max<size_t>(1, m.size() / kLooked);
    for (size_t i = 0; i < m.size(); i += step)
        if (m.opacity_logit[i] >= least_logit)
            points.emplace_back(m.position[3 * i], m.position[3 * i + 1], m.position[3 * i + 2]);
    return points;
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
        bounds.centre[axis] = (quantile(values, kTail) + quantile(values, 1 - kTail)) / 2;
    }
    for (size_t i = 0; i < points.size(); ++i) values[i] = glm::distance(points[i], bounds.centre);
    const double middle = quantile(values, 0.5);
    bounds.radius = std::max(std::min(quantile(values, 1 - kTail), kReach * middle), 1e-3);
    bounds.centre += model.origin;
    return bounds;
}

}  // namespace darb
