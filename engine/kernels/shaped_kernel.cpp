#include "engine/kernels/shaped_kernel.h"

#include <algorithm>
#include <cmath>

#include "engine/kernels/profile_integrals.h"
#include "shaders/shared/kernel_forms.h"

namespace darb {
namespace {

double free_exponent(Footprint footprint, double shape) {
    return BETA_START * std::exp(shape) + (footprint == Footprint::exact ? 0.5 : 0.0);
}

/// b of the kernel in space.
double spatial_exponent(Footprint footprint, double exponent) {
    return exponent - (footprint == Footprint::exact ? 0.5 : 0.0);
}

}  // namespace

bool kernel_has_shape(int kernel) {
    return kernel == KERNEL_BETA;
}

double shape_exponent(Footprint footprint, double shape) {
    return std::clamp<double>(free_exponent(footprint, shape), EXPONENT_LEAST, EXPONENT_MOST);
}

double shape_exponent_slope(Footprint footprint, double shape) {
    const double exponent = free_exponent(footprint, shape);
    const bool held = !(exponent > EXPONENT_LEAST && exponent < EXPONENT_MOST);
    return held ? 0 : BETA_START * std::exp(shape);
}

double shape_of_exponent(double b) {
    return std::log(b / BETA_START);
}

ShapedValue shaped_value(double exponent, double q) {
    const double u = 1 - q / BETA_SUPPORT;
    if (!(u > 0)) return {};
    const double log_u = u > 0.5 ? std::log1p(-q / BETA_SUPPORT) : std::log(u);
    const double w = std::exp(exponent * log_u);
    return {w, -exponent * w / (u * BETA_SUPPORT), w * log_u};
}

double shaped_reach(double exponent, double opacity, double cutoff) {
    if (!(opacity >= cutoff)) return 0;
    return -BETA_SUPPORT * std::expm1(std::log(cutoff / opacity) / exponent);
}

double shaped_covariance_scale(Footprint footprint, double exponent) {
    return footprint == Footprint::psi ? BETA_SUPPORT / (2 * exponent + 5) : 1;
}

// In the plane the moment of (1 - q/R^2)^e per axis is R^2 / (2 e + 4).
double shaped_second_moment(Footprint footprint, double exponent) {
    return shaped_covariance_scale(footprint, exponent) * BETA_SUPPORT / (2 * exponent + 4);
}

std::vector<double> shaped_radius_quantiles(Footprint footprint, double exponent, int count) {
    constexpr int kSteps = 4096;
    const double b = spatial_exponent(footprint, exponent), radius = std::sqrt(BETA_SUPPORT);
    // x = sin^2 a of r = R x: even steps in a are fine at both ends, where the density is 0.
    const auto share = [](double step) {
        const double s = std::sin(std::acos(-1.0) / 2 * step / kSteps);
        return s * s;
    };
    std::vector<double> mass{0};
    for (int i = 0; i < kSteps; ++i) {
        const double x = share(i + 0.5), width = share(i + 1) - share(i);
        mass.push_back(mass.back() + width * x * x * std::pow(1 - x * x, b));
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

double shaped_relocation_scale(double exponent, double opacity, int count) {
    return relocation_scale_of([&](double q) { return shaped_value(exponent, q).w; }, BETA_SUPPORT,
                               opacity, count);
}

GaussianEquivalent shaped_gaussian(Footprint footprint, double exponent, bool keep_opacity) {
    return gaussian_equivalent_of([&](double q) { return shaped_value(exponent, q).w; },
                                  BETA_SUPPORT, shaped_covariance_scale(footprint, exponent),
                                  keep_opacity);
}

double shape_of_row(int row) {
    return SHAPE_FIRST + (SHAPE_LAST - SHAPE_FIRST) * row / (SHAPE_ROWS - 1);
}

}  // namespace darb
