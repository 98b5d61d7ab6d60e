// The kernel `generalized_exponential`. With q + s = r^2 and no softening its moments are gamma
// functions: integral r^n exp(-r^t / 2) dr = 2^((n+1)/t) Gamma((n+1)/t) / t.
#include <algorithm>
#include <cmath>
#include <iterator>

#include "engine/kernels/density_quantiles.h"
#include "engine/kernels/shaped_kernel.h"
#include "shaders/shared/kernel_forms.h"

namespace darb {
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

}  // namespace darb
