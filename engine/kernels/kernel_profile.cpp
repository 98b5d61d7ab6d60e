// SPDX-License-Identifier: MIT
#include "engine/kernels/kernel_profile.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/core/error.h"
#include "engine/kernels/shaped_kernel.h"

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
    {"beta", BETA_SUPPORT, 4, KERNEL_FORM_BETA,  // with shape 0; others: shaped_kernel.h
     [](Complex q) { return square(square((BETA_SUPPORT - q) / BETA_SUPPORT)); }},
    {"generalized_exponential", kInfinity, 0, KERNEL_FORM_EXPONENTIAL,  // with shape 0: a Gaussian
     [](Complex q) { return std::exp(-q / 2.0); }},
    {"ges_published", kInfinity, 0, KERNEL_FORM_GES,  // with every shape
     [](Complex q) { return std::exp(-q / 2.0); }},
}};

}  // namespace

const KernelProfile& listed_profile(int kernel) {
    if (kernel < 0 || kernel >= KERNEL_ROWS)
        throw Error(
            "kernel", fmt::format("there is none with the number {}", kernel),
            fmt::format("Kernels are 0 to {}: shaders/shared/kernel_list.h.", KERNEL_ROWS - 1));
    return kRows[static_cast<std::size_t>(kernel)];
}

// Everything that follows from a kernel's row. The exact footprint, with v = u (1 - s^2):
//   A(q) = 2 integral_0^sqrt(R^2-q) f(q + z^2) dz = 2 R sqrt(u) integral_0^1 f(R^2 (1 - v)) ds,
// and f = v^m g(v) with g analytic gives A = 2 R u^(m+1/2) integral (1 - s^2)^m g(v) ds: the
// integral is analytic in u, so a Chebyshev series holds it to rounding.

namespace {

constexpr int kNodes = 64;        // enough for a pole at q = -1 with support 9
constexpr double kNoise = 2e-15;  // noise of the samples: higher terms would spoil the derivative
constexpr double kStep = 1e-200;  // step of the complex-step derivative

double profile_value(const KernelProfile& row, double q) {
    return row.profile({q, 0}).real();
}

double footprint_integral(const KernelProfile& row, double u) {
    double sum = 0;
    for (const auto [s, weight] : even_quadrature()) {
        // v is recomputed from the rounded q, so that f and v^m belong to the same point.
        const double q = row.support * (1 - u * (1 - s * s));
        const double v = 1 - q / row.support;
        sum += weight * std::pow(1 - s * s, row.edge_order) * profile_value(row, q) /
               std::pow(v, row.edge_order);
    }
    return sum;
}

}  // namespace

ChebyshevSeries::ChebyshevSeries(const std::vector<double>& samples)
    : coefficients_(samples.size()) {
    const double n = static_cast<double>(samples.size());
    double largest = 0;
    for (std::size_t k = 0; k < samples.size(); ++k) {
        double sum = 0;
        for (std::size_t j = 0; j < samples.size(); ++j)
            sum += samples[j] * std::cos(std::numbers::pi * static_cast<double>(k) *
                                         (static_cast<double>(j) + 0.5) / n);
        coefficients_[k] = sum * (k == 0 ? 1 : 2) / n;
        largest = std::max(largest, std::abs(coefficients_[k]));
    }
    while (coefficients_.size() > 1 && std::abs(coefficients_.back()) < kNoise * largest)
        coefficients_.pop_back();
}

void ChebyshevSeries::evaluate(double u, double& value, double& derivative) const {
    const double x = 2 * u - 1;
    double b1 = 0, b2 = 0, d1 = 0, d2 = 0;  // Clenshaw, and its derivative by x
    for (std::size_t k = coefficients_.size() - 1; k > 0; --k) {
        const double d0 = 2 * b1 + 2 * x * d1 - d2;
        const double b0 = coefficients_[k] + 2 * x * b1 - b2;
        d2 = d1;
        d1 = d0;
        b2 = b1;
        b1 = b0;
    }
    value = coefficients_[0] + x * b1 - b2;
    derivative = 2 * (b1 + x * d1 - d2);
}

std::complex<double> ChebyshevSeries::value(std::complex<double> u) const {
    const std::complex<double> x = 2.0 * u - 1.0;
    std::complex<double> b1 = 0, b2 = 0;
    for (std::size_t k = coefficients_.size() - 1; k > 0; --k) {
        const std::complex<double> b0 = coefficients_[k] + 2.0 * x * b1 - b2;
        b2 = b1;
        b1 = b0;
    }
    return coefficients_[0] + x * b1 - b2;
}

