// SPDX-License-Identifier: MIT
// KernelTable: value and slope of one kernel and footprint, fast enough for the inner loop. The
// Gaussian and kernels with several pulses are computed directly. The others are tabulated once
// from engine/kernels as piecewise Chebyshev interpolants: in q for the kernels themselves, and in
// s = sqrt(1 - q / R^2) for the exact footprints, which are analytic in s up to their edge.
#pragma once

#include <vector>

#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_family.h"
#include "engine/kernels/shaped_kernel.h"

namespace darb::reference {

class KernelTable {
  public:
    /// polynomial_degree: 0, or the degree of the shaders' polynomial that replaces the profile.
    KernelTable(int kernel, Footprint footprint, int polynomial_degree = 0);

    /// As kernel_value and kernel_slope, to 1e-12 absolute; q >= 0. exponent: that of the splat;
    /// kernels without shapes ignore it.
    double value(double q, double exponent = 0) const;
    double slope(double q, double exponent = 0) const;
    /// d value / d exponent; 0 for kernels without shapes.
    double by_exponent(double q, double exponent) const;
    /// As kernel_reach, to 1e-13 of the support; found by bisection of value.
    double reach(double opacity, double cutoff, double exponent = 0) const;
    double covariance_scale(double exponent = 0) const;

  private:
    double evaluate(const std::vector<double>& table, double x) const;

    int kernel_;
    Footprint footprint_;
    const KernelCoefficients* in_place_ = nullptr;  // used instead of tables: a polynomial, or
                                                    // several pulses
    const ShapedKernel* shaped_;                    // not tabulated: each splat has its own
                                                    // exponent
    bool exact_;                                    // tabulated in s, else in q / R^2
    double support_;                                // R^2
    double covariance_scale_;
    std::vector<double> value_table_;  // [kPieces][kTerms] monomials in [-1, 1]; empty: gaussian
    std::vector<double> slope_table_;  // slope; for exact_, slope * s, which is finite at the edge
};

/// The table of a kernel and footprint, built on first use and kept. Thread-safe.
const KernelTable& kernel_table(int kernel, Footprint footprint, int polynomial_degree = 0);

}  // namespace darb::reference
