// SPDX-License-Identifier: MIT
// Two user-defined kernels: one whose polynomial meets the formula to float rounding, and one that
// is replaced by its nearest polynomial, with terms that cancel and a jump at the edge.
#pragma once

#include <cmath>
#include <vector>

#include "engine/kernels/kernel_registry.h"

namespace darb::test {

inline std::vector<int> own_kernels() {
    return {register_kernel("own_smooth", 8,
                            [](double q) { return std::pow(1 - q / 8, 2) * std::exp(-q / 10); }),
            register_kernel("own_cut", 9, [](double q) { return std::exp(-q / 2); })};
}

}  // namespace darb::test
