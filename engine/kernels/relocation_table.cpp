// SPDX-License-Identifier: MIT
#include "engine/kernels/relocation_table.h"

#include <fmt/format.h>

#include <cmath>

#include "engine/core/error.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/shaped_kernel.h"
#include "shaders/shared/kernel_forms.h"

namespace darb {

double relocation_opacity(double opacity, int count) {
    if (!(opacity >= 0 && opacity <= 1) || count < 1)
        throw Error("relocation",
                    fmt::format("cannot be computed for {} splats of opacity {}", count, opacity),
                    "Give at least one, with an opacity between 0 and 1.");
    return -std::expm1(std::log1p(-opacity) / count);
}

double relocation_scale_of(const std::function<double(double)>& profile, double support,
                           double opacity, int count) {
    const double part = relocation_opacity(opacity, count);
    if (part <= 0) return 1;  // the limit for opacity -> 0
    const double radius = std::isfinite(support) ? std::sqrt(support) : kGaussRadius;
    double before = 0, after = 0;
    // t = R (1 - s^2) makes roots of u = 1 - t^2/R^2 analytic in s; dt is 2 R s ds.
    for (const auto [x, weight] : even_quadrature())
        for (const double s : {(1 + x) / 2, (1 - x) / 2}) {
            const double t = radius * (1 - s * s);
            const double w = profile(t * t);
            before += weight * s * opacity * w;
            after -= weight * s * std::expm1(count * std::log1p(-part * w));
        }
    return before / after;
}

double relocation_scale(int kernel, Footprint footprint, double opacity, int count) {
    return relocation_scale_of([&](double q) { return kernel_value(kernel, footprint, q); },
                               kernel_support(kernel), opacity, count);
}

std::vector<float> relocation_table(int kernel, Footprint footprint, int opacities, int max_count) {
    if (opacities < 1 || max_count < 1)
        throw Error("relocation",
                    fmt::format("cannot make a table of {} x {}", max_count, opacities),
                    "Ask for at least one row and one column.");
    std::vector<float> table;
    const ShapedKernel* shaped = kernel_has_shape(kernel) ? &shaped_kernel(kernel) : nullptr;
    for (int row = 0; row < (shaped ? SHAPE_ROWS : 1); ++row) {
        const double exponent = shaped ? shaped->exponent(footprint, shaped->shape_of_row(row)) : 0;
        for (int count = 1; count <= max_count; ++count)
            for (int k = 0; k < opacities; ++k) {
                const double opacity = (k + 0.5) / opacities;
                table.push_back(static_cast<float>(
                    shaped ? shaped->relocation_scale(footprint, exponent, opacity, count)
                           : relocation_scale(kernel, footprint, opacity, count)));
            }
    }
    return table;
}

}  // namespace darb
