// SPDX-License-Identifier: MIT
// The tables of the inner loop against the kernel family they are made from.
#include "engine/reference/kernel_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace darb::reference {
namespace {

class EveryTable : public testing::TestWithParam<std::tuple<int, Footprint>> {
  protected:
    int kernel() const { return std::get<0>(GetParam()); }
    Footprint footprint() const { return std::get<1>(GetParam()); }
    double support() const { return std::min(kernel_support(kernel()), 40.0); }
};

TEST_P(EveryTable, ValueAndSlope_MatchTheFamily) {
    const KernelTable& table = kernel_table(kernel(), footprint());
    constexpr int kCount = 5000;
    for (int i = 0; i < kCount; ++i) {
        const double q = support() * (i + 0.37) / kCount;
        ASSERT_NEAR(table.value(q), kernel_value(kernel(), footprint(), q), 1e-13) << "q = " << q;
        const double slope = kernel_slope(kernel(), footprint(), q);
        ASSERT_NEAR(table.slope(q), slope, 1e-11 * (1 + std::abs(slope))) << "q = " << q;
    }
}

TEST_P(EveryTable, CentreAndEdge_AreExact) {
    const KernelTable& table = kernel_table(kernel(), footprint());
    EXPECT_NEAR(table.value(0), 1, 1e-14);
    EXPECT_NEAR(table.slope(0), kernel_slope(kernel(), footprint(), 0), 1e-12);
    if (kernel() == KERNEL_GAUSSIAN) {
        return;
    }
    const double edge = kernel_support(kernel());
    for (const double q : {edge, edge * 1.5, std::numeric_limits<double>::infinity()}) {
        EXPECT_EQ(table.value(q), 0) << "q = " << q;
        EXPECT_EQ(table.slope(q), 0) << "q = " << q;
    }
    const double below = std::nextafter(edge, 0.0);
    EXPECT_GE(table.value(below), -1e-14);
    EXPECT_TRUE(std::isfinite(table.slope(below)));
}

TEST_P(EveryTable, Reach_MatchesTheFamily) {
    const KernelTable& table = kernel_table(kernel(), footprint());
    for (const double cutoff : {1 / 255.0, 0.02, 1e-4}) {
        for (const double opacity : {1e-5, 0.004, 0.01, 0.3, 0.99}) {
            EXPECT_NEAR(table.reach(opacity, cutoff),
                        kernel_reach(kernel(), footprint(), opacity, cutoff), 1e-9)
                << "opacity " << opacity << ", cut-off " << cutoff;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Reference, EveryTable,
                         testing::Combine(testing::Range(0, KERNEL_COUNT),
                                          testing::Values(Footprint::psi, Footprint::exact)),
                         [](const auto& i) {
                             return std::string(kernel_name(std::get<0>(i.param))) + "_" +
                                    std::string(footprint_name(std::get<1>(i.param)));
                         });

INSTANTIATE_TEST_SUITE_P(ReferenceRings, EveryTable,
                         testing::Combine(testing::Range(KERNEL_COUNT, KERNEL_BETA),
                                          testing::Values(Footprint::psi)),
                         [](const auto& i) {
                             return std::string(kernel_name(std::get<0>(i.param)));
                         });

}  // namespace
}  // namespace darb::reference
