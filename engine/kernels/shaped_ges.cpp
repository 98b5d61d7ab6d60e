// The kernel `ges_published`: a Gaussian of every exponent, and a factor of its lengths.
#include <algorithm>
#include <cmath>

#include "engine/kernels/density_quantiles.h"
#include "engine/kernels/shaped_kernel.h"
#include "shaders/shared/kernel_forms.h"

namespace darb {
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
