// SPDX-License-Identifier: MIT
#include "engine/kernels/shaped_kernel.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <memory>
#include <mutex>
#include <vector>

#include "engine/core/error.h"
#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_profile.h"
#include "shaders/shared/kernel_forms.h"

namespace darb {

/// Quantiles, at (k + 1/2) / count, of a density over [0, radius]; density(x) is that at the radius
/// x * radius. With x = sin^2 a, even steps in a are fine at both ends.
template <class Density>
std::vector<double> density_quantiles(double radius, int count, const Density& density) {
    constexpr int kSteps = 4096;
    const auto share = [](double step) {
        const double s = std::sin(std::acos(-1.0) / 2 * step / kSteps);
        return s * s;
    };
    std::vector<double> mass{0};
    for (int i = 0; i < kSteps; ++i) {
        const double x = share(i + 0.5), width = share(i + 1) - share(i);
        mass.push_back(mass.back() + width * density(x));
    }
    std::vector<double> quantiles;
    for (int k = 0; k < count; ++k) {
        const double target = (k + 0.5) / count * mass.back();
        const auto after = std::upper_bound(mass.begin(), mass.end(), target);
        const auto i = static_cast<int>(after - mass.begin()) - 1;
        const double within = (target - *(after - 1)) / (*after - *(after - 1));
        quantiles.push_back(radius * (share(i) + within * (share(i + 1) - share(i))));
    }
    return quantiles;
}

namespace {

struct Row {
    int kernel;
    const ShapedKernel& (*shaped)();
};
constexpr Row kShapedKernels[] = {{KERNEL_BETA, beta_kernel},
                                  {KERNEL_GENERALIZED_EXPONENTIAL, exponential_kernel},
                                  {KERNEL_GES_PUBLISHED, ges_kernel}};

const ShapedKernel* find(int kernel) {
    for (const Row& row : kShapedKernels)
        if (row.kernel == kernel) return &row.shaped();
    return blend_parts(kernel) ? &blend_kernel(kernel) : nullptr;
}

}  // namespace

double ShapedKernel::relocation_scale(Footprint footprint, double exponent, double opacity,
                                      int count) const {
    return relocation_scale_of([&](double q) { return value(footprint, exponent, q).w; },
                               extent(exponent), opacity, count);
}

GaussianEquivalent ShapedKernel::gaussian(Footprint footprint, double exponent,
                                          bool keep_opacity) const {
    return gaussian_equivalent_of([&](double q) { return value(footprint, exponent, q).w; },
                                  extent(exponent), covariance_scale(footprint, exponent),
                                  keep_opacity);
}

double ShapedKernel::shape_of_row(int row) const {
    return first_shape() + (last_shape() - first_shape()) * row / (SHAPE_ROWS - 1);
}

bool kernel_has_shape(int kernel) {
    return find(kernel) != nullptr;
}

const ShapedKernel& shaped_kernel(int kernel) {
    const ShapedKernel* row = find(kernel);
    if (row == nullptr)
        throw Error("kernel", fmt::format("{} has no shape per splat", kernel_name(kernel)),
                    "Ask kernel_has_shape first.");
    return *row;
}

std::vector<int> shaped_kernels() {
    std::vector<int> kernels;
    for (const Row& row : kShapedKernels) kernels.push_back(row.kernel);
    return kernels;
}

double splat_exponent(int kernel, Footprint footprint, double shape) {
    const ShapedKernel* row = find(kernel);
    return row != nullptr ? row->exponent(footprint, shape) : 0;
}

// The kernel `beta`: everything but its quantiles has a closed form.

namespace {

double free_exponent(Footprint footprint, double shape) {
    return BETA_START * std::exp(shape) + (footprint == Footprint::exact ? 0.5 : 0.0);
}

class BetaKernel : public ShapedKernel {
  public:
    double exponent_least() const override { return BETA_EXPONENT_LEAST; }
    double exponent_most() const override { return BETA_EXPONENT_MOST; }
    double first_shape() const override { return -2.1; }
    double last_shape() const override { return 2.8; }

    double exponent(Footprint footprint, double shape) const override {
        return std::clamp<double>(free_exponent(footprint, shape), exponent_least(),
                                  exponent_most());
    }

