// SPDX-License-Identifier: MIT
// reach: where opacity * w falls below the cut-off.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/kernels/kernel_family.h"
#include "tests/support/footprints.h"

namespace darb {
namespace {

constexpr double kLeastOpacity = 1 / 255.0;

TEST(KernelReach, BelowTheCutoff_isZero) {
    for (int k = 0; k < KERNEL_COUNT; ++k)
        for (const Footprint f : test::kFootprints) {
            EXPECT_EQ(kernel_reach(k, f, kLeastOpacity * 0.999999, kLeastOpacity), 0);
            EXPECT_EQ(kernel_reach(k, f, 0, kLeastOpacity), 0);
            EXPECT_EQ(kernel_reach(k, f, std::nan(""), kLeastOpacity), 0);
        }
}

TEST(KernelReach, Value_crossesTheCutoffThere) {
    for (int k = 0; k < KERNEL_COUNT; ++k)
        for (const Footprint f : test::kFootprints)
            for (const double cutoff : {kLeastOpacity, 1e-4, 0.05})
                for (const double opacity : {cutoff * 1.001, 2 * cutoff, 0.3, 0.99, 1.0}) {
                    const double reach = kernel_reach(k, f, opacity, cutoff);
                    EXPECT_LE(reach, kernel_support(k));
                    EXPECT_LT(opacity * kernel_value(k, f, reach * (1 + 1e-9)), cutoff)
                        << kernel_name(k) << " opacity " << opacity;
                    EXPECT_GE(opacity * kernel_value(k, f, reach * (1 - 1e-9)), cutoff)
                        << kernel_name(k) << " opacity " << opacity;
                }
}

TEST(KernelReach, GrowsWithOpacity) {
    for (int k = 0; k < KERNEL_COUNT; ++k)
        for (const Footprint f : test::kFootprints) {
            double previous = 0;
            for (double opacity = kLeastOpacity; opacity <= 1; opacity += 0.01) {
                const double reach = kernel_reach(k, f, opacity, kLeastOpacity);
                EXPECT_GE(reach, previous);
                previous = reach;
            }
        }
}

TEST(KernelReach, ClosedForms_agree) {
    for (const double opacity : {0.01, 0.2, 0.9}) {
        const double y = kLeastOpacity / opacity;
        const auto reach = [&](int k) {
            return kernel_reach(k, Footprint::psi, opacity, kLeastOpacity);
        };
        EXPECT_NEAR(reach(KERNEL_GAUSSIAN), -2 * std::log(y), 1e-12);
        EXPECT_NEAR(reach(KERNEL_RAISED_COSINE),
                    std::pow(2.5 / std::numbers::pi * std::acos(2 * y - 1), 2), 1e-12);
        EXPECT_NEAR(reach(KERNEL_HALF_COSINE_SQUARED), 18 / std::numbers::pi * std::acos(y), 1e-12);
        EXPECT_NEAR(reach(KERNEL_INVERSE_QUADRATIC), std::min(9.0, 1 / y - 1), 1e-12);
    }
}

}  // namespace
}  // namespace darb
