// SPDX-License-Identifier: MIT
// Compares float32 results with double: worst error against a tolerance, cosine, and bias.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace darb::reference {

struct Tolerance {
    std::string_view name{};
    // A value fails where |got - expected| > abs + rel |expected|, or where got is not finite.
    double abs = 0;
    double rel = 0;
    double max_fail_ratio = 0;  // share of the values; for boundary bands only, where it is counted
    double min_cosine = -1;     // between all expected and all got values as two vectors
    // |sum(got - expected)| / sum |expected|: rounding is unbiased, a mistake seldom is.
    double max_signed_bias = std::numeric_limits<double>::infinity();
    std::string_view reason{};
};

/// The row with that name; aborts where there is none.
const Tolerance& tolerance(std::string_view name);

struct ComparisonStats {
    size_t count = 0;
    size_t failures = 0;     // values outside abs + rel |expected|
    size_t worst_index = 0;  // index of the largest ratio of error to allowed error
    double worst_ratio = 0;  // that ratio; infinite where got is not finite
    double worst_error = 0;  // the largest |got - expected|
    double cosine = 1;       // 1 where both are zero, 0 where only one is
    double signed_bias = 0;  // sum(got - expected) / sum |expected|
};

/// The allowed error: abs + rel |expected|.
double allowed_error(double expected, const Tolerance& tolerance);
/// Ratio of error to allowed error: above 1 fails; infinite where got is not finite.
double error_ratio(double expected, double got, const Tolerance& tolerance);

/// Both spans must have the same length.
ComparisonStats comparison_stats(std::span<const double> expected, std::span<const double> got,
                                 const Tolerance& tolerance);

/// How many of `count` values may fail: the share max_fail_ratio where that is not 0, but at least
/// two splats' three values each, as a pixel on the boundary involves, up to a twentieth of all.
size_t values_in_band(const Tolerance& tolerance, size_t count);

/// One line for each way in which the tolerance is exceeded; empty: passed.
std::string comparison_failures(const ComparisonStats& stats, const Tolerance& tolerance);

double root_mean_square(std::span<const double> values);

/// The tolerance with its absolute part multiplied by the root mean square of the expected values:
/// for sums that cancel, whose rounding grows with their terms.
Tolerance scaled_tolerance(const Tolerance& tolerance, std::span<const double> expected);

}  // namespace darb::reference