    double exponent_slope(Footprint footprint, double shape) const override {
        const double exponent = free_exponent(footprint, shape);
        const bool held = !(exponent > exponent_least() && exponent < exponent_most());
        return held ? 0 : BETA_START * std::exp(shape);
    }

    ShapedValue value(Footprint, double exponent, double q) const override {
        const double u = 1 - q / BETA_SUPPORT;
        if (!(u > 0)) return {};
        const double log_u = u > 0.5 ? std::log1p(-q / BETA_SUPPORT) : std::log(u);
        const double w = std::exp(exponent * log_u);
        return {w, -exponent * w / (u * BETA_SUPPORT), w * log_u};
    }

    double extent(double) const override { return BETA_SUPPORT; }

    double reach(Footprint, double exponent, double opacity, double cutoff) const override {
        if (!(opacity >= cutoff)) return 0;
        return -BETA_SUPPORT * std::expm1(std::log(cutoff / opacity) / exponent);
    }

    double covariance_scale(Footprint footprint, double exponent) const override {
        return footprint == Footprint::psi ? BETA_SUPPORT / (2 * exponent + 5) : 1;
    }

    double length_slope(Footprint footprint, double exponent) const override {
        return footprint == Footprint::psi ? -1 / (2 * exponent + 5) : 0;
    }

    // In the plane the moment of (1 - q/R^2)^e per axis is R^2 / (2 e + 4).
    double second_moment(Footprint footprint, double exponent) const override {
        return covariance_scale(footprint, exponent) * BETA_SUPPORT / (2 * exponent + 4);
    }

    std::vector<double> radius_quantiles(Footprint footprint, double exponent,
                                         int count) const override {
        const double b = exponent - (footprint == Footprint::exact ? 0.5 : 0.0);
        return density_quantiles(std::sqrt(BETA_SUPPORT), count,
                                 [&](double x) { return x * x * std::pow(1 - x * x, b); });
    }

    double rounding(double exponent) const override {
        return 2e-7 + 2e-7 * exponent;  // rounding of the logarithm
    }

    std::vector<double> exponents_to_check() const override {
        return {BETA_EXPONENT_LEAST, 2.5, BETA_START, 20, BETA_EXPONENT_MOST};
    }
};

}  // namespace

const ShapedKernel& beta_kernel() {
    static const BetaKernel kernel;
    return kernel;
}

double beta_shape_of(double b) {
    return std::log(b / BETA_START);
}

// Blends of two listed kernels, w = (1 - m) w1 + m w2, with m from splat to splat. With the exact
// footprint, m weights the line integrals divided by their values at the centre. Everything follows
// from the two kernels.

namespace {

constexpr double kMostShape = 30;  // 1 - m is above rounding
constexpr double kLastShape = 6;   // last row of the tables: m within 0.25 % of 0 and 1

class BlendKernel : public ShapedKernel {
  public:
    explicit BlendKernel(const std::array<int, 2>& kernels) : kernels_(kernels) {
        for (std::size_t i = 0; i < 2; ++i) {
            const DerivedKernel& k = derived_kernel(kernels[i]);
            const double radius = std::sqrt(end_of(i));
            facts_.second[i] = k.radial_moment(radius, 2);
            facts_.fourth[i] = k.radial_moment(radius, 4) / 3;
            facts_.centre[i] = k.radial_moment(radius, 0);
            for (const Footprint f : {Footprint::psi, Footprint::exact}) {
                const auto integral = [&](int power) {
                    return integrate_unit([&](double s) {
                        const double q = end_of(i) * (1 - s * s);
                        return 2 * end_of(i) * s * std::pow(q, power) * k.value(f, q);
                    });
                };
                plane_[static_cast<std::size_t>(f)][i] = {integral(0), integral(1)};
            }
        }
    }

    const BlendFacts& facts() const { return facts_; }

    double exponent_least() const override { return 0; }
    double exponent_most() const override { return 1; }
    double first_shape() const override { return -kLastShape; }
    double last_shape() const override { return kLastShape; }

    double exponent(Footprint footprint, double shape) const override {
        const double m = sigmoid_of(shape);
        return footprint == Footprint::exact ? m * facts_.centre[1] / between(facts_.centre, m) : m;
    }