DerivedKernel::DerivedKernel(const KernelProfile& row) : row_(row) {
    DARB_CHECK(row.edge_order >= 0 && row.support > 0, "kernel {}", row.name);
    DARB_CHECK((row.form == KERNEL_FORM_RINGS) == (row.pulses.count > 1), "kernel {}", row.name);
    const bool compact = std::isfinite(row.support);
    DARB_CHECK(compact || row.form == KERNEL_FORM_GAUSSIAN || row.form == KERNEL_FORM_EXPONENTIAL ||
                   row.form == KERNEL_FORM_GES,
               "kernel {}", row.name);
    find_pulses();
    radius_ = compact ? std::sqrt(pulses_.front().end) : kGaussRadius;
    radial_mass_ = radial_moment(radius_, 2);
    if (!compact) return;  // a Gaussian is its own footprint
    psi_ = scale_ = radial_moment(radius_, 4) / radial_mass_ / 3;
    if (row.form == KERNEL_FORM_RINGS) {
        const double whole = std::sqrt(row.support);
        psi_ = radial_moment(whole, 4) / radial_moment(whole, 2) / 3;
        return;
    }
    const double centre = footprint_integral(row, 1);
    std::vector<double> samples(kNodes);
    for (int j = 0; j < kNodes; ++j)
        samples[static_cast<std::size_t>(j)] =
            footprint_integral(row, (1 + std::cos(std::numbers::pi * (j + 0.5) / kNodes)) / 2) /
            centre;
    footprint_ = ChebyshevSeries(samples);
}

void DerivedKernel::find_pulses() {
    if (row_.pulses.count == 1) pulses_ = {{0, row_.support}};
    double from = 0, to = row_.pulses.first_end;
    for (int pulse = 0; pulse < row_.pulses.count && row_.pulses.count > 1; ++pulse) {
        double low = from * from, high = to * to;  // bracket the peak: w rises before it
        for (int step = 0; step < 80 && pulse > 0; ++step) {
            const double middle = (low + high) / 2;
            (slope(Footprint::psi, middle) > 0 ? low : high) = middle;
        }
        pulses_.push_back({low, to * to});
        from = to;
        to += row_.pulses.period;
    }
}

double DerivedKernel::radial_moment(double radius, int power) const {
    double total = 0, from = 0;
    for (const Pulse& pulse : pulses_) {  // smooth within each
        const double to = std::min(radius, std::sqrt(pulse.end));
        if (to <= from) break;
        const auto f = [&](double weight, double r) {
            return weight * std::pow(r, power) * profile_value(row_, r * r);
        };
        double sum = 0;
        if (from == 0)
            for (const auto [x, weight] : even_quadrature()) sum += f(weight, to * x);
        else
            sum = integrate_unit([&](double x) { return f(1, from + (to - from) * x); });
        total += sum * (to - from);
        from = to;
    }
    return total;
}

void DerivedKernel::footprint_parts(double q, double& u, double& p, double& dp) const {
    if (row_.form == KERNEL_FORM_RINGS)
        throw Error("kernel", fmt::format("{} has no exact footprint", row_.name),
                    "Use the footprint psi for kernels with several pulses.");
    u = (row_.support - q) / row_.support;
    footprint_.evaluate(u, p, dp);
}

double DerivedKernel::value(Footprint footprint, double q) const {
    if (q >= row_.support) return 0;
    if (footprint == Footprint::psi || !std::isfinite(row_.support)) return profile_value(row_, q);
    double u, p, dp;
    footprint_parts(q, u, p, dp);
    return std::pow(u, row_.edge_order) * std::sqrt(u) * p;
}

double DerivedKernel::slope(Footprint footprint, double q) const {
    if (q >= row_.support) return 0;
    if (footprint == Footprint::psi || !std::isfinite(row_.support))
        return row_.profile({q, kStep}).imag() / kStep;
    double u, p, dp;
    footprint_parts(q, u, p, dp);
    if (u <= 0) return 0;
    const double power = std::pow(u, row_.edge_order) / std::sqrt(u);
    return -power * ((row_.edge_order + 0.5) * p + u * dp) / row_.support;
}

double DerivedKernel::reach(Footprint footprint, double opacity, double cutoff) const {
    if (!(opacity >= cutoff)) return 0;
    double low = 0, high = 1;
    for (const Pulse& pulse : pulses_)  // the outermost pulse that shows, on its falling side
        if (pulse.peak > 0 && opacity * value(footprint, pulse.peak) >= cutoff) low = pulse.peak;
    high = std::max(high, low);
    while (high < row_.support && opacity * value(footprint, high) >= cutoff) high *= 2;
    high = std::min(high, row_.support);
    // The answer keeps opacity * value(high) < cutoff; 80 halvings reach neighbouring doubles.
    for (int step = 0; step < 80; ++step) {
        const double middle = (low + high) / 2;
        (opacity * value(footprint, middle) >= cutoff ? low : high) = middle;
    }
    return high;
}

double DerivedKernel::covariance_scale(Footprint footprint) const {
    return footprint == Footprint::psi ? scale_ : 1;
}

double DerivedKernel::equal_area_scale(Footprint footprint) const {
    if (!std::isfinite(row_.support)) return 1;
    // The area element is pi dq, a Gaussian's integral 2 pi; q = end (1 - s^2) makes half powers at
    // the edge analytic.
    const double end = pulses_.front().end;
    const double integral =
        integrate_unit([&](double s) { return 2 * end * s * value(footprint, end * (1 - s * s)); });
    return std::sqrt(2 / (covariance_scale(footprint) * integral));
}

