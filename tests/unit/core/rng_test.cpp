// SPDX-License-Identifier: MIT
#include "engine/core/rng.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace darb {
namespace {

// First round of the demo program of the PCG library (pcg32-demo, seed 42, stream 54).
TEST(Pcg32, Next_of_the_published_seed_gives_the_published_numbers) {
    const std::array<std::uint32_t, 6> published = {0xa15c02b7, 0x7b47f409, 0xba1d3330,
                                                    0x83d2f293, 0xbfa4784b, 0xcbed606e};
    Pcg32 rng(42, 54);
    for (const std::uint32_t expected : published) EXPECT_EQ(rng.next(), expected);
}

TEST(Pcg32, Streams_of_one_seed_differ) {
    Pcg32 first(1, 0), second(1, 1);
    int equal = 0;
    for (int i = 0; i < 1000; ++i) equal += first.next() == second.next();
    EXPECT_LE(equal, 1);
}

TEST(Pcg32, State_restored_continues_the_sequence) {
    Pcg32 rng(7);
    rng.normal();
    Pcg32 resumed(99);
    resumed.set_state(rng.state());
    for (int i = 0; i < 10; ++i) EXPECT_EQ(resumed.normal(), rng.normal()) << "draw " << i;
}

TEST(Pcg32, Uniform_lies_in_its_half_open_range_with_the_right_moments) {
    Pcg32 rng(3);
    const int n = 100'000;
    double sum = 0, squares = 0;
    for (int i = 0; i < n; ++i) {
        const double x = rng.uniform(-1.0, 3.0);
        ASSERT_GE(x, -1.0);
        ASSERT_LT(x, 3.0);
        sum += x;
        squares += x * x;
    }
    // Standard errors: mean 1.155 / sqrt(n) = 0.0037; five of them.
    EXPECT_NEAR(sum / n, 1.0, 0.0185);
    EXPECT_NEAR(squares / n - 1.0, 4.0 / 3.0, 0.05);
}

TEST(Pcg32, Below_reaches_every_value_evenly_and_not_the_bound) {
    Pcg32 rng(4);
    std::array<int, 6> count{};
    for (int i = 0; i < 60'000; ++i) {
        const std::uint32_t value = rng.below(6);
        ASSERT_LT(value, 6u);
        ++count[value];
    }
    // Binomial with mean 10,000 and deviation 91; five deviations.
    for (const int c : count) EXPECT_NEAR(c, 10'000, 460);
    EXPECT_EQ(rng.below(1), 0u);
}

TEST(Pcg32, Normal_has_the_moments_of_a_standard_normal_and_is_finite) {
    Pcg32 rng(5);
    const int n = 100'000;
    double sum = 0, squares = 0, fourth = 0;
    for (int i = 0; i < n; ++i) {
        const double x = rng.normal();
        ASSERT_TRUE(std::isfinite(x));
        sum += x;
        squares += x * x;
        fourth += x * x * x * x;
    }
    // Five standard errors: 1, sqrt(2) and sqrt(96), each over sqrt(n).
    EXPECT_NEAR(sum / n, 0.0, 0.0159);
    EXPECT_NEAR(squares / n, 1.0, 0.0224);
    EXPECT_NEAR(fourth / n, 3.0, 0.155);
}

}  // namespace
}  // namespace darb
