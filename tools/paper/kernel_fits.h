// How the shaders have kernels: the form, the degree and the error of their polynomials, and of a
// kernel of one's own what it was made from.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace darb {

struct KernelFit {
    int kernel = 0;
    std::string form;         // "(1 - t)^2 P4(t)", "2^n P5(f)", ...
    double error = 0;         // of w, largest; of the Gaussian relative
    double exact_error = 0;   // of the exact footprint; NaN where there is none
    std::string source;       // empty for the kernels of the family
    double source_error = 0;  // of the kernel from what source says
};

std::vector<KernelFit> fits_of(const std::vector<int>& kernels);
/// What the exponents of splats do to psi and to the width that is drawn; empty without any such
/// kernel.
std::string shapes_table(const std::vector<int>& kernels);
nlohmann::json shapes_json(const std::vector<int>& kernels);
std::string fits_table(const std::vector<KernelFit>& fits);
nlohmann::json fits_json(const std::vector<KernelFit>& fits);
std::string fits_html(const std::vector<KernelFit>& fits);

}  // namespace darb
