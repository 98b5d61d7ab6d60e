// trainer/optimizer: rates in the units of the scene, regularisers, and what a trial changes.
#include "trainer/optimizer.h"

#include <gtest/gtest.h>

#include <cmath>

namespace darb {
namespace {

Optimizer optimizer_of(const TrainOptions& options, double extent = 2, double reach = 7) {
    return Optimizer(options, Schedule(options), extent, reach, 20);
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

}  // namespace
}  // namespace darb
