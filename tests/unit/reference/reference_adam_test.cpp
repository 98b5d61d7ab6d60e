// SPDX-License-Identifier: MIT
// Adam against its sums written out, and the hard cases of its first steps.
#include "engine/reference/reference_density_control.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "engine/core/rng.h"
#include "tests/support/compare_arrays.h"

namespace darb::reference {
namespace {

template <class T>
struct State {
    std::vector<T> parameter, m, v;

    explicit State(size_t n) : parameter(n), m(n), v(n) {}
    void step(const std::vector<T>& gradient, double rate, int t) {
        adam_step<T>(parameter, gradient, m, v, rate, t);
    }
};

TEST(Adam, ConstantGradient_MovesByTheRateWhateverItsSize) {
    // m / (1 - b1^t) = g and v / (1 - b2^t) = g^2 at every step.
    const std::vector<double> gradient{3.0, -1e-6, 2e5};
    State<double> state(3);
    for (int t = 1; t <= 50; ++t) {
        state.step(gradient, 0.01, t);
        EXPECT_NEAR(state.parameter[0], -0.01 * t, 1e-12) << "step " << t;
        EXPECT_NEAR(state.parameter[1], 0.01 * t, 1e-9) << "step " << t;
        EXPECT_NEAR(state.parameter[2], -0.01 * t, 1e-12) << "step " << t;
    }
}

TEST(Adam, RandomGradients_MatchTheSumsWrittenOut) {
    Pcg32 rng(1);
    State<double> state(1);
    std::vector<double> history;
    double expected = 0;
    for (int t = 1; t <= 200; ++t) {
        history.push_back(rng.normal());
        state.step({history.back()}, 0.02, t);
        double m = 0, v = 0, weight_m = 0, weight_v = 0;
        for (int i = 1; i <= t; ++i) {
            m += std::pow(0.9, t - i) * history[i - 1];
            v += std::pow(0.999, t - i) * history[i - 1] * history[i - 1];
            weight_m += std::pow(0.9, t - i);
            weight_v += std::pow(0.999, t - i);
        }
        expected -= 0.02 * (m / weight_m) / (std::sqrt(v / weight_v) + 1e-15);
        ASSERT_NEAR(state.parameter[0], expected, 1e-11) << "step " << t;
    }
}

TEST(Adam, ZeroGradientFromTheStart_MovesNothing) {
    State<double> state(1);
    for (int t = 1; t <= 3; ++t) {
        state.step({0.0}, 1.0, t);
    }
    EXPECT_EQ(state.parameter[0], 0);
}

TEST(Adam, MomentsZeroedLate_MoveByTheBiasRatioOnTheNextStep) {
    // After an opacity reset: m = 0.1 g, v = 0.001 g^2, both biases about 1.
    State<double> state(1);
    state.step({-2.0}, 0.05, 30000);
    EXPECT_NEAR(state.parameter[0], 0.05 * 0.1 / std::sqrt(0.001), 1e-9);
}

TEST(Adam, GradientThatStops_GoesOnByMomentum) {
    State<double> state(1);
    state.step({1.0}, 0.1, 1);
    const double after_one = state.parameter[0];
    state.step({0.0}, 0.1, 2);
    EXPECT_NEAR(state.parameter[0] - after_one,
                -0.1 * (0.09 / 0.19) / std::sqrt(0.000999 / 0.001999), 1e-12);
}

TEST(Adam, Float_IsCloseToDouble) {
    Pcg32 rng(2);
    State<double> expected(100);
    State<float> got(100);
    for (int t = 1; t <= 20; ++t) {
        std::vector<double> gradient(100);
        for (double& g : gradient) {
            g = static_cast<float>(rng.normal());
        }
        expected.step(gradient, 0.01, t);
        got.step({gradient.begin(), gradient.end()}, 0.01, t);
    }
    EXPECT_TRUE(test::compare("parameter", expected.parameter, got.parameter,
                              {"20 steps", 2e-7, 1e-5, 0, 1 - 1e-9, 1e-5}));
}

TEST(DecayedLearningRate, EndsAndMiddle_AreLogLinear) {
    EXPECT_NEAR(decayed_learning_rate(1.6e-4, 1.6e-6, 0, 30000), 1.6e-4, 1e-18);
    EXPECT_NEAR(decayed_learning_rate(1.6e-4, 1.6e-6, 15000, 30000), 1.6e-5, 1e-18);
    EXPECT_NEAR(decayed_learning_rate(1.6e-4, 1.6e-6, 30000, 30000), 1.6e-6, 1e-18);
    EXPECT_NEAR(decayed_learning_rate(1.6e-4, 1.6e-6, 40000, 30000), 1.6e-6, 1e-18);
}

}  // namespace
}  // namespace darb::reference
