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
        const double x = m.opacity[i];
        const double log_opacity = x < 0 ? x - std::log1p(std::exp(x)) : -std::log1p(std::exp(-x));
        value[i] = static_cast<float>(log_opacity + log_area - 2 * std::log(distance));
    }
    return value;
}

void pick(const std::vector<float>& from, std::size_t stride,
          const std::vector<std::uint32_t>& splats, std::vector<float>& to) {
    to.resize(splats.size() * stride);
    for (std::size_t i = 0; i < splats.size(); ++i)
        std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(splats[i] * stride), stride,
                    to.begin() + static_cast<std::ptrdiff_t>(i * stride));
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

SplatModel picked(const SplatModel& m, const std::vector<std::uint32_t>& splats) {
    SplatModel out;
    out.sh_degree = m.sh_degree;
    out.kernel = m.kernel;
    out.footprint = m.footprint;
    out.antialias = m.antialias;
    out.origin = m.origin;
    pick(m.position, 3, splats, out.position);
    pick(m.log_scale, 3, splats, out.log_scale);
    pick(m.rotation, 4, splats, out.rotation);
    pick(m.opacity, 1, splats, out.opacity);
    pick(m.sh_dc, 3, splats, out.sh_dc);
    pick(m.sh_rest, static_cast<std::size_t>(m.rest_count()), splats, out.sh_rest);
    return out;
}

}  // namespace darb
