#include "engine/kernels/kernel_family.h"

#include <utility>
#include <vector>

#include "engine/core/check.h"
#include "engine/kernels/kernel_profile.h"

namespace darb {

const DerivedKernel& derived_kernel(int kernel) {
    static const auto kernels = [] {
        std::vector<DerivedKernel> all;
        for (int k = 0; k < KERNEL_ROWS; ++k) all.emplace_back(kernel_profile(k));
        return all;
    }();
    DARB_CHECK(kernel >= 0 && kernel < KERNEL_ROWS, "kernel = {}", kernel);
    return kernels[static_cast<std::size_t>(kernel)];
}

std::string_view kernel_name(int kernel) {
    return kernel_profile(kernel).name;
}

std::optional<int> kernel_from_name(std::string_view name) {
    for (int kernel = 0; kernel < KERNEL_ROWS; ++kernel)
        if (kernel_name(kernel) == name) return kernel;
    return std::nullopt;
}

std::optional<int> kernel_with_pulses(int kernel, int pulses) {
    const int base = kernel < KERNEL_COUNT ? kernel : kernel_profile(kernel).kernel;
    if (pulses == 1) return base;
    for (int row = KERNEL_COUNT; row < KERNEL_ROWS; ++row)
        if (kernel_profile(row).kernel == base && kernel_pulses(row) == pulses) return row;
    return std::nullopt;
}

int kernel_pulses(int kernel) {
    return kernel_profile(kernel).pulses.count;
}

bool has_exact_footprint(int kernel) {
    return kernel_profile(kernel).form != KERNEL_FORM_RINGS;
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

double kernel_value(int kernel, Footprint footprint, double q) {
    return derived_kernel(kernel).value(footprint, q);
}

double kernel_slope(int kernel, Footprint footprint, double q) {
    return derived_kernel(kernel).slope(footprint, q);
}

double kernel_reach(int kernel, Footprint footprint, double opacity, double cutoff) {
    return derived_kernel(kernel).reach(footprint, opacity, cutoff);
}

double kernel_psi(int kernel) {
    return derived_kernel(kernel).psi();
}

double covariance_scale(int kernel, Footprint footprint) {
    return derived_kernel(kernel).covariance_scale(footprint);
}

double equal_area_scale(int kernel, Footprint footprint) {
    return derived_kernel(kernel).equal_area_scale(footprint);
}

double kernel_radius_quantile(int kernel, double u) {
    return derived_kernel(kernel).radius_quantile(u);
}

}  // namespace darb
