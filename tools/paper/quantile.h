// Quantiles of the measurements of an experiment.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace darb {

/// Between neighbours, of sorted values; NaN of none.
inline double quantile(const std::vector<double>& sorted, double share) {
    if (sorted.empty()) return std::numeric_limits<double>::quiet_NaN();
    const double place = share * static_cast<double>(sorted.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, sorted.size() - 1);
    const double rest = place - static_cast<double>(below);
    return (1 - rest) * sorted[below] + rest * sorted[above];
}

inline double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return quantile(values, 0.5);
}

}  // namespace darb
