// SPDX-License-Identifier: MIT
#include "engine/reference/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/error.h"

namespace darb::reference {
namespace {

constexpr double kHalfRoundoff = 1.0 / 2048;  // of half precision, round to nearest

constexpr Tolerance kTable[] = {
    {"exact", 0, 0, 0, -1, 0, "counts, indices, order, and paths that must agree to the bit"},
    {"difference", 2e-7, 2e-7, 0, 1 - 1e-12, 1e-6,
     "double against central differences with h = 1e-5: truncation h^2 f''' / 6 = 1e-8 and "
     "rounding 1e-15 / h = 1e-10, times a loss of about 100"},
    {"difference_banded", 2e-6, 2e-6, 0.02, 1 - 1e-6, 1e-4,
     "as difference, with the real cut-off: a pixel within h of it jumps by the cut-off / 2h"},
    {"projection_float32", 1e-6, 2e-5, 0, 1 - 1e-9, 1e-5,
     "about 60 float32 operations with mild cancellation in R and J W R"},
    {"lens_float32", 4e-6, 1e-4, 0, 1 - 1e-9, 3e-5,
     "as projection_float32, behind the device's atan (Vulkan allows 4096 ulp) and the lens's "
     "terms"},
    {"kernel_float32", 4e-7, 0, 0, 1 - 1e-12, 1e-6,
     "polynomial 1.3e-7 and its rounding; the error of q comes on top, see the kernel test"},
    {"image_float32", 2e-5, 2e-5, 0.002, 1 - 1e-8, 1e-5,
     "sum of up to 1,000 layers in float32; the band is the alpha cut-off (a step of 1/255), the "
     "edge of the support and the transmittance stop"},
    {"image_exact_kernel", 2e-6, 0, 0, 1 - 1e-10, 1e-5,
     "one layer, so only the kernel's own error and that of q, with no cut-off in reach"},
    {"image_thin_layers", 2e-5, 3e-4, 0, 1 - 1e-7, 3e-4,
     "10,000 equal layers: 1 - alpha rounds by up to 3e-8, and by the same in every one of them"},
    {"gradient_float32", 1e-6, 2e-3, 0.005, 1 - 1e-6, 1e-3,
     "recursion over all layers of a pixel, then sums over pixels that cancel; band as for images"},
    {"gradient_scaled_float32", 2e-5, 2e-3, 0.005, 1 - 1e-6, 1e-3,
     "the same for compare_scaled: the sums cancel, so abs is in units of the root mean square"},
    {"gradient_steep_float32", 2e-4, 1e-2, 0.02, 1 - 1e-5, 1e-3,
     "as gradient_scaled_float32, where the slope goes like 1/sqrt(1 - q/9) towards the edge: "
     "1 - q/9 is 1e-5 at the cut-off, and float32 knows it to a percent"},
    {"gradient_thin_layers", 1.5e-3, 1e-2, 0, 1 - 1e-6, 2e-3,
     "for compare_scaled; as image_thin_layers, forward and back, where each layer divides: Vulkan "
     "lets that be off by 2.5 ulp, in each to the same side; and sums over the tile that cancel"},
    {"gradient_thin_layers_walk", 3e-3, 1e-2, 0.001, 1 - 1e-5, 4e-3,
     "as gradient_thin_layers, on to the parameters: the shape's sums cancel once more"},
    {"project_gradient_float32", 5e-5, 1e-4, 0, 1 - 1e-8, 1e-4,
     "for compare_scaled: one splat's sums through the factor, J W R and the quaternion, in units "
     "of the splat's own largest entry"},
    {"difference_float32", 5e-3, 5e-3, 0, 1 - 1e-5, 3e-3,
     "for compare_scaled: central differences of float32 images, h = 2^-6: truncation h^2 f''' / 6 "
     "= 4e-5 f''', large for a short quaternion, and rounding 1e-6 / 2h = 3e-5"},
    {"image_half", 5e-4, 2e-3, 0.01, 1 - 1e-5, 2e-3,
     "halves rounded the same way on both sides; where float32 lands on the other side of a tie, a "
     "value moves by 2^-11 of itself"},
    {"gradient_scaled_half", 2e-3, 1e-2, 0.01, 1 - 1e-4, 1e-2,
     "for compare_scaled; as image_half, and the device takes the sums of q's factor by moments of "
     "the rounded factor, which is 2^-11 of them"},
    {"image_fast16", 10 * kHalfRoundoff, 0, 0.01, 1 - 1e-5, 2e-3,
     "alpha in halves: weighted over a splat's pixels it is off by 10 u of itself, u = 2^-11, if "
     "all roundings add up (docs/math.md); the band is the cut-off, as for image_float32"},
    {"gradient_scaled_fast16", 40 * kHalfRoundoff, 20 * kHalfRoundoff, 0.01, 1 - 1e-4, 1e-2,
     "for compare_scaled; as image_fast16, forward and back, and the sums over pixels cancel"},
    {"image_resorted", 2e-5, 2e-5, 0.01, 1 - 1e-4, 1e-2,
     "as image_float32; the slope of the depth is stored as two halves, so that two splats cross "
     "up to a pixel off"},
    {"loss_float32", 1e-6, 1e-5, 0, 1 - 1e-8, 1e-5,
     "SSIM's variances cancel: 11x11 sums of squares"},
    {"loss_gradient_float32", 1e-9, 1e-3, 0.001, 1 - 1e-7, 1e-4,
     "per pixel 1/(3HW); flat windows divide by C2, and sign(x - y) flips where they meet"},
    {"training_loss_float32", 1e-5, 1e-4, 0, 1 - 1e-9, 1e-4,
     "means over an image after steps of Adam, which move a parameter without influence by the "
     "sign of rounding"},
    {"adam_float32", 1e-7, 1e-5, 0, 1 - 1e-9, 1e-5, "two square roots and a division"},
};

}  // namespace

const Tolerance& tolerance(std::string_view name) {
    for (const Tolerance& row : kTable) {
        if (row.name == name) {
            return row;
        }
    }
    throw Error("tolerance", fmt::format("there is none named {}", name),
                "engine/reference/comparison.cpp has the names.");
}

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
        throw Error("comparison",
                    fmt::format("cannot compare {} values with {}", expected.size(), got.size()),
                    "Pass equal numbers of both.");
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
