// KernelTable: value and slope of one kernel and footprint, fast enough for the inner loop. The
// Gaussian is called as it is; the others are tabled once from engine/kernels as piecewise
// Chebyshev interpolants: in q for the kernels themselves, and in s = sqrt(1 - q / R^2) for the
// exact footprints, which are analytic in it up to their edge. Kernels with rings are called too.
#pragma once

#include <vector>

#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_family.h"
#include "engine/kernels/shaped_kernel.h"

namespace darb::reference {

class KernelTable {
  public:
    /// polynomial_degree: 0, or the degree of the shaders' polynomial that takes the profile's
    /// place.
    KernelTable(int kernel, Footprint footprint, int polynomial_degree = 0);

    /// As kernel_value and kernel_slope, to 1e-12 absolute; q >= 0. exponent: of the splat, which
    /// kernels without shapes do not read.
    double value(double q, double exponent = 0) const;
    double slope(double q, double exponent = 0) const;
    /// d value / d exponent; 0 without shapes.
    double by_exponent(double q, double exponent) const;
    /// As kernel_reach, to 1e-13 of the support; by bisection of value.
    double reach(double opacity, double cutoff, double exponent = 0) const;
    double covariance_scale(double exponent = 0) const;

  private:
    double evaluate(const std::vector<double>& table, double x) const;

    int kernel_;
    Footprint footprint_;
    const KernelCoefficients* in_place_ = nullptr;  // of the tables: a polynomial, or rings
    const ShapedKernel* shaped_;                    // not tabled: an exponent for each splat
    bool exact_;                                    // tabled in s, else in q / R^2
    double support_;                                // R^2
    double covariance_scale_;
    std::vector<double> value_table_;  // [kPieces][kTerms] monomials in [-1, 1]; empty: gaussian
    std::vector<double> slope_table_;  // of the slope; of slope * s, finite at the edge, if exact_
};

/// The table of a kernel and footprint, built on first use and kept; safe from several threads.
const KernelTable& kernel_table(int kernel, Footprint footprint, int polynomial_degree = 0);

}  // namespace darb::reference