    double exponent_slope(Footprint footprint, double shape) const override {
        if (!(std::abs(shape) < kMostShape)) return 0;
        const double m = sigmoid_of(shape), centre = between(facts_.centre, m);
        return m * (1 - m) *
               (footprint == Footprint::exact
                    ? facts_.centre[0] * facts_.centre[1] / (centre * centre)
                    : 1);
    }

    ShapedValue value(Footprint footprint, double m, double q) const override {
        double w[2], slope[2];
        for (std::size_t i = 0; i < 2; ++i) {
            w[i] = kernel_value(kernels_[i], footprint, q);
            slope[i] = kernel_slope(kernels_[i], footprint, q);
        }
        return {w[0] + m * (w[1] - w[0]), slope[0] + m * (slope[1] - slope[0]), w[1] - w[0]};
    }

    double extent(double) const override { return std::max(end_of(0), end_of(1)); }

    double reach(Footprint footprint, double m, double opacity, double cutoff) const override {
        double low = 0, high = 0;
        for (const int k : kernels_)
            high = std::max(high, kernel_reach(k, footprint, opacity, cutoff));
        for (int step = 0; step < 60; ++step) {
            const double middle = (low + high) / 2;
            (opacity * value(footprint, m, middle).w >= cutoff ? low : high) = middle;
        }
        return high;
    }

    double covariance_scale(Footprint footprint, double m) const override {
        return footprint == Footprint::psi ? between(facts_.fourth, m) / between(facts_.second, m)
                                           : 1;
    }

    double length_slope(Footprint footprint, double m) const override {
        if (footprint != Footprint::psi) return 0;
        const auto share = [&](const std::array<double, 2>& of) {
            return (of[1] - of[0]) / between(of, m);
        };
        return (share(facts_.fourth) - share(facts_.second)) / 2;
    }

    double second_moment(Footprint footprint, double m) const override {
        const auto& plane = plane_[static_cast<std::size_t>(footprint)];
        const double mass = (1 - m) * plane[0].mass + m * plane[1].mass;
        const double moment = (1 - m) * plane[0].moment + m * plane[1].moment;
        return covariance_scale(footprint, m) * moment / mass / 2;
    }

    std::vector<double> radius_quantiles(Footprint footprint, double m, int count) const override {
        const auto& [first, second] = facts_.centre;
        const double space =
            footprint == Footprint::exact ? m * first / (m * first + (1 - m) * second) : m;
        const double end = extent(m);
        return density_quantiles(std::sqrt(end), count, [&](double x) {
            return x * x * value(Footprint::psi, space, end * x * x).w;
        });
    }

    double rounding(double) const override {
        double most = 0;
        for (const Footprint f : {Footprint::psi, Footprint::exact})
            for (const int k : kernels_) {
                const KernelCoefficients& c = kernel_coefficients(k, f, kFullDegree);
                most = std::max(most, float_rounding(c) + 1.1 * c.value_error);
            }
        return most + 1e-7;
    }

    std::vector<double> exponents_to_check() const override { return {0, 0.25, 0.5, 0.9, 1}; }

  private:
    static double sigmoid_of(double shape) {
        return 1 / (1 + std::exp(-std::clamp(shape, -kMostShape, kMostShape)));
    }
    static double between(const std::array<double, 2>& of, double m) {
        return of[0] + m * (of[1] - of[0]);
    }
    double end_of(std::size_t i) const {
        return std::min(kernel_support(kernels_[i]), kGaussRadius * kGaussRadius);
    }

