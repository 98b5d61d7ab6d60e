// The kernel `beta`: everything of it has a closed form but the quantiles.
#include <algorithm>
#include <cmath>

#include "engine/kernels/density_quantiles.h"
#include "engine/kernels/shaped_kernel.h"
#include "shaders/shared/kernel_forms.h"

namespace darb {
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
        return 2e-7 + 2e-7 * exponent;  // of the logarithm
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

}  // namespace darb
