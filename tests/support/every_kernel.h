// SPDX-License-Identifier: MIT
// The kernels of the list and those whose shape each splat has of its own.
#pragma once

#include <vector>

#include "engine/kernels/shaped_kernel.h"

namespace darb::test {

/// Two smooth kernels, one of them endless; and one that jumps with one that has a kink.
constexpr int kSmoothBlend = blend_of(KERNEL_GAUSSIAN, KERNEL_RAISED_COSINE);
constexpr int kSteepBlend = blend_of(KERNEL_SINC, KERNEL_INVERSE_QUADRATIC);

/// Including a blend.
inline std::vector<int> every_shaped_kernel() {
    std::vector<int> kernels = shaped_kernels();
    kernels.push_back(kSmoothBlend);
    return kernels;
}

inline std::vector<int> every_kernel() {
    std::vector<int> kernels;
    for (int k = 0; k < KERNEL_COUNT; ++k) kernels.push_back(k);
    for (const int k : every_shaped_kernel()) kernels.push_back(k);
    return kernels;
}

}  // namespace darb::test
