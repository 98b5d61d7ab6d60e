#include "engine/scene/upright.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace darb {

namespace {

constexpr std::size_t kSplatsOfFeet = 100'000;
constexpr float kLeastLogit = -2.2f;  // an opacity of a tenth
constexpr double kStrays = 0.005, kFoot = 0.03, kSurely = 1.5, kLying = 2;
struct Standing {
    glm::dvec3 at;
    double weight;
};

/// Weight of a layer times its width.
double footing(const std::vector<Standing>& splats, int axis, double from, double to) {
    double weight = 0, square = 0;
    glm::dvec3 sum(0.0);
    for (const Standing& s : splats) {
        if (s.at[axis] < from || s.at[axis] > to) continue;
        glm::dvec3 across = s.at;
        across[axis] = 0;
        weight += s.weight;
        sum += s.weight * across;
        square += s.weight * glm::dot(across, across);
    }
    if (!(weight > 0)) return 0;
    const double variance = square / weight - glm::dot(sum, sum) / (weight * weight);
    return weight * std::sqrt(std::max(variance, 0.0));
}

/// Of the ends of an axis.
struct Ends {
    double low = 0, high = 0;
};

Ends footing_of_ends(std::vector<Standing>& splats, int axis) {
    std::sort(splats.begin(), splats.end(),
              [axis](const Standing& a, const Standing& b) { return a.at[axis] < b.at[axis]; });
    double total = 0;
    for (const Standing& s : splats) total += s.weight;
    const auto place_of = [&](double share) {
        double sum = 0;
        for (const Standing& s : splats)
            if ((sum += s.weight) >= share * total) return s.at[axis];
        return splats.back().at[axis];
    };
    const double low = place_of(kStrays), high = place_of(1 - kStrays), slab = kFoot * (high - low);
    return {footing(splats, axis, splats.front().at[axis], low + slab),
            footing(splats, axis, high - slab, splats.back().at[axis])};
}

}  // namespace

glm::dvec3 guess_up(const SplatModel& m) {
    std::vector<Standing> splats;
    const size_t step = std::max<size_t>(1, m.size() / kSplatsOfFeet);
    for (size_t i = 0; i < m.size(); i += step) {
        const float* p = &m.position[3 * i];
        const float* s = &m.log_scale[3 * i];
        const double log_area = double{s[0]} + s[1] + s[2] - std::min({s[0], s[1], s[2]});
        const double weight = sigmoid(m.opacity_logit[i]) * std::exp(std::min(log_area, 50.0));
        if (m.opacity_logit[i] < kLeastLogit || !(weight > 0)) continue;
        splats.push_back({{p[0], p[1], p[2]}, weight});
    }
    const glm::dvec3 usual(0, -1, 0);
    if (splats.size() < 100) return usual;
    const Ends y = footing_of_ends(splats, 1), z = footing_of_ends(splats, 2);  // y is down
    if (z.low > kLying * std::max({y.low, y.high, z.high})) return {0, 0, 1};
    return y.low > kSurely * y.high ? -usual : usual;
}

glm::dvec3 usual_front(const glm::dvec3& up) {
    const glm::dvec3 usual =
        std::abs(up.z) > 0.7 ? glm::dvec3(0, up.z > 0 ? -1 : 1, 0) : glm::dvec3(0, 0, -1);
    return glm::normalize(usual - glm::dot(usual, up) * up);
}

}  // namespace darb
