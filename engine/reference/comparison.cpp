#include "engine/reference/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/error.h"

namespace darb::reference {
namespace {

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

}  // namespace

double allowed_error(double expected, const Tolerance& tolerance) {
    return tolerance.abs + tolerance.rel * std::abs(expected);
}

double error_ratio(double expected, double got, const Tolerance& tolerance) {
    const double error = std::abs(got - expected);
    if (error == 0) {
        return 0;
    }
    const double ratio = error / allowed_error(expected, tolerance);
    return std::isfinite(got) && !std::isnan(ratio) ? ratio
                                                    : std::numeric_limits<double>::infinity();
}

ComparisonStats comparison_stats(std::span<const double> expected, std::span<const double> got,
                                 const Tolerance& tolerance) {
    if (expected.size() != got.size())
        throw Error("comparison", fmt::format("{} values and {}", expected.size(), got.size()),
                    "Give as many of both.");
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
        const double error = std::abs(got[i] - expected[i]);
        stats.worst_error = std::isfinite(error) ? std::max(stats.worst_error, error)
                                                 : std::numeric_limits<double>::infinity();
        signed_sum += got[i] - expected[i];
        size_sum += std::abs(expected[i]);
    }
    stats.cosine = cosine_of(expected, got);
    stats.signed_bias = signed_sum == 0 ? 0 : signed_sum / size_sum;
    return stats;
}

size_t values_in_band(const Tolerance& tolerance, size_t count) {
    if (tolerance.max_fail_ratio == 0) return 0;
    const auto share = static_cast<size_t>(tolerance.max_fail_ratio * static_cast<double>(count));
    return std::max(share, std::min<size_t>(6, count / 20));
}

std::string comparison_failures(const ComparisonStats& stats, const Tolerance& tolerance) {
    std::string reasons;
    const size_t allowed = values_in_band(tolerance, stats.count);
    if (stats.count == 0) {
        reasons += "\n  nothing to compare";
    }
    if (stats.failures > allowed) {
        reasons += fmt::format("\n  {} of {} values outside, {} allowed", stats.failures,
                               stats.count, allowed);
    }
    if (!(stats.cosine >= tolerance.min_cosine)) {
        reasons += fmt::format("\n  cosine 1 - {:.3g}, at least 1 - {:.3g}", 1 - stats.cosine,
                               1 - tolerance.min_cosine);
    }
    if (!(std::abs(stats.signed_bias) <= tolerance.max_signed_bias)) {
        reasons += fmt::format("\n  signed bias {:.3g}, at most {:.3g}", stats.signed_bias,
                               tolerance.max_signed_bias);
    }
    return reasons;
}

double root_mean_square(std::span<const double> values) {
    double square = 0;
    for (const double value : values) square += value * value;
    return std::sqrt(square / static_cast<double>(std::max<size_t>(values.size(), 1)));
}

Tolerance scaled_tolerance(const Tolerance& tolerance, std::span<const double> expected) {
    Tolerance scaled = tolerance;
    const double rms = root_mean_square(expected);
    if (rms > 0) scaled.abs *= rms;
    return scaled;
}

}  // namespace darb::reference
