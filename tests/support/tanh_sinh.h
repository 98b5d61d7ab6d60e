// SPDX-License-Identifier: MIT
// Tanh-sinh quadrature: an integrator for tests that shares nothing with engine/kernels, and does
// not mind singular derivatives at the ends.
#pragma once

#include <cmath>
#include <numbers>

namespace darb::test {

/// Integral of f over [from, to]; about 1e-14 relative for analytic integrands.
template <class F>
double integrate(F f, double from, double to) {
    const double middle = (from + to) / 2, half = (to - from) / 2, step = 1.0 / 64;
    double sum = 0;
    for (int k = -224; k <= 224; ++k) {
        const double s = std::numbers::pi / 2 * std::sinh(k * step);
        const double weight =
            std::numbers::pi / 2 * std::cosh(k * step) / std::pow(std::cosh(s), 2);
        sum += weight * f(middle + half * std::tanh(s));
    }
    return sum * step * half;
}

}  // namespace darb::test
