// SPDX-License-Identifier: MIT
#include "engine/check/check_report.h"

#include <fmt/format.h>

#include <cmath>

namespace darb::check {

Row compare_row(const std::string& group, const std::string& name, std::span<const double> expected,
                std::span<const double> got, const reference::Tolerance& tolerance, bool scaled) {
    Row row;
    row.group = group;
    row.name = name;
    row.count = expected.size();
    if (expected.size() != got.size()) {
        row.detail = fmt::format("{} values expected, {} got", expected.size(), got.size());
        return row;
    }
    const reference::Tolerance allowed =
        scaled ? reference::scaled_tolerance(tolerance, expected) : tolerance;
    const reference::ComparisonStats stats = reference::comparison_stats(expected, got, allowed);
    row.detail = reference::comparison_failures(stats, allowed);
    row.pass = row.detail.empty();
    if (!row.pass && row.count > 0)
        row.detail +=
            fmt::format("\n  the worst is value {}: {} expected, {} got", stats.worst_index,
                        expected[stats.worst_index], got[stats.worst_index]);
    row.outside = stats.failures;
    row.band = reference::values_in_band(allowed, row.count);
    if (row.count == 0) return row;
    const double rms = scaled ? reference::root_mean_square(expected) : 0;
    const double unit = rms > 0 ? rms : 1;
    row.error = std::abs(got[stats.worst_index] - expected[stats.worst_index]) / unit;
    row.allowed = reference::allowed_error(expected[stats.worst_index], allowed) / unit;
    return row;
}

Row fact_row(const std::string& group, const std::string& name, bool holds,
             const std::string& detail) {
    Row row;
    row.group = group;
    row.name = name;
    row.count = 1;
    row.pass = holds;
    row.outside = holds ? 0 : 1;
    if (!holds) row.detail = "\n  " + detail;
    return row;
}

}  // namespace darb::check
