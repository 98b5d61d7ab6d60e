// SPDX-License-Identifier: MIT
// The correction factor psi of a kernel in three ways: the paper's experiment on a grid, the exact
// ratio of moments, and the best scale by least squares; and how far each footprint is from the
// true projection. Source: DARB-Splatting, arXiv 2501.12369, section on splatting and its
// supplement.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_profile.h"

namespace darb {

struct PsiGridOptions {
    int samples = 24;  // number of random covariances, at least 1
    int cells = 64;    // cells of the grid along each axis, at least 8
    std::uint64_t seed = 0;
};

struct PsiSpread {
    double median = 0, low = 0, high = 0, deviation = 0;  // least, largest, standard deviation
};

/// Distance of peak-normalised profiles over the image plane. The truth is the line integral of the
/// 3D kernel, by quadrature.
struct FootprintDistance {
    double l2 = 0;    // relative to the truth
    double linf = 0;  // largest difference
};

struct PsiResult {
    std::string kernel;
    double support = 0;                         // R^2; infinity for the Gaussian
    std::array<PsiSpread, 3> grid;              // entries xx, xy, yy of projected over 3D
                                                // covariance
    double exact = 1;                           // (1/3) integral r^4 w / integral r^2 w
    double best = 1;                            // least squares over the image plane
    FootprintDistance by_psi, by_best, by_one;  // with the covariance times exact, best, and 1
    FootprintDistance by_exact_footprint;       // as the shaders compute it, in float32
};

/// The profile of the true projection at q, 1 at q = 0: by quadrature along the line of sight.
double projected_profile(const DerivedKernel& kernel, double q);

/// The paper's experiment. Covariances have random axes, standard deviations of 0.5 to 2, and a
/// correlation of x and y of at least 0.2, so that the ratio of xy is meaningful; means are random.
/// The cells fill the bounding box of the support (6 standard deviations for the Gaussian).
std::array<PsiSpread, 3> psi_on_grid(const DerivedKernel& kernel, const PsiGridOptions& options);

double least_squares_psi(const DerivedKernel& kernel);

/// Compares profile w, with the covariance times scale, with the true projection.
FootprintDistance footprint_distance(const DerivedKernel& kernel, double scale);
FootprintDistance footprint_distance(const DerivedKernel& kernel, const KernelCoefficients& exact);

PsiResult measure_psi(const DerivedKernel& kernel, const PsiGridOptions& options);

}  // namespace darb