double DerivedKernel::radius_quantile(double u) const {
    if (!(u >= 0 && u < 1))
        throw Error("kernel", fmt::format("{} is not a quantile", u),
                    "Quantiles are 0 or more, and below 1.");
    const double target = u * radial_mass_;
    double low = 0, high = radius_, r = radius_ * std::cbrt(u) / 2;
    // Newton, kept inside the bracket; the density r^2 w is positive inside the ball.
    for (int step = 0; step < 60 && high - low > 4e-16 * radius_; ++step) {
        const double excess = radial_moment(r, 2) - target;
        (excess < 0 ? low : high) = r;
        const double next = r - excess / (r * r * profile_value(row_, r * r));
        if (std::abs(next - r) < 1e-15 * radius_) break;
        r = next > low && next < high ? next : (low + high) / 2;
    }
    return r;
}

// With area element dq (up to pi), I = integral w e^(-q/2c) dq and J = integral w q e^(-q/2c) dq:
//   |w - a e^(-q/2c)|^2 = integral w^2 - 2 a I + a^2 c, least over c where a c^2 = J, and over both
// where a = I/c, so c I = J.

GaussianEquivalent gaussian_equivalent_of(const std::function<double(double)>& profile,
                                          double support, double scale, bool keep_opacity) {
    // u = s^2 makes half powers of u analytic; dq is 2 R^2 s ds.
    const auto integral = [&](auto f) {
        return 2 * support * integrate_unit([&](double s) {
                   const double q = support * (1 - s * s);
                   return s * f(q, profile(q));
               });
    };
    const auto overlap = [&](double c) {
        return integral([&](double q, double w) { return w * std::exp(-q / (2 * c)); });
    };
    const auto excess = [&](double c) {  // has the sign of c minus the root, and rises through 0
                                         // there
        const double j =
            integral([&](double q, double w) { return w * q * std::exp(-q / (2 * c)); });
        return (keep_opacity ? c * c : c * overlap(c)) - j;
    };
    double low = 1e-3 * support, high = 10 * support;
    for (int step = 0; step < 60; ++step) {
        const double middle = (low + high) / 2;
        (excess(middle) < 0 ? low : high) = middle;
    }
    const double square = integral([](double, double w) { return w * w; });
    const double a = keep_opacity ? 1 : overlap(high) / high;
    const double rest = square - 2 * a * overlap(high) + a * a * high;
    return {high * scale, a, std::sqrt(rest / square)};
}

GaussianEquivalent gaussian_equivalent(int kernel, Footprint footprint, bool keep_opacity) {
    const double support = kernel_support(kernel), scale = covariance_scale(kernel, footprint);
    if (!std::isfinite(support)) return {scale, 1, 0};
    return gaussian_equivalent_of([&](double q) { return kernel_value(kernel, footprint, q); },
                                  support, scale, keep_opacity);
}

namespace {

constexpr int kPoints = 64;

std::array<QuadraturePoint, kPoints / 2> gauss_legendre() {
    std::array<QuadraturePoint, kPoints / 2> rule{};
    for (int i = 0; i < kPoints / 2; ++i) {
        // Newton from Tricomi's estimate of the i-th root of the Legendre polynomial.
        long double x = std::cos(std::numbers::pi_v<long double> * (i + 0.75L) / (kPoints + 0.5L));
        long double derivative = 0;
        for (int step = 0; step < 20; ++step) {
            long double previous = 1, current = x;
            for (int n = 2; n <= kPoints; ++n) {
                const long double next = ((2 * n - 1) * x * current - (n - 1) * previous) / n;
                previous = current;
                current = next;
            }
            derivative = kPoints * (previous - x * current) / (1 - x * x);
            x -= current / derivative;
        }
        const long double weight = 2 / ((1 - x * x) * derivative * derivative);
        rule[static_cast<std::size_t>(i)] = {static_cast<double>(x), static_cast<double>(weight)};
    }
    return rule;
}

}  // namespace

std::span<const QuadraturePoint> even_quadrature() {
    static const auto rule = gauss_legendre();
    return rule;
}

// With q = r^2 the area element is pi dq, and the moment per axis is half of that of q. As in
// equal_area_scale, q = end (1 - s^2) makes half powers at the edge analytic.
double rendered_second_moment(int kernel, Footprint footprint) {
    if (blend_parts(kernel)) {
        const ShapedKernel& blend = blend_kernel(kernel);
        return blend.second_moment(footprint, blend.exponent(footprint, 0));
    }
    const DerivedKernel& k = derived_kernel(kernel);
    if (!std::isfinite(k.row().support)) return 1;
    const double end = k.pulses().front().end;
    const auto integral = [&](int power) {
        return integrate_unit([&](double s) {
            const double q = end * (1 - s * s);
            return 2 * end * s * (power == 1 ? q : 1) * k.value(footprint, q);
        });
    };
    return k.covariance_scale(footprint) * integral(1) / integral(0) / 2;
}

}  // namespace darb
