// SPDX-License-Identifier: MIT
// Gauss-Legendre quadrature for analytic integrands over [0, 1], especially even ones.
#pragma once

#include <functional>
#include <span>

#include "engine/kernels/gaussian_equivalent.h"

namespace darb {

struct QuadraturePoint {
    double x;       // in (0, 1)
    double weight;  // for the integral over [0, 1]
};

/// The positive half of the 64-point rule on [-1, 1]. For an integrand that is even about 0 and
/// analytic near [-1, 1], it is exact to rounding, even with poles at +-i/3.
std::span<const QuadraturePoint> even_quadrature();

/// Where an integral over a Gaussian's distance may end, standard deviations: only exp(-40) of the
/// mass is beyond.
constexpr double kGaussRadius = 9;

/// Integral of f over [0, 1] by the same rule with all its 64 points; f must be analytic.
template <class F>
double integrate_unit(F f) {
    double sum = 0;
    for (const auto [x, weight] : even_quadrature())
        sum += weight / 2 * (f((1 + x) / 2) + f((1 - x) / 2));
    return sum;
}

// What follows from a rendered profile alone, for kernels with tables and those in closed form:
// w(q) on [0, support], where the support is finite, or ends where a Gaussian is below rounding.

/// relocation_scale for this profile. radius: the square root of its support, or where a Gaussian
/// is below rounding.
double relocation_scale_of(const std::function<double(double)>& w, double support, double opacity,
                           int count);
/// gaussian_equivalent for a profile with this support, whose covariance is multiplied by `scale`.
GaussianEquivalent gaussian_equivalent_of(const std::function<double(double)>& w, double support,
                                          double scale, bool keep_opacity);

}  // namespace darb
