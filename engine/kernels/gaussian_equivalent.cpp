// SPDX-License-Identifier: MIT
// With area element dq (up to pi), I = integral w e^(-q/2c) dq and J = integral w q e^(-q/2c) dq:
//   |w - a e^(-q/2c)|^2 = integral w^2 - 2 a I + a^2 c, least over c where a c^2 = J, and over both
// where a = I/c, so c I = J.
#include "engine/kernels/gaussian_equivalent.h"

#include <cmath>

#include "engine/kernels/quadrature.h"

namespace darb {

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

}  // namespace darb
