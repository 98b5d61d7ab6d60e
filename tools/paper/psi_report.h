// SPDX-License-Identifier: MIT
// The results of `darb psi` as a table, as JSON and as a page of plots.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/paper/psi_measure.h"

namespace darb {

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
std::string fits_html(const std::vector<KernelFit>& fits);

std::string psi_table(const std::vector<PsiResult>& results);
nlohmann::json psi_json(const std::vector<PsiResult>& results, const PsiGridOptions& options);
/// kernels and fits: those of the results, in order.
std::string psi_html(const std::vector<PsiResult>& results,
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
