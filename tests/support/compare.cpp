#include "tests/support/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "engine/core/check.h"

namespace darb::test {
namespace {

constexpr size_t kPrintedFailures = 5;

double allowed_error(double expected, const Tolerance& tolerance) {
    return tolerance.abs + tolerance.rel * std::abs(expected);
}

/// Error over allowed error: above 1 fails.
double error_ratio(double expected, double got, const Tolerance& tolerance) {
    const double error = std::abs(got - expected);
    if (error == 0) {
        return 0;
    }
    const double ratio = error / allowed_error(expected, tolerance);
    return std::isfinite(got) && !std::isnan(ratio) ? ratio
                                                    : std::numeric_limits<double>::infinity();
}

double cosine_of(std::span<const double> a, std::span<const double> b) {
    double aa = 0, bb = 0, ab = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        aa += a[i] * a[i];
        bb += b[i] * b[i];
        ab += a[i] * b[i];
    }
    if (aa == 0 && bb == 0) {
        return 1;
    }
    return aa == 0 || bb == 0 ? 0 : ab / (std::sqrt(aa) * std::sqrt(bb));
}

std::string describe(std::span<const double> expected, std::span<const double> got,
                     const Tolerance& tolerance, size_t inner, size_t i) {
    const std::string index =
        inner > 1 ? fmt::format("[{}][{}]", i / inner, i % inner) : fmt::format("[{}]", i);
    return fmt::format("\n  {}: expected {:.9g}, got {:.9g}, error {:.3g}, tolerance {:.3g}", index,
                       expected[i], got[i], std::abs(got[i] - expected[i]),
                       allowed_error(expected[i], tolerance));
}

}  // namespace

ComparisonStats comparison_stats(std::span<const double> expected, std::span<const double> got,
                                 const Tolerance& tolerance) {
    DARB_CHECK(expected.size() == got.size(), "{} and {}", expected.size(), got.size());
    ComparisonStats stats;
    stats.count = expected.size();
    double signed_sum = 0, size_sum = 0;
    for (size_t i = 0; i < expected.size(); ++i) {
        const double ratio = error_ratio(expected[i], got[i], tolerance);
        stats.failures += ratio > 1 ? 1 : 0;
        if (ratio > stats.worst_ratio) {
            stats.worst_ratio = ratio;
            stats.worst_index = i;
        }
        signed_sum += got[i] - expected[i];
        size_sum += std::abs(expected[i]);
    }
    stats.cosine = cosine_of(expected, got);
    stats.signed_bias = signed_sum == 0 ? 0 : signed_sum / size_sum;
    return stats;
}

testing::AssertionResult compare_doubles(std::string_view case_name,
                                         std::span<const double> expected,
                                         std::span<const double> got, const Tolerance& tolerance,
                                         size_t inner) {
    if (expected.size() != got.size() || expected.empty()) {
        return testing::AssertionFailure() << fmt::format("{}: {} values expected, {} got",
                                                          case_name, expected.size(), got.size());
    }
    const ComparisonStats stats = comparison_stats(expected, got, tolerance);
    const double fail_ratio =
        static_cast<double>(stats.failures) / static_cast<double>(stats.count);
    std::string reasons;
    if (fail_ratio > tolerance.max_fail_ratio) {
        reasons += fmt::format("\n  {} of {} values outside, {} allowed", stats.failures,
                               stats.count, tolerance.max_fail_ratio);
    }
    if (!(stats.cosine >= tolerance.min_cosine)) {
        reasons += fmt::format("\n  cosine 1 - {:.3g}, at least 1 - {:.3g}", 1 - stats.cosine,
                               1 - tolerance.min_cosine);
    }
    if (!(std::abs(stats.signed_bias) <= tolerance.max_signed_bias)) {
        reasons += fmt::format("\n  signed bias {:.3g}, at most {:.3g}", stats.signed_bias,
                               tolerance.max_signed_bias);
    }
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
    double square = 0, worst = 0;
    for (size_t i = 0; i < std::min(expected.size(), got.size()); ++i) {
        square += expected[i] * expected[i];
        worst = std::max(worst, std::abs(got[i] - expected[i]));
    }
    const double rms = std::sqrt(square / static_cast<double>(std::max<size_t>(got.size(), 1)));
    testing::Test::RecordProperty(case_name, fmt::format("{:.2e}", rms > 0 ? worst / rms : worst));
    Tolerance scaled = tolerance;
    if (rms > 0) scaled.abs *= rms;
    return compare_doubles(case_name, expected, got, scaled, 1);
}

}  // namespace darb::test
