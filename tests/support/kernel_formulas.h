// SPDX-License-Identifier: MIT
// The nine kernels as the paper prints them (corrected), in plain double: written without a look
// at engine/kernels, for comparison with it.
#pragma once

#include <cmath>
#include <limits>
#include <numbers>

#include "shaders/shared/kernel_list.h"

namespace darb::test {

inline double formula_support(int kernel) {
    if (kernel == KERNEL_GAUSSIAN) return std::numeric_limits<double>::infinity();
    return kernel == KERNEL_RAISED_COSINE ? 6.25 : 9;
}

inline double formula(int kernel, double q) {
    constexpr double pi = std::numbers::pi;
    if (q >= formula_support(kernel)) return 0;
    const double d = std::sqrt(q);
    switch (kernel) {
        case KERNEL_GAUSSIAN:
            return std::exp(-q / 2);
        case KERNEL_RAISED_COSINE:
            return 0.5 + 0.5 * std::cos(pi * d / 2.5);
        case KERNEL_HALF_COSINE_SQUARED:
            return std::cos(pi * q / 18);
        case KERNEL_SINC:
            return d == 0 ? 1 : std::sin(pi * d / 3) / (pi * d / 3);
        case KERNEL_INVERSE_QUADRATIC:
            return 1 / (1 + q);
        case KERNEL_COSINE:
            return std::cos(pi * d / 6);
        case KERNEL_SQUARED_RAISED_COSINE:
            return std::pow(0.5 + 0.5 * std::cos(pi * d / 3), 2);
        case KERNEL_INVERSE_MULTIQUADRIC:
            return 1 / std::sqrt(1 + q);
        default:
            return 1 - q / 9;
    }
}

}  // namespace darb::test
