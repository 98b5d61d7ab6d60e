// SPDX-License-Identifier: MIT
#include "engine/kernels/kernel_profile.h"

#include <cmath>

#include "engine/kernels/shaped_kernel.h"

namespace darb {

namespace {

/// A blend at shape 0.
struct BlendStart {
    const ShapedKernel& kernel;
    double exponent;
};

std::optional<BlendStart> blend_start(int kernel, Footprint footprint) {
    if (!blend_parts(kernel)) return std::nullopt;
    const ShapedKernel& shaped = blend_kernel(kernel);
    return BlendStart{shaped, shaped.exponent(footprint, 0)};
}

}  // namespace

std::string_view kernel_name(int kernel) {
    return kernel_profile(kernel).name;
}

std::optional<int> kernel_with_pulses(int kernel, int pulses) {
    const bool rings = kernel_pulses(kernel) > 1;
    const int base = rings ? kernel_profile(kernel).kernel : kernel;
    if (pulses == 1) return base;
    for (int row = KERNEL_COUNT; row < KERNEL_ROWS; ++row)
        if (kernel_profile(row).kernel == base && kernel_pulses(row) == pulses) return row;
    return std::nullopt;
}

int shader_kernel(int kernel) {
    const int named = kernel_profile(kernel).kernel;
    return named >= 0 ? named : kernel;
}

int kernel_pulses(int kernel) {
    return kernel_profile(kernel).pulses.count;
}

std::string_view footprint_name(Footprint footprint) {
    return footprint == Footprint::psi ? "psi" : "exact";
}

std::optional<Footprint> footprint_from_name(std::string_view name) {
    for (const Footprint footprint : {Footprint::psi, Footprint::exact})
        if (footprint_name(footprint) == name) return footprint;
    return std::nullopt;
}

double kernel_support(int kernel) {
    return kernel_profile(kernel).support;
}

bool ends_with_a_jump(int kernel) {
    const KernelProfile& row = kernel_profile(kernel);
    return row.edge_order == 0 && std::isfinite(row.support);
}

double kernel_value(int kernel, Footprint footprint, double q) {
    if (const auto start = blend_start(kernel, footprint))
        return start->kernel.value(footprint, start->exponent, q).w;
    return derived_kernel(kernel).value(footprint, q);
}

double kernel_slope(int kernel, Footprint footprint, double q) {
    if (const auto start = blend_start(kernel, footprint))
        return start->kernel.value(footprint, start->exponent, q).slope;
    return derived_kernel(kernel).slope(footprint, q);
}

double kernel_reach(int kernel, Footprint footprint, double opacity, double cutoff) {
    if (const auto start = blend_start(kernel, footprint))
        return start->kernel.reach(footprint, start->exponent, opacity, cutoff);
    return derived_kernel(kernel).reach(footprint, opacity, cutoff);
}

double kernel_psi(int kernel) {
    if (const auto start = blend_start(kernel, Footprint::psi))
        return start->kernel.covariance_scale(Footprint::psi, start->exponent);
    return derived_kernel(kernel).psi();
}

double covariance_scale(int kernel, Footprint footprint) {
    if (const auto start = blend_start(kernel, footprint))
        return start->kernel.covariance_scale(footprint, start->exponent);
    return derived_kernel(kernel).covariance_scale(footprint);
}

// The area under a blend follows from those of its parts.
double equal_area_scale(int kernel, Footprint footprint) {
    if (const auto start = blend_start(kernel, footprint)) {
        const auto integral = [&](int k) {  // 2 for a Gaussian
            const double scale = equal_area_scale(k, footprint);
            return 2 / (scale * scale * covariance_scale(k, footprint));
        };
        const auto [first, second] = *blend_parts(kernel);
        const double m = start->exponent, both = (1 - m) * integral(first) + m * integral(second);
        return std::sqrt(2 / (covariance_scale(kernel, footprint) * both));
    }
    return derived_kernel(kernel).equal_area_scale(footprint);
}

double kernel_radius_quantile(int kernel, double u) {
    return derived_kernel(kernel).radius_quantile(u);
}

}  // namespace darb
