// SPDX-License-Identifier: MIT
#include "engine/scene/quantise.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

#include "engine/scene/edit_splats.h"

namespace darb {

namespace {

constexpr double kFar = 10;          // from the median, in widths of the middle half
constexpr double kMortonMax = 1023;  // 10 bits

using Splats = std::span<std::uint32_t>;

/// Moves splats that lie far off to the end, and returns how many stay: all, where most of them lie
/// far off.
std::size_t part_far(const SplatModel& model, Splats splats) {
    glm::dvec3 median(0.0);
    double width = 0;  // on the widest axis
    std::vector<double> values(splats.size());
    for (int axis = 0; axis < 3; ++axis) {
        std::ranges::transform(splats, values.begin(),
                               [&](std::uint32_t i) { return position_of(model, i)[axis]; });
        const auto rank = [&](std::size_t at) {
            const auto it = values.begin() + static_cast<std::ptrdiff_t>(at);
            std::nth_element(values.begin(), it, values.end());
            return *it;
        };
        median[axis] = rank(values.size() / 2);
        width =
            std::max(width, rank(values.size() - 1 - values.size() / 4) - rank(values.size() / 4));
    }
    const auto is_near = [&](std::uint32_t i) {
        const glm::dvec3 off = glm::abs(position_of(model, i) - median);
        return std::max({off.x, off.y, off.z}) <= kFar * width;
    };
    const auto near = static_cast<std::size_t>(std::ranges::count_if(splats, is_near));
    if (near < splats.size() / 2) return splats.size();
    std::stable_partition(splats.begin(), splats.end(), is_near);
    return near;
}

std::uint32_t morton_code(const glm::dvec3& p, const glm::dvec3& low, const glm::dvec3& high) {
    std::uint32_t code = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double unit =
            high[axis] > low[axis] ? (p[axis] - low[axis]) / (high[axis] - low[axis]) : 0;
        const auto cell = static_cast<std::uint32_t>(std::round(unit * kMortonMax));
        for (int bit = 0; bit < 10; ++bit) code |= ((cell >> bit) & 1u) << (3 * bit + axis);
    }
    return code;
}

/// Sorts each part in Morton order within its bounds; where more than a chunk share one code, again
/// within theirs.
void sort_splats(const SplatModel& model, std::size_t chunk, Splats splats) {
    const std::size_t near = part_far(model, splats);
    if (near < splats.size()) sort_splats(model, chunk, splats.subspan(near));
    splats = splats.first(near);
    glm::dvec3 low(1e300), high(-1e300);
    for (const std::uint32_t i : splats) {
        low = glm::min(low, position_of(model, i));
        high = glm::max(high, position_of(model, i));
    }
    if (low == high) return;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> coded;
    coded.reserve(splats.size());
    for (const std::uint32_t i : splats)
        coded.emplace_back(morton_code(position_of(model, i), low, high), i);
    std::ranges::sort(coded);
    std::ranges::transform(coded, splats.begin(), [](const auto& one) { return one.second; });
    for (std::size_t begin = 0, end = 0; begin < coded.size(); begin = end) {
        while (end < coded.size() && coded[end].first == coded[begin].first) ++end;
        if (end - begin > chunk) sort_splats(model, chunk, splats.subspan(begin, end - begin));
    }
}

}  // namespace

std::vector<std::uint32_t> chunk_order(const SplatModel& model, std::size_t chunk) {
    std::vector<std::uint32_t> order(model.size());
    std::iota(order.begin(), order.end(), 0u);
    if (!order.empty()) sort_splats(model, chunk, order);
    return order;
}

}  // namespace darb
