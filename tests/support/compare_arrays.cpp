// SPDX-License-Identifier: MIT
#include "tests/support/compare_arrays.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace darb::test {

using reference::allowed_error;
using reference::comparison_failures;
using reference::error_ratio;

namespace {

constexpr size_t kPrintedFailures = 5;

std::string describe(std::span<const double> expected, std::span<const double> got,
                     const Tolerance& tolerance, size_t inner, size_t i) {
    const std::string index =
        inner > 1 ? fmt::format("[{}][{}]", i / inner, i % inner) : fmt::format("[{}]", i);
    return fmt::format("\n  {}: expected {:.9g}, got {:.9g}, error {:.3g}, tolerance {:.3g}", index,
                       expected[i], got[i], std::abs(got[i] - expected[i]),
                       allowed_error(expected[i], tolerance));
}

}  // namespace

testing::AssertionResult compare_doubles(std::string_view case_name,
                                         std::span<const double> expected,
                                         std::span<const double> got, const Tolerance& tolerance,
                                         size_t inner) {
    if (expected.size() != got.size() || expected.empty()) {
        return testing::AssertionFailure() << fmt::format("{}: {} values expected, {} got",
                                                          case_name, expected.size(), got.size());
    }
    const ComparisonStats stats = comparison_stats(expected, got, tolerance);
    std::string reasons = comparison_failures(stats, tolerance);
    if (reasons.empty()) {
        return testing::AssertionSuccess();
    }
    size_t printed = 0;
    for (size_t i = 0; i < expected.size() && printed < kPrintedFailures; ++i) {
        if (error_ratio(expected[i], got[i], tolerance) > 1) {
            reasons += describe(expected, got, tolerance, inner, i);
            ++printed;
        }
    }
    reasons += "\n  worst" + describe(expected, got, tolerance, inner, stats.worst_index).substr(2);
    return testing::AssertionFailure()
           << fmt::format("{} against {}{}", case_name, tolerance.name, reasons);
}

testing::AssertionResult compare_scaled_doubles(const std::string& case_name,
                                                std::span<const double> expected,
                                                std::span<const double> got,
                                                const Tolerance& tolerance) {
    double worst = 0;
    for (size_t i = 0; i < std::min(expected.size(), got.size()); ++i)
        worst = std::max(worst, std::abs(got[i] - expected[i]));
    const double rms = reference::root_mean_square(expected);
    testing::Test::RecordProperty(case_name, fmt::format("{:.2e}", rms > 0 ? worst / rms : worst));
    const Tolerance scaled = reference::scaled_tolerance(tolerance, expected);
    return compare_doubles(case_name, expected, got, scaled, 1);
}

}  // namespace darb::test
