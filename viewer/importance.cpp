#include "viewer/importance.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace darb {

namespace {

std::vector<float> importance(const SplatModel& m, const Bounds& bounds) {
    std::vector<float> value(m.size());
    const glm::dvec3 middle = bounds.centre - m.origin;
    for (std::size_t i = 0; i < m.size(); ++i) {
        const float* s = &m.log_scale[3 * i];
        const double log_area = double{s[0]} + s[1] + s[2] - std::min({s[0], s[1], s[2]});
        const glm::dvec3 p(m.position[3 * i], m.position[3 * i + 1], m.position[3 * i + 2]);
        const double distance = std::max(glm::distance(p, middle) / bounds.radius, 1.0);
        // Logarithms: a huge splat is no infinity. ln sigmoid, for any logit.
        const double x = m.opacity_logit[i];
        const double log_opacity = x < 0 ? x - std::log1p(std::exp(x)) : -std::log1p(std::exp(-x));
        value[i] = static_cast<float>(log_opacity + log_area - 2 * std::log(distance));
    }
    return value;
}

}  // namespace

std::vector<std::uint32_t> most_important(const SplatModel& model, const Bounds& bounds,
                                          std::size_t count) {
    const std::vector<float> value = importance(model, bounds);
    std::vector<std::uint32_t> order(model.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto first = [&](std::uint32_t a, std::uint32_t b) {
        return value[a] != value[b] ? value[a] > value[b] : a < b;
    };
    const auto end = order.begin() + static_cast<std::ptrdiff_t>(std::min(count, order.size()));
    if (end != order.end()) std::nth_element(order.begin(), end, order.end(), first);
    std::sort(order.begin(), end, first);
    order.erase(end, order.end());
    order.shrink_to_fit();
    return order;
}

}  // namespace darb
