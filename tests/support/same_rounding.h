// SPDX-License-Identifier: MIT
// Two shaders that compute the same thing by the same formulas give equal bits where the driver
// rounds every operation. Drivers of GPUs may fuse a * b + c, in each shader on its own, as Vulkan
// allows.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "tests/support/shared_device.h"

namespace darb::test {

inline bool rounds_every_operation() {
    return shared_device().info().type == "cpu";
}

/// Passes where the bits are equal on a device that rounds every operation, and elsewhere where the
/// values differ by at most `share` of the largest.
inline testing::AssertionResult same_but_for_fusing(std::span<const float> a,
                                                    std::span<const float> b, double share) {
    if (a.size() != b.size())
        return testing::AssertionFailure() << a.size() << " and " << b.size() << " values";
    double largest = 0, worst = 0;
    std::size_t at = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        if (std::isfinite(a[i])) largest = std::max(largest, std::abs(double{a[i]}));
        if (a[i] == b[i]) continue;
        const double error = std::isfinite(a[i]) && std::isfinite(b[i])
                                 ? std::abs(double{a[i]} - double{b[i]})
                                 : std::numeric_limits<double>::infinity();
        if (error <= worst) continue;
        worst = error;
        at = i;
    }
    if (worst == 0) return testing::AssertionSuccess();
    if (!rounds_every_operation() && std::isfinite(worst) && worst <= share * largest)
        return testing::AssertionSuccess();
    return testing::AssertionFailure() << "value " << at << " is " << a[at] << " and " << b[at]
                                       << ", the largest is " << largest;
}

}  // namespace darb::test