    struct Plane {
        double mass = 0, moment = 0;
    };
    std::array<int, 2> kernels_;
    BlendFacts facts_;
    std::array<std::array<Plane, 2>, 2> plane_;
};

/// Built at first use; entries never move.
struct Blend {
    std::once_flag once;
    std::unique_ptr<const BlendKernel> shaped;
    std::string name;
    KernelProfile row{};
};

Blend& blend_of(int kernel) {
    static std::array<Blend, KERNEL_COUNT * KERNEL_COUNT> all;
    Blend& blend = all[static_cast<std::size_t>(kernel - KERNEL_BLENDS)];
    std::call_once(blend.once, [&] {
        const std::array<int, 2> parts = *blend_parts(kernel);
        const KernelProfile &first = listed_profile(parts[0]), &second = listed_profile(parts[1]);
        blend.shaped = std::make_unique<const BlendKernel>(parts);
        blend.name = fmt::format("{}{},{}", kBlendMark, first.name, second.name);
        blend.row = {blend.name,
                     std::max(first.support, second.support),
                     std::min(first.edge_order, second.edge_order),
                     KERNEL_FORM_BLEND,
                     [first, second](std::complex<double> q) {
                         const auto part = [&](const KernelProfile& k) {
                             return q.real() < k.support ? k.profile(q) : 0.0;
                         };
                         return (part(first) + part(second)) / 2.0;
                     },
                     parts[0]};
    });
    return blend;
}

}  // namespace

std::optional<std::array<int, 2>> blend_parts(int kernel) {
    const int at = kernel - KERNEL_BLENDS;
    if (at < 0 || at >= KERNEL_COUNT * KERNEL_COUNT || at / KERNEL_COUNT == at % KERNEL_COUNT)
        return std::nullopt;
    return std::array{at / KERNEL_COUNT, at % KERNEL_COUNT};
}

const ShapedKernel& blend_kernel(int kernel) {
    return *blend_of(kernel).shaped;
}

const BlendFacts& blend_facts(int kernel) {
    return blend_of(kernel).shaped->facts();
}

const KernelProfile& blend_profile(int kernel) {
    return blend_of(kernel).row;
}

std::optional<int> blend_from_name(std::string_view name) {
    const std::size_t comma = name.find(',');
    if (!name.starts_with(kBlendMark) || comma == std::string_view::npos) return std::nullopt;
    const auto listed = [](std::string_view part) {
        part.remove_prefix(std::min(part.find_first_not_of(' '), part.size()));
        while (part.ends_with(' ')) part.remove_suffix(1);
        for (int k = 0; k < KERNEL_COUNT; ++k)
            if (listed_profile(k).name == part) return k;
        return -1;
    };
    const int first = listed(name.substr(kBlendMark.size(), comma - kBlendMark.size()));
    const int second = listed(name.substr(comma + 1));
    if (first < 0 || second < 0 || first == second) return std::nullopt;
    return blend_of(first, second);
}

// The kernel `generalized_exponential`. With q + s = r^2 and no softening its moments are gamma
// functions: integral r^n exp(-r^t / 2) dr = 2^((n+1)/t) Gamma((n+1)/t) / t.

namespace {

constexpr double kNothing = 40;  // r^t where w is 2e-9

/// ln psi = (x - 1/2) P(x), x = 1/t, and its derivative by x. P interpolates
/// 2 x ln 2 + ln Gamma(5x) - ln Gamma(3x) - ln 3 over x - 1/2 to 7e-5; psi is 1 at t = 2.
double log_psi(double x, double& slope) {
    constexpr double kP[] = {EXPONENTIAL_PSI};
    double p = 0, dp = 0;
    for (int k = static_cast<int>(std::size(kP)) - 1; k >= 0; --k) {
        dp = dp * x + p;
        p = p * x + kP[k];
    }
    slope = p + (x - 0.5) * dp;
    return (x - 0.5) * p;
}

class ExponentialKernel : public ShapedKernel {
  public:
    double exponent_least() const override { return EXPONENTIAL_LEAST; }
    double exponent_most() const override { return EXPONENTIAL_MOST; }
    double first_shape() const override { return std::log(EXPONENTIAL_LEAST / EXPONENTIAL_START); }
    double last_shape() const override { return std::log(EXPONENTIAL_MOST / EXPONENTIAL_START); }

    double exponent(Footprint, double shape) const override {
        return std::clamp<double>(EXPONENTIAL_START * std::exp(shape), exponent_least(),
                                  exponent_most());
    }

    double exponent_slope(Footprint, double shape) const override {
        const double t = EXPONENTIAL_START * std::exp(shape);
        return t > exponent_least() && t < exponent_most() ? t : 0;
    }

