#include "engine/kernels/kernel_profile.h"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/core/check.h"

namespace darb {
namespace {

using Complex = std::complex<double>;
constexpr double kHalfPi = std::numbers::pi / 2;

/// cos(pi/2 sqrt t): entire in t; near its zero at t = 1 written so that no digit is lost.
Complex cos_root(Complex t) {
    const Complex root = std::sqrt(t);
    return t.real() < 0.5 ? std::cos(kHalfPi * root) : std::sin(kHalfPi * (1.0 - t) / (1.0 + root));
}

/// sin(x)/x at x = pi/2 sqrt t: entire in t; its series where the quotient's derivative cancels.
Complex sinc_root(Complex t) {
    if (t.real() > 0.25) {
        const Complex x = kHalfPi * std::sqrt(t);
        return std::sin(x) / x;
    }
    const Complex z = -kHalfPi * kHalfPi * t;
    Complex sum = 1, term = 1;
    for (int k = 1; k < 12; ++k) {
        term *= z / (2.0 * k * (2.0 * k + 1));
        sum += term;
    }
    return sum;
}

Complex square(Complex z) {
    return z * z;
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

const std::array<KernelProfile, KERNEL_COUNT> kRows{{
    {"gaussian", kInfinity, 0, KERNEL_FORM_GAUSSIAN, [](Complex q) { return std::exp(-q / 2.0); }},
    {"raised_cosine", 6.25, 2, KERNEL_FORM_COMPACT,
     [](Complex q) { return square(cos_root(q / 6.25)); }},  // = 1/2 + 1/2 cos(pi d/2.5)
    {"half_cosine_squared", 9, 1, KERNEL_FORM_COMPACT,
     [](Complex q) { return cos_root(square(q / 9.0)); }},  // = cos(pi q/18)
    {"sinc", 9, 1, KERNEL_FORM_COMPACT,
     [](Complex q) { return cos_root(q / 9.0) * sinc_root(q / 9.0); }},  // = sin x/x, x = pi d/3
    {"inverse_quadratic", 9, 0, KERNEL_FORM_QUADRIC, [](Complex q) { return 1.0 / (1.0 + q); }},
    {"cosine", 9, 1, KERNEL_FORM_COMPACT, [](Complex q) { return cos_root(q / 9.0); }},
    {"squared_raised_cosine", 9, 4, KERNEL_FORM_COMPACT,
     [](Complex q) { return square(square(cos_root(q / 9.0))); }},  // = (1/2 + 1/2 cos(pi d/3))^2
    {"inverse_multiquadric", 9, 0, KERNEL_FORM_QUADRIC,
     [](Complex q) { return 1.0 / std::sqrt(1.0 + q); }},
    {"parabolic", 9, 1, KERNEL_FORM_COMPACT, [](Complex q) { return 1.0 - q / 9.0; }},
}};

}  // namespace

const KernelProfile& kernel_profile(int kernel) {
    DARB_CHECK(kernel >= 0 && kernel < KERNEL_COUNT, "kernel = {}", kernel);
    return kRows[static_cast<std::size_t>(kernel)];
}

}  // namespace darb
