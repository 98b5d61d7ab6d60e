// The kernels of the list and those whose shape each splat has of its own.
#pragma once

#include <vector>

#include "engine/kernels/shaped_kernel.h"

namespace darb::test {

inline std::vector<int> every_kernel() {
    std::vector<int> kernels;
    for (int k = 0; k < KERNEL_COUNT; ++k) kernels.push_back(k);
    for (const int k : shaped_kernels()) kernels.push_back(k);
    return kernels;
}

}  // namespace darb::test
