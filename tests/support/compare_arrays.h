// SPDX-License-Identifier: MIT
// Comparison of arrays against a tolerance: prints case, index, expected, got and tolerance.
//   EXPECT_TRUE(compare("d_position", expected, got, tolerance("gradient_float32"), 3));
#pragma once

#include <gtest/gtest.h>

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/reference/comparison.h"
#include "tests/support/test_tolerance.h"

namespace darb::test {

using reference::comparison_stats;
using reference::ComparisonStats;

/// Fails on different lengths, on empty arrays, and where the tolerance is exceeded. The message
/// names the first failures with their index as [i / inner][i % inner].
testing::AssertionResult compare_doubles(std::string_view case_name,
                                         std::span<const double> expected,
                                         std::span<const double> got, const Tolerance& tolerance,
                                         size_t inner);

/// As above, for any two containers of numbers.
template <class Expected, class Got>
testing::AssertionResult compare(std::string_view case_name, const Expected& expected,
                                 const Got& got, const Tolerance& tolerance, size_t inner = 1) {
    const std::vector<double> a(std::begin(expected), std::end(expected));
    const std::vector<double> b(std::begin(got), std::end(got));
    return compare_doubles(case_name, a, b, tolerance, inner);
}

/// As above, with the absolute part in units of the root mean square of the expected values: for
/// sums that cancel, whose rounding grows with their terms. The worst error in that unit is written
/// to the test's XML record under the name of the case.
testing::AssertionResult compare_scaled_doubles(const std::string& case_name,
                                                std::span<const double> expected,
                                                std::span<const double> got,
                                                const Tolerance& tolerance);

template <class Expected, class Got>
testing::AssertionResult compare_scaled(const std::string& case_name, const Expected& expected,
                                        const Got& got, const Tolerance& tolerance) {
    const std::vector<double> a(std::begin(expected), std::end(expected));
    const std::vector<double> b(std::begin(got), std::end(got));
    return compare_scaled_doubles(case_name, a, b, tolerance);
}

}  // namespace darb::test
