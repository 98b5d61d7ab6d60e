// SPDX-License-Identifier: MIT
// The comparison helpers against planted errors: each kind of mistake must be found.
#include "tests/support/compare_arrays.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/core/rng.h"

namespace darb::test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::vector<double> random_values(size_t count, std::uint64_t seed) {
    Pcg32 rng(seed);
    std::vector<double> values(count);
    for (double& value : values) {
        value = rng.normal();
    }
    return values;
}

TEST(Compare, EqualValues_Pass) {
    const auto values = random_values(100, 1);
    EXPECT_TRUE(compare("equal", values, values, tolerance("exact")));
}

TEST(Compare, ErrorWithinAbsPlusRel_Passes) {
    const Tolerance loose{"test", 0.1, 0.01};
    EXPECT_TRUE(compare("within", std::vector{100.0}, std::vector{101.09}, loose));
    EXPECT_FALSE(compare("outside", std::vector{100.0}, std::vector{101.11}, loose));
}

TEST(Compare, OneWrongValue_FailsAndNamesIt) {
    auto got = random_values(30, 2);
    const auto expected = got;
    got[14] += 1;
    const auto result = compare("planted", expected, got, {"test", 1e-6, 1e-6}, 3);
    ASSERT_FALSE(result);
    const std::string message = result.message();
    for (const char* part : {"planted", "[4][2]", "expected", "got", "tolerance", "1 of 30"}) {
        EXPECT_NE(message.find(part), std::string::npos) << part << " in " << message;
    }
}

TEST(Compare, FailRatio_CountsTheBand) {
    auto got = random_values(1000, 3);
    const auto expected = got;
    for (size_t i = 0; i < 10; ++i) {
        got[i * 97] += 1;
    }
    EXPECT_TRUE(compare("band", expected, got, {"test", 1e-6, 0, 0.010}));
    EXPECT_FALSE(compare("band", expected, got, {"test", 1e-6, 0, 0.009}));
}

TEST(Compare, NotFinite_FailsWhateverTheTolerance) {
    const Tolerance huge{"test", 1e30, 1e30};
    EXPECT_FALSE(compare("nan", std::vector{1.0}, std::vector{kNan}, huge));
    EXPECT_FALSE(compare("infinite", std::vector{1.0}, std::vector{kInfinity}, huge));
    EXPECT_FALSE(compare("both", std::vector{kNan}, std::vector{kNan}, huge));
}

TEST(Compare, NotFiniteWithinTheBand_FailsByCosineAndBias) {
    std::vector<double> expected(1000, 1.0), got = expected;
    got[5] = kNan;
    EXPECT_FALSE(compare("band", expected, got, {"test", 0, 0, 0.01, 0.5}));
    EXPECT_FALSE(compare("band", expected, got, {"test", 0, 0, 0.01, -1, 0.5}));
}

TEST(Compare, Nothing_Fails) {
    EXPECT_FALSE(
        compare("empty", std::vector<double>{}, std::vector<double>{}, tolerance("exact")));
}

TEST(Compare, DifferentLengths_Fail) {
    EXPECT_FALSE(compare("length", std::vector{1.0, 2.0}, std::vector{1.0}, tolerance("exact")));
}

TEST(Compare, FlippedSignOfSmallValues_FailsByCosine) {
    const auto expected = random_values(100, 4);
    auto got = expected;
    for (double& value : got) {
        value = -value;
    }
    EXPECT_TRUE(compare("sign", expected, got, {"test", 10, 0}));
    EXPECT_FALSE(compare("sign", expected, got, {"test", 10, 0, 0, 0.99}));
}

TEST(Compare, AllZeroAgainstValues_FailsByCosine) {
    const auto expected = random_values(100, 5);
    const std::vector<double> zeros(100);
    EXPECT_FALSE(compare("zero", expected, zeros, {"test", 10, 0, 0, 0.5}));
    EXPECT_TRUE(compare("both zero", zeros, zeros, {"test", 10, 0, 0, 0.5}));
}

TEST(Compare, SmallErrorAlwaysUpwards_FailsByBias) {
    const auto expected = random_values(1000, 6);
    auto upwards = expected, rounded = expected;
    for (size_t i = 0; i < expected.size(); ++i) {
        upwards[i] += 1e-4;
        rounded[i] += i % 2 == 0 ? 1e-4 : -1e-4;
    }
    const Tolerance unbiased{"test", 2e-4, 0, 0, -1, 1e-5};
    EXPECT_TRUE(compare("rounded", expected, rounded, unbiased));
    EXPECT_FALSE(compare("upwards", expected, upwards, unbiased));
}

TEST(Compare, FloatsAgainstDoubles_Compare) {
    EXPECT_TRUE(compare("mixed", std::vector{0.5}, std::vector{0.5F}, tolerance("exact")));
}

TEST(CompareScaled, AbsIsInUnitsOfTheRootMeanSquare) {
    const Tolerance allowed{"test", 1e-3};
    for (const double size : {1e-9, 1.0, 1e9}) {
        auto expected = random_values(1000, 7);
        for (double& value : expected) {
            value *= size;
        }
        auto got = expected;
        got[500] += 0.9e-3 * size;
        EXPECT_TRUE(compare_scaled("within", expected, got, allowed)) << size;
        got[500] += 0.2e-3 * size;
        EXPECT_FALSE(compare_scaled("outside", expected, got, allowed)) << size;
    }
}

TEST(CompareScaled, ZerosAndDifferentLengths_AreNotScaledAway) {
    const std::vector<double> zeros(10, 0.0);
    EXPECT_TRUE(compare_scaled("zeros", zeros, zeros, tolerance("gradient_scaled_float32")));
    EXPECT_FALSE(compare_scaled("something", zeros, std::vector<double>(10, 1e-3),
                                tolerance("gradient_scaled_float32")));
    EXPECT_FALSE(compare_scaled("shorter", zeros, std::vector<double>(9, 0.0),
                                tolerance("gradient_scaled_float32")));
    EXPECT_FALSE(compare_scaled("nothing", std::vector<double>(), std::vector<double>(),
                                tolerance("gradient_scaled_float32")));
}

TEST(ToleranceTable, EveryRow_IsFoundByNameAndHasAReason) {
    for (const char* name : {"exact", "difference", "image_float32", "gradient_float32"}) {
        EXPECT_EQ(tolerance(name).name, name);
        EXPECT_FALSE(tolerance(name).reason.empty()) << name;
    }
}

}  // namespace
}  // namespace darb::test
