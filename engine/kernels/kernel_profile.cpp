#include "engine/kernels/kernel_profile.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/core/error.h"

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

Complex raised_cosine(Complex q) {  // = 1/2 + 1/2 cos(pi d/2.5)
    return square(cos_root(q / 6.25));
}

Complex sinc(Complex q) {  // = sin x/x, x = pi d/3
    return cos_root(q / 9.0) * sinc_root(q / 9.0);
}

Complex modulus_of_sinc(Complex q) {
    const Complex w = sinc(q);
    return w.real() < 0 ? -w : w;
}

constexpr Pulses cosine_pulses(int count) {
    return {count, 2.5, 5};
}

constexpr Pulses sinc_pulses(int count) {
    return {count, 3, 3};
}

const std::array<KernelProfile, KERNEL_ROWS> kRows{{
    {"gaussian", kInfinity, 0, KERNEL_FORM_GAUSSIAN, [](Complex q) { return std::exp(-q / 2.0); }},
    {"raised_cosine", 6.25, 2, KERNEL_FORM_COMPACT, raised_cosine},
    {"half_cosine_squared", 9, 1, KERNEL_FORM_COMPACT,
     [](Complex q) { return cos_root(square(q / 9.0)); }},  // = cos(pi q/18)
    {"sinc", 9, 1, KERNEL_FORM_COMPACT, sinc},
    {"inverse_quadratic", 9, 0, KERNEL_FORM_QUADRIC, [](Complex q) { return 1.0 / (1.0 + q); }},
    {"cosine", 9, 1, KERNEL_FORM_COMPACT, [](Complex q) { return cos_root(q / 9.0); }},
    {"squared_raised_cosine", 9, 4, KERNEL_FORM_COMPACT,
     [](Complex q) { return square(square(cos_root(q / 9.0))); }},  // = (1/2 + 1/2 cos(pi d/3))^2
    {"inverse_multiquadric", 9, 0, KERNEL_FORM_QUADRIC,
     [](Complex q) { return 1.0 / std::sqrt(1.0 + q); }},
    {"parabolic", 9, 1, KERNEL_FORM_COMPACT, [](Complex q) { return 1.0 - q / 9.0; }},
    {"raised_cosine_2_pulses", 56.25, 2, KERNEL_FORM_RINGS, raised_cosine, KERNEL_RAISED_COSINE,
     cosine_pulses(2)},
    {"raised_cosine_3_pulses", 156.25, 2, KERNEL_FORM_RINGS, raised_cosine, KERNEL_RAISED_COSINE,
     cosine_pulses(3)},
    {"sinc_2_pulses", 36, 1, KERNEL_FORM_RINGS, modulus_of_sinc, KERNEL_SINC, sinc_pulses(2)},
    {"sinc_3_pulses", 81, 1, KERNEL_FORM_RINGS, modulus_of_sinc, KERNEL_SINC, sinc_pulses(3)},
    {"beta", BETA_SUPPORT, 4, KERNEL_FORM_BETA,  // of shape 0; others: shaped_kernel.h
     [](Complex q) { return square(square((BETA_SUPPORT - q) / BETA_SUPPORT)); }},
    {"generalized_exponential", kInfinity, 0, KERNEL_FORM_EXPONENTIAL,  // of shape 0: a Gaussian
     [](Complex q) { return std::exp(-q / 2.0); }},
    {"ges_published", kInfinity, 0, KERNEL_FORM_GES,  // of every shape
     [](Complex q) { return std::exp(-q / 2.0); }},
}};

}  // namespace

const KernelProfile& listed_profile(int kernel) {
    if (kernel < 0 || kernel >= KERNEL_ROWS)
        throw Error(
            "kernel", fmt::format("{} is the number of none", kernel),
            fmt::format("Kernels are 0 to {}: shaders/shared/kernel_list.h.", KERNEL_ROWS - 1));
    return kRows[static_cast<std::size_t>(kernel)];
}

}  // namespace darb