    ShapedValue value(Footprint, double t, double q) const override {
        const double v = std::min(q, 1e30) + EXPONENTIAL_SOFTENING;
        const double p = std::pow(v, t / 2), first = std::pow(EXPONENTIAL_SOFTENING, t / 2);
        const double w = std::exp((first - p) / 2);
        const double by_exponent =
            -w / 4 * (p * std::log(v) - first * std::log(EXPONENTIAL_SOFTENING));
        return {w, w > 0 ? -t / 4 * p / v * w : 0, w > 0 ? by_exponent : 0};
    }

    double extent(double t) const override { return std::pow(kNothing, 2 / t); }

    double reach(Footprint, double t, double opacity, double cutoff) const override {
        if (!(opacity >= cutoff)) return 0;
        const double first = std::pow(EXPONENTIAL_SOFTENING, t / 2);
        return std::pow(first + 2 * std::log(opacity / cutoff), 2 / t) - EXPONENTIAL_SOFTENING;
    }

    double covariance_scale(Footprint footprint, double t) const override {
        double slope;
        return footprint == Footprint::psi ? std::exp(log_psi(1 / t, slope)) : 1;
    }

    double length_slope(Footprint footprint, double t) const override {
        double slope;
        log_psi(1 / t, slope);
        return footprint == Footprint::psi ? -slope / (2 * t * t) : 0;
    }

    double second_moment(Footprint footprint, double t) const override {
        const double plane =
            std::exp(2 / t * std::log(2.0) + std::lgamma(4 / t) - std::lgamma(2 / t)) / 2;
        return covariance_scale(footprint, t) * plane;
    }

    std::vector<double> radius_quantiles(Footprint footprint, double t, int count) const override {
        const double radius = std::sqrt(extent(t));
        return density_quantiles(radius, count, [&](double x) {
            return x * x * value(footprint, t, radius * radius * x * x).w;
        });
    }

    double rounding(double t) const override { return 5e-7 + 1e-7 * t; }

    std::vector<double> exponents_to_check() const override {
        return {EXPONENTIAL_LEAST, 1.5, EXPONENTIAL_START, 4, EXPONENTIAL_MOST};
    }
};

}  // namespace

const ShapedKernel& exponential_kernel() {
    static const ExponentialKernel kernel;
    return kernel;
}

// The kernel `ges_published`: the same Gaussian for every exponent, and a factor on its lengths.

namespace {

constexpr double kExtent = 42;  // w is below 1e-9

double factor(double t) {
    return 2 / (1 + std::exp(-GES_STRENGTH * (t - GES_START)));
}

class GesKernel : public ShapedKernel {
  public:
    double exponent_least() const override { return GES_LEAST; }
    double exponent_most() const override { return GES_MOST; }
    double first_shape() const override { return GES_LEAST - GES_START; }
    double last_shape() const override { return GES_MOST - GES_START; }

    double exponent(Footprint, double shape) const override {
        return std::clamp<double>(GES_START + shape, exponent_least(), exponent_most());
    }

    double exponent_slope(Footprint, double shape) const override {
        const double t = GES_START + shape;
        return t > exponent_least() && t < exponent_most() ? 1 : 0;
    }

    ShapedValue value(Footprint, double, double q) const override {
        const double w = std::exp(-q / 2);
        return {w, -w / 2, 0};
    }

    double extent(double) const override { return kExtent; }

    double reach(Footprint, double, double opacity, double cutoff) const override {
        return opacity >= cutoff ? 2 * std::log(opacity / cutoff) : 0;
    }

    double covariance_scale(Footprint, double t) const override { return factor(t) * factor(t); }

    double length_slope(Footprint, double t) const override {
        return GES_STRENGTH * (1 - factor(t) / 2);
    }

    double second_moment(Footprint footprint, double t) const override {
        return covariance_scale(footprint, t);
    }

    std::vector<double> radius_quantiles(Footprint, double, int count) const override {
        return density_quantiles(std::sqrt(kExtent), count,
                                 [](double x) { return x * x * std::exp(-kExtent * x * x / 2); });
    }

    double rounding(double) const override { return 3e-7; }

    std::vector<double> exponents_to_check() const override {
        return {GES_LEAST, -8, GES_START, 12, GES_MOST};
    }
};

}  // namespace

const ShapedKernel& ges_kernel() {
    static const GesKernel kernel;
    return kernel;
}

}  // namespace darb
