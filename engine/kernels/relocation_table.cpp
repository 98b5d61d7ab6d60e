#include "engine/kernels/relocation_table.h"

#include <fmt/format.h>

#include <cmath>

#include "engine/core/error.h"
#include "engine/kernels/quadrature.h"

namespace darb {

double relocation_opacity(double opacity, int count) {
    if (!(opacity >= 0 && opacity <= 1) || count < 1)
        throw Error("relocation", fmt::format("{} splats of opacity {}", count, opacity),
                    "It wants at least one, of an opacity between 0 and 1.");
    return -std::expm1(std::log1p(-opacity) / count);
}

double relocation_scale(int kernel, Footprint footprint, double opacity, int count) {
    const double part = relocation_opacity(opacity, count);
    if (part <= 0) return 1;  // the limit for opacity -> 0
    const double support = kernel_support(kernel);
    const double radius = std::isfinite(support) ? std::sqrt(support) : kGaussRadius;
    double before = 0, after = 0;
    // t = R (1 - s^2) makes roots of u = 1 - t^2/R^2 analytic in s; dt is 2 R s ds.
    for (const auto [x, weight] : even_quadrature())
        for (const double s : {(1 + x) / 2, (1 - x) / 2}) {
            const double t = radius * (1 - s * s);
            const double w = kernel_value(kernel, footprint, t * t);
            before += weight * s * opacity * w;
            after -= weight * s * std::expm1(count * std::log1p(-part * w));
        }
    return before / after;
}

std::vector<float> relocation_table(int kernel, Footprint footprint, int opacities, int max_count) {
    if (opacities < 1 || max_count < 1)
        throw Error("relocation", fmt::format("a table of {} x {}", max_count, opacities),
                    "It wants at least one row and one column.");
    std::vector<float> table;
    for (int count = 1; count <= max_count; ++count)
        for (int k = 0; k < opacities; ++k)
            table.push_back(static_cast<float>(
                relocation_scale(kernel, footprint, (k + 0.5) / opacities, count)));
    return table;
}

}  // namespace darb
