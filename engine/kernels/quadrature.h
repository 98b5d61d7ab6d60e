// Gauss-Legendre quadrature of even, analytic integrands over [0, end].
#pragma once

#include <span>

namespace darb {

struct QuadraturePoint {
    double x;       // in (0, 1)
    double weight;  // of the integral over [0, 1]
};

/// The positive half of the 64-point rule on [-1, 1]. For an integrand even about 0 that is
/// analytic near [-1, 1] it is exact to rounding, poles at +-i/3 included.
std::span<const QuadraturePoint> even_quadrature();

}  // namespace darb
