#include "engine/kernels/shaped_kernel.h"

#include <fmt/format.h>

#include "engine/core/error.h"
#include "engine/kernels/profile_integrals.h"
#include "shaders/shared/kernel_forms.h"

namespace darb {
namespace {

struct Row {
    int kernel;
    const ShapedKernel& (*shaped)();
};
constexpr Row kShapedKernels[] = {{KERNEL_BETA, beta_kernel},
                                  {KERNEL_GENERALIZED_EXPONENTIAL, exponential_kernel},
                                  {KERNEL_GES_PUBLISHED, ges_kernel}};

const ShapedKernel* find(int kernel) {
    for (const Row& row : kShapedKernels)
        if (row.kernel == kernel) return &row.shaped();
    return blend_parts(kernel) ? &blend_kernel(kernel) : nullptr;
}

}  // namespace

double ShapedKernel::relocation_scale(Footprint footprint, double exponent, double opacity,
                                      int count) const {
    return relocation_scale_of([&](double q) { return value(footprint, exponent, q).w; },
                               extent(exponent), opacity, count);
}

GaussianEquivalent ShapedKernel::gaussian(Footprint footprint, double exponent,
                                          bool keep_opacity) const {
    return gaussian_equivalent_of([&](double q) { return value(footprint, exponent, q).w; },
                                  extent(exponent), covariance_scale(footprint, exponent),
                                  keep_opacity);
}

double ShapedKernel::shape_of_row(int row) const {
    return first_shape() + (last_shape() - first_shape()) * row / (SHAPE_ROWS - 1);
}

bool kernel_has_shape(int kernel) {
    return find(kernel) != nullptr;
}

const ShapedKernel& shaped_kernel(int kernel) {
    const ShapedKernel* row = find(kernel);
    if (row == nullptr)
        throw Error("kernel", fmt::format("{} has no shape of each splat", kernel_name(kernel)),
                    "Ask kernel_has_shape first.");
    return *row;
}

std::vector<int> shaped_kernels() {
    std::vector<int> kernels;
    for (const Row& row : kShapedKernels) kernels.push_back(row.kernel);
    return kernels;
}

double splat_exponent(int kernel, Footprint footprint, double shape) {
    const ShapedKernel* row = find(kernel);
    return row != nullptr ? row->exponent(footprint, shape) : 0;
}

}  // namespace darb
