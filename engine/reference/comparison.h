// Comparison of float32 results with double: worst error against a tolerance, cosine and bias.
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
    double max_fail_ratio = 0;  // of the values; for boundary bands only, which are counted
    double min_cosine = -1;     // between all expected and all got values as two vectors
    // |sum(got - expected)| / sum |expected|: rounding is unbiased, a mistake seldom is.
    double max_signed_bias = std::numeric_limits<double>::infinity();
    std::string_view reason{};
};

/// The row of that name; aborts on an unknown one.
const Tolerance& tolerance(std::string_view name);

struct ComparisonStats {
    size_t count = 0;
    size_t failures = 0;     // values outside abs + rel |expected|
    size_t worst_index = 0;  // by error over allowed error
    double worst_ratio = 0;  // that error over allowed error; infinite where got is not finite
    double worst_error = 0;  // the largest |got - expected|
    double cosine = 1;       // 1 where both are zero, 0 where one is
    double signed_bias = 0;  // sum(got - expected) / sum |expected|
};

/// abs + rel |expected|.
double allowed_error(double expected, const Tolerance& tolerance);
/// Error over allowed error: above 1 fails; infinite where got is not finite.
double error_ratio(double expected, double got, const Tolerance& tolerance);

/// Both of the same length.
ComparisonStats comparison_stats(std::span<const double> expected, std::span<const double> got,
                                 const Tolerance& tolerance);

/// How many of `count` values may be outside: max_fail_ratio of them where that is not 0, but room
/// for two splats of three values each, as a pixel on the boundary has them, up to a twentieth.
size_t values_in_band(const Tolerance& tolerance, size_t count);

/// A line for each way in which the tolerance is broken; empty: passed.
std::string comparison_failures(const ComparisonStats& stats, const Tolerance& tolerance);

double root_mean_square(std::span<const double> values);

/// The tolerance with its absolute part in units of the root mean square of the expected values:
/// for sums that cancel, whose rounding goes with their terms.
Tolerance scaled_tolerance(const Tolerance& tolerance, std::span<const double> expected);

}  // namespace darb::reference
