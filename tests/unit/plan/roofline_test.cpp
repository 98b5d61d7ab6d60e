// SPDX-License-Identifier: MIT
// The device's rates, and the work of passes as counts scale.
#include "engine/plan/roofline.h"

#include <gtest/gtest.h>

#include "tests/support/shared_device.h"

namespace darb::test {
namespace {

TEST(Roofline, rates_are_those_of_a_device) {
    const DeviceRates rates = measure_rates(shared_device());
    if (shared_device().info().timestamp_period_ns <= 0) GTEST_SKIP() << "no timestamps";
    EXPECT_GT(rates.bytes_per_s, 1e8);
    EXPECT_LT(rates.bytes_per_s, 1e14);
    EXPECT_GT(rates.fma_per_s, 1e8);
    EXPECT_LT(rates.fma_per_s, 1e15);
}

TEST(Roofline, work_grows_with_the_counts) {
    const FrameCounts counts{1000, 800, 5000, 10'000, 24}, more{2000, 1600, 10'000, 20'000, 24};
    for (const char* pass : {"project", "compact", "depth sort", "emit", "tile sort", "tile ranges",
                             "blend", "loss", "exposure", "blend backward", "project backward"}) {
        const auto one = pass_work(pass, counts), two = pass_work(pass, more);
        ASSERT_TRUE(one && two) << pass;
        EXPECT_GT(one->bytes, 0) << pass;
        EXPECT_DOUBLE_EQ(two->bytes, 2 * one->bytes) << pass;
        EXPECT_DOUBLE_EQ(two->fma, 2 * one->fma) << pass;
    }
    EXPECT_FALSE(pass_work("no such pass", counts));
}

TEST(Roofline, harmonics_that_step_seldom_move_less) {
    FrameCounts counts{1000, 800, 5000, 10'000, 24};
    const PassWork each = *pass_work("project backward", counts);
    counts.rest_every = 16;
    const PassWork seldom = *pass_work("project backward", counts);
    // In 15 of 16 steps, 1,000 splats save three loads and stores of 24 floats. The sum of
    // gradients costs one load and store: for the 800 splats seen in these steps, and for all in
    // the sixteenth.
    EXPECT_DOUBLE_EQ(each.bytes - seldom.bytes,
                     1000 * 24 * 24 * (1 - 1.0 / 16) - (800 * 15.0 / 16 + 1000.0 / 16) * 8 * 24);
    EXPECT_EQ(each.fma, seldom.fma);
}

TEST(Roofline, share_is_that_of_the_slower_rate) {
    const DeviceRates rates{1e9, 1e10};
    EXPECT_DOUBLE_EQ(roofline_share({1e6, 1e6}, rates, 2.0), 0.5);
    EXPECT_DOUBLE_EQ(roofline_share({1e6, 1e8}, rates, 20.0), 0.5);
    EXPECT_EQ(roofline_share({1e6, 1e6}, {}, 1.0), 0);
}

}  // namespace
}  // namespace darb::test
