// SPDX-License-Identifier: MIT
// The results of `darb psi` as a table, as JSON and as a page of plots.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/report/report.h"

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

struct KernelFit {
    int kernel = 0;
    std::string form;         // "(1 - t)^2 P4(t)", "2^n P5(f)", ...
    double error = 0;         // largest error of w; relative for the Gaussian
    double exact_error = 0;   // error of the exact footprint; NaN where there is none
    std::string source;       // what a user's own kernel was made from; else empty
    double source_error = 0;  // distance of the kernel from its source
};

std::vector<KernelFit> fits_of(const std::vector<int>& kernels);
/// How the exponents of splats change psi and the drawn width; empty where no kernel has shapes.
std::string shapes_table(const std::vector<int>& kernels);
nlohmann::json shapes_json(const std::vector<int>& kernels);
std::string fits_table(const std::vector<KernelFit>& fits);
nlohmann::json fits_json(const std::vector<KernelFit>& fits);

std::string psi_table(const std::vector<PsiResult>& results);
nlohmann::json psi_json(const std::vector<PsiResult>& results, const PsiGridOptions& options);
/// kernels and fits: those of the results, in order.
Report psi_report(const std::vector<PsiResult>& results,
                  const std::vector<const DerivedKernel*>& kernels,
                  const std::vector<KernelFit>& fits, const PsiGridOptions& options);

// The pulses that the paper's limits remove: raised cosine and sinc oscillate beyond their first
// pulse. This measures what more pulses would do to psi, and to where the mass of a splat lies.

struct Rings {
    int kernel = 0;  // KERNEL_RAISED_COSINE or KERNEL_SINC, the latter as its modulus |sin x / x|
    int pulses = 1;
    double radius = 0;  // radius of the support, standard deviations
    double psi = 1;
    double outside = 0;  // share of the 3D integral that lies beyond the first pulse
};

/// kernel with this many pulses; the family must have such a row.
Rings rings_of(int kernel, int pulses);

/// Both kernels with 1, 2 and 3 pulses.
std::vector<Rings> all_rings();

}  // namespace darb
