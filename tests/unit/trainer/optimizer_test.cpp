// SPDX-License-Identifier: MIT
// trainer/optimizer: rates in the units of the scene, regularisers, and what a trial changes.
#include "trainer/step/optimizer.h"

#include <gtest/gtest.h>

#include <cmath>

namespace darb {
namespace {

Optimizer optimizer_of(const TrainOptions& options, double extent = 2, double reach = 7) {
    return Optimizer(Schedule(options), extent, reach, 20);
}

TEST(Optimizer, positions_and_regularisers_are_in_units_of_the_scene) {
    const TrainOptions options;
    const AdamStep one = optimizer_of(options, 1).step(50),
                   ten = optimizer_of(options, 10).step(50);
    EXPECT_FLOAT_EQ(ten.rate[kPosition], 10 * one.rate[kPosition]);
    EXPECT_FLOAT_EQ(ten.rate[kLogScale], one.rate[kLogScale]) << "of a logarithm";
    EXPECT_FLOAT_EQ(10 * ten.scale_weight, one.scale_weight);
    EXPECT_EQ(ten.opacity_weight, one.opacity_weight);
}

TEST(Optimizer, the_largest_scale_is_a_share_of_the_reach) {
    TrainOptions options;
    EXPECT_EQ(optimizer_of(options).step(1).largest_log_scale, AdamStep{}.largest_log_scale);
    options.largest_scale = 0.5f;
    EXPECT_FLOAT_EQ(optimizer_of(options).step(1).largest_log_scale, std::log(3.5f));
}

TEST(Optimizer, a_trial_has_a_share_of_all_rates_and_steps_of_all_bands) {
    TrainOptions options;
    options.sh_rest_every = 16;
    const Optimizer optimizer = optimizer_of(options);
    const AdamStep usual = optimizer.step(160), trial = optimizer.trial_step(160, 0.5f);
    EXPECT_EQ(trial.rest_every, 1);
    EXPECT_FLOAT_EQ(trial.rate[kPosition], 0.5f * usual.rate[kPosition]);
    EXPECT_FLOAT_EQ(trial.rate[kOpacityLogit], 0.5f * usual.rate[kOpacityLogit]);
    EXPECT_FLOAT_EQ(trial.rate[kShDc], 0.5f * usual.rate[kShDc]);
    EXPECT_FLOAT_EQ(trial.rate[kShRest], 0.2f * trial.rate[kShDc]);
    EXPECT_EQ(trial.opacity_weight, usual.opacity_weight);
    EXPECT_EQ(trial.regularise_unseen, usual.regularise_unseen);
}

// So that moments reach back over as many views, and a step is as long as those of its views where
// these do not agree.
TEST(Optimizer, a_batch_has_rates_by_the_root_and_betas_by_the_power_of_its_views) {
    TrainOptions options;
    options.sh_rest_every = 16;
    const AdamStep one = optimizer_of(options).step(2'000'000);  // where nothing is corrected
    EXPECT_EQ(one.beta1, 0.9);
    options.batch = 4;
    const AdamStep four = optimizer_of(options).step(2'000'000);
    EXPECT_FLOAT_EQ(four.rate[kPosition], 2 * one.rate[kPosition]);
    EXPECT_FLOAT_EQ(four.rate[kOpacityLogit], 2 * one.rate[kOpacityLogit]);
    EXPECT_DOUBLE_EQ(four.beta1, std::pow(0.9, 4));
    EXPECT_DOUBLE_EQ(four.beta2, std::pow(0.999, 4));
    EXPECT_EQ(four.rest_every, 4) << "16 views as before, so nothing else of it changes";
    EXPECT_FLOAT_EQ(four.rate[kShRest], one.rate[kShRest]);
    EXPECT_EQ(four.rest_beta1, 0.9);
    options.batch = 32;
    const AdamStep many = optimizer_of(options).step(2'000'000);
    EXPECT_EQ(many.rest_every, 1);
    EXPECT_FLOAT_EQ(many.rate[kShRest], std::sqrt(2.0f) * one.rate[kShRest]);
    EXPECT_DOUBLE_EQ(many.rest_beta2, std::pow(0.999, 2));
}

TEST(Optimizer, the_corrections_of_a_batch_are_those_of_as_many_views) {
    TrainOptions options;
    options.average_from = 1;  // so that rates depend on the position in the run alone
    const AdamStep one = optimizer_of(options).step(64);
    options.batch = 8;
    const AdamStep eight = optimizer_of(options).step(64);
    EXPECT_FLOAT_EQ(eight.inverse_sqrt_correction2, one.inverse_sqrt_correction2);
    EXPECT_FLOAT_EQ(eight.rate[kRotation], std::sqrt(8.0f) * one.rate[kRotation]);
}

TEST(Optimizer, a_batch_regularises_the_unseen_in_the_share_of_its_views) {
    TrainOptions options;
    options.batch = 4;
    const Schedule schedule(options);
    EXPECT_EQ(Optimizer(schedule, 2, 7, 20).step(8).regularise_unseen, 1);
    EXPECT_EQ(Optimizer(schedule, 2, 7, 100).step(8).regularise_unseen, 0.5f);
    options.batch = 1;
    EXPECT_EQ(Optimizer(Schedule(options), 2, 7, 100).step(7).regularise_unseen, 0);
}

}  // namespace
}  // namespace darb
