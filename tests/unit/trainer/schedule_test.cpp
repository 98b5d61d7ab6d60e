// SPDX-License-Identifier: MIT
// What a run does at which iteration, from its options alone.
#include "trainer/options/schedule.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "engine/core/error.h"

namespace darb::test {
namespace {

// At 50 frames in a round of the photos at most, but for mcmc.
TEST(Regularisers, act_on_the_unseen_by_the_number_of_photos) {
    TrainOptions adc, mcmc;
    mcmc.strategy = Strategy::mcmc;
    const Schedule adc_schedule(adc), mcmc_schedule(mcmc);
    for (const auto& [photos, expected] :
         {std::pair<std::size_t, int>{1, 600}, {50, 600}, {51, 300}, {100, 300}, {1000, 30}}) {
        int at_adc = 0, at_mcmc = 0;
        for (int i = 1; i <= 600; ++i) {
            at_adc += adc_schedule.regularises_unseen(photos, i);
            at_mcmc += mcmc_schedule.regularises_unseen(photos, i);
        }
        EXPECT_EQ(at_adc, expected) << photos;
        EXPECT_EQ(at_mcmc, 600) << photos;
    }
}

TEST(OpacityReset, the_last_one_by_the_length_of_the_run) {
    TrainOptions options;
    EXPECT_EQ(Schedule(options).resets.last, 12'000);
    options.iterations = 12'000;
    EXPECT_EQ(Schedule(options).resets.last, 3'000);
    options.iterations = 7'000;
    EXPECT_EQ(Schedule(options).resets.last, 0);
    options.iterations = 1;
    EXPECT_EQ(Schedule(options).resets.last, 0);
    options.iterations = 7'000;
    options.densify_until = 15'000;  // meant for a longer run: growth ends with this one
    EXPECT_EQ(Schedule(options).resets.last, 3'000);
    options.densify_until.reset();
    use_3dgs_schedule(options);
    EXPECT_EQ(Schedule(options).resets.last, 3'000);
}

TEST(UndrawnSplats, go_between_the_end_of_growth_and_the_mean) {
    const auto drops = [](const Schedule& schedule) {
        std::vector<int> all;
        for (int i = 0; i <= schedule.options.iterations; ++i)
            if (schedule.drops_undrawn_after(i)) all.push_back(i);
        return all;
    };
    TrainOptions options;
    options.iterations = 7'000;
    EXPECT_EQ(drops(Schedule(options)), (std::vector<int>{3'500, 4'000, 4'500, 5'000, 5'500}));
    EXPECT_EQ(Schedule(options).last_change(), 5'950);
    options.iterations = 1'600;
    EXPECT_EQ(drops(Schedule(options)), (std::vector<int>{800, 1'000, 1'200}));
    options.average_from = 1;
    EXPECT_EQ(drops(Schedule(options)), (std::vector<int>{800, 1'000, 1'200, 1'400}))
        << "not where it ends";
    options.densify_until = 0;
    EXPECT_TRUE(drops(Schedule(options)).empty()) << "without density control the number stays";
    options.densify_until.reset();
    options.strategy = Strategy::budget;
    EXPECT_TRUE(drops(Schedule(options)).empty()) << "and where a number was asked for";
    EXPECT_EQ(Schedule(options).last_change(), Schedule(options).rounds.end);
}

TEST(UndrawnSplats, are_those_that_neither_training_nor_pictures_draw) {
    TrainOptions options;
    EXPECT_NEAR(Schedule(options).undrawn_opacity, 1 / 255., 1e-6);
    EXPECT_LT(Schedule(options).undrawn_opacity, 1 / 255.);
    options.accuracy.choice[kAlphaCutoff] = find_choice(kAlphaCutoff, "1/1024");
    EXPECT_LT(Schedule(options).undrawn_opacity, 1 / 1024.);
    options.accuracy.choice[kAlphaCutoff] = find_choice(kAlphaCutoff, "1/64");
    EXPECT_LT(Schedule(options).undrawn_opacity, 1 / 255.) << "pictures draw more than such a run";
}

TEST(EarlyEnd, moves_the_mean_and_keeps_its_share_and_the_rates) {
    TrainOptions options;
    options.iterations = 10'000;
    const Schedule whole(options);
    Schedule schedule(options);
    schedule.end_early(6'800);
    EXPECT_EQ(schedule.average_begin, 6'800);
    EXPECT_EQ(schedule.last, 8'000) << "15 % of it are the mean, as of the whole run";
    EXPECT_TRUE(schedule.averages_after(8'000));
    EXPECT_FALSE(schedule.averages_after(6'800));
    for (const int i : {1, 6'000, 7'900}) {
        EXPECT_EQ(schedule.position_rate(i), whole.position_rate(i));
        EXPECT_EQ(schedule.rates(i).scale, whole.rates(i).scale);
    }
    Schedule late(options);
    late.end_early(9'000);  // its mean has begun
    EXPECT_EQ(late.last, 10'000);
    EXPECT_EQ(late.average_begin, whole.average_begin);
    options.average_from = 1;
    Schedule without(options);
    without.end_early(6'000);
    EXPECT_EQ(without.last, 6'000) << "no mean is to come";
    EXPECT_FALSE(without.averages());
}

TEST(Speedup, a_short_run_learns_and_grows_faster) {
    TrainOptions options;
    for (const int iterations : {30'000, 4'000}) {
        options.iterations = iterations;
        EXPECT_FLOAT_EQ(Schedule(options).first.scale, 0.005f);
        EXPECT_FLOAT_EQ(Schedule(options).first.rotation, 0.001f);
        EXPECT_FLOAT_EQ(Schedule(options).first.opacity, 0.05f);
        EXPECT_EQ(Schedule(options).degree_interval, 1'000);
        EXPECT_FALSE(Schedule(options).refines_after(500));
        EXPECT_TRUE(Schedule(options).refines_after(600));
    }
    options.iterations = 1'000;
    EXPECT_EQ(Schedule(options).degree_interval, 250);
    EXPECT_FLOAT_EQ(Schedule(options).first.scale, 0.02f);
    EXPECT_FLOAT_EQ(Schedule(options).first.rotation, 0.004f);
    EXPECT_FLOAT_EQ(Schedule(options).first.opacity, 0.1f);
    EXPECT_FALSE(Schedule(options).refines_after(125));
    EXPECT_TRUE(Schedule(options).refines_after(150));
    options.iterations = 1;
    EXPECT_FLOAT_EQ(Schedule(options).first.scale, 0.025f) << "five times at the most";
    EXPECT_EQ(Schedule(options).rounds.begin, 100);
    EXPECT_EQ(Schedule(options).rounds.interval, 20);
}

TEST(Speedup, colours_that_change_with_the_view_learn_faster_the_shorter_the_run) {
    TrainOptions options;
    const auto rest_rate = [&](int every) {
        options.sh_rest_every = every;
        return Schedule(options).first.sh_rest;
    };
    EXPECT_FLOAT_EQ(rest_rate(1), 1.25e-4f);
    options.iterations = 7'500;
    EXPECT_FLOAT_EQ(rest_rate(1), 5e-4f);
    EXPECT_FLOAT_EQ(rest_rate(4), 1e-3f) << "steps of means are steadier";
    options.iterations = 1'000;
    EXPECT_FLOAT_EQ(rest_rate(1), 1.25e-3f);
    EXPECT_FLOAT_EQ(rest_rate(16), options.sh_dc_lr) << "at most the first band's";
    use_3dgs_schedule(options);
    options.sh_dc_lr = 0.002f;
    EXPECT_FLOAT_EQ(rest_rate(1), 0.0001f);
}

TEST(Speedup, is_not_for_what_is_given_nor_for_3dgs) {
    TrainOptions given;
    given.iterations = 1'000;
    given.scale_lr = given.rotation_lr = given.opacity_lr = 0.01f;
    given.densify_from = given.densify_interval = 30;
    given.sh_interval = 700;
    EXPECT_EQ(Schedule(given).degree_interval, 700);
    EXPECT_FLOAT_EQ(Schedule(given).first.scale, 0.01f);
    EXPECT_FLOAT_EQ(Schedule(given).first.rotation, 0.01f);
    EXPECT_FLOAT_EQ(Schedule(given).first.opacity, 0.01f);
    EXPECT_TRUE(Schedule(given).refines_after(60));
    TrainOptions theirs;
    theirs.iterations = 1'000;
    use_3dgs_schedule(theirs);
    EXPECT_FLOAT_EQ(Schedule(theirs).first.scale, 0.005f);
    EXPECT_FLOAT_EQ(Schedule(theirs).first.rotation, 0.001f);
    EXPECT_FLOAT_EQ(Schedule(theirs).first.opacity, 0.025f);
    EXPECT_EQ(Schedule(theirs).rounds.begin, 500);
    EXPECT_EQ(Schedule(theirs).rounds.interval, 100);
    EXPECT_EQ(Schedule(theirs).degree_interval, 1'000);
    EXPECT_EQ(theirs.clearance, 0);
}

TEST(OpacityReset, mcmc_has_none) {
    TrainOptions options;
    EXPECT_TRUE(Schedule(options).resets_after(12'000));
    EXPECT_FALSE(Schedule(options).resets_after(15'000));
    options.iterations = 7'000;
    EXPECT_FALSE(Schedule(options).resets_after(3'000));
    options.iterations = 30'000;
    options.strategy = Strategy::budget;
    EXPECT_TRUE(Schedule(options).resets_after(12'000));
    options.strategy = Strategy::mcmc;
    EXPECT_FALSE(Schedule(options).resets_after(12'000));
}

TEST(PruneBySize, only_3dgs_does_and_after_its_first_reset) {
    TrainOptions options;
    EXPECT_FALSE(Schedule(options).prunes_by_size(3'100));
    use_3dgs_schedule(options);
    EXPECT_FALSE(Schedule(options).prunes_by_size(3'000));
    EXPECT_TRUE(Schedule(options).prunes_by_size(3'100));
}

TEST(OpacityReset, over_white_where_growth_begins_if_it_does) {
    TrainOptions options;
    EXPECT_FALSE(Schedule(options).resets_after(500));
    options.white_background = true;
    options.random_background = false;
    EXPECT_TRUE(Schedule(options).resets_after(500));
    options.iterations = 1'200;  // growth would end with the round of iteration 600
    EXPECT_FALSE(Schedule(options).resets_after(500));
}

TEST(ResolutionRamp, divisors_follow_the_run_and_the_size_of_the_photos) {
    TrainOptions options, theirs;
    use_3dgs_schedule(theirs);
    EXPECT_EQ(Schedule(theirs).resolution_divisor(1, 1600), 1);
    EXPECT_EQ(Schedule(options).resolution_divisor(1, 1600), 4);
    EXPECT_EQ(Schedule(options).resolution_divisor(3'000, 1600), 4);
    EXPECT_EQ(Schedule(options).resolution_divisor(3'001, 1600), 2);
    EXPECT_EQ(Schedule(options).resolution_divisor(9'001, 1600), 1);
    EXPECT_EQ(Schedule(options).resolution_divisor(1, 399), 2);
    EXPECT_EQ(Schedule(options).resolution_divisor(1, 199), 1);
}

TEST(Rates, fall_where_no_mean_settles_what_they_scatter) {
    TrainOptions o;
    EXPECT_TRUE(Schedule(o).averages());
    EXPECT_EQ(Schedule(o).average_begin, 25'500);
    EXPECT_EQ(Schedule(o).last_share, 1);
    EXPECT_LT(Schedule(o).position_falls_for, 0.5);
    for (const int after : {25'501, 25'509, 25'511, 29'999})
        EXPECT_FALSE(Schedule(o).averages_after(after));
    for (const int after : {25'510, 29'990, 30'000}) EXPECT_TRUE(Schedule(o).averages_after(after));
    o.strategy = Strategy::mcmc;
    EXPECT_EQ(Schedule(o).position_falls_for, 1) << "with the noise";
    EXPECT_EQ(Schedule(o).last_share, 1);
    o = {};
    o.densify_until = o.iterations;  // splats come until the end
    EXPECT_FALSE(Schedule(o).averages());
    EXPECT_FALSE(Schedule(o).averages_after(o.iterations));
    EXPECT_LT(Schedule(o).last_share, 0.5);
    EXPECT_EQ(Schedule(o).position_falls_for, 1);
    o.final_lr_share = 0.75;
    o.position_lr_falls = 0.25;
    EXPECT_EQ(Schedule(o).last_share, 0.75);
    EXPECT_EQ(Schedule(o).position_falls_for, 0.25);
}

TEST(Rates, position_falls_log_linear_and_then_stays) {
    TrainOptions o;
    o.position_lr_init = 1e-2f;
    o.position_lr_final = 1e-4f;
    o.position_lr_falls = 0.5;
    o.iterations = 1'000;
    const Schedule s(o);
    EXPECT_FLOAT_EQ(float(s.position_rate(0)), 1e-2f);
    EXPECT_FLOAT_EQ(float(s.position_rate(500)), 1e-3f) << "half of the way in logarithms";
    EXPECT_EQ(s.position_rate(1'000), s.position_rate(500));
    EXPECT_EQ(s.rates(700).position, s.position_rate(700));
}

TEST(Rates, the_others_fall_in_the_second_half_to_their_share) {
    TrainOptions o;
    o.final_lr_share = 0.25;
    const Schedule s(o);
    const Schedule::Rates half = s.rates(15'000), late = s.rates(22'500), last = s.rates(30'000);
    EXPECT_EQ(half.scale, s.first.scale);
    EXPECT_FLOAT_EQ(late.rotation, 0.5f * s.first.rotation);
    EXPECT_FLOAT_EQ(last.opacity, 0.25f * s.first.opacity);
    EXPECT_FLOAT_EQ(last.sh_dc, 0.25f * s.first.sh_dc);
    EXPECT_FLOAT_EQ(last.sh_rest, 0.25f * s.first.sh_rest);
}

TEST(Rates, exposure_falls_log_linear_over_the_run) {
    TrainOptions o;
    o.exposure_lr_init = 1e-2f;
    o.exposure_lr_final = 1e-4f;
    const Schedule s(o);
    EXPECT_FLOAT_EQ(float(s.exposure_rate(0)), 1e-2f);
    EXPECT_FLOAT_EQ(float(s.exposure_rate(15'000)), 1e-3f);
    EXPECT_FLOAT_EQ(float(s.exposure_rate(30'000)), 1e-4f);
}

TEST(Degrees, one_more_in_each_interval_up_to_the_highest) {
    TrainOptions o;
    o.sh_degree = 2;
    const Schedule s(o);
    EXPECT_EQ(s.sh_degree(999), 0);
    EXPECT_EQ(s.sh_degree(1'000), 1);
    EXPECT_EQ(s.sh_degree(2'000), 2);
    EXPECT_EQ(s.sh_degree(3'000), 2);
}

TEST(Given, counts_and_what_is_absent_is_of_the_strategy) {
    TrainOptions o;
    o.strategy = Strategy::mcmc;
    EXPECT_EQ(Schedule(o).initial_opacity, 0.5f);
    EXPECT_EQ(Schedule(o).prune_opacity, 0.005f);
    o.prune_opacity = 0.02f;
    EXPECT_EQ(Schedule(o).prune_opacity, 0.02f);
    EXPECT_EQ(Schedule(o).initial_scale, 0.1f);
    o.sh_rest_every = 3;
    EXPECT_EQ(Schedule(o).rest_every, 3);
}

TEST(LearnedKernel, changes_so_often_until_the_mean_begins) {
    TrainOptions options;
    options.iterations = 1'600;
    const auto changes = [&](int end) {
        const Schedule schedule(options);
        int count = 0;
        for (int i = 0; i <= end; ++i) count += schedule.changes_kernel_after(i);
        return count;
    };
    EXPECT_EQ(changes(1'600), 0);
    options.learn_kernel = 20;
    const Schedule schedule(options);
    EXPECT_EQ(schedule.kernel_end, schedule.average_begin);
    EXPECT_EQ(changes(1'600), 20);
    EXPECT_EQ(changes(schedule.average_begin / 2), 10);
    EXPECT_TRUE(schedule.samples_kernel_at(1));
    EXPECT_FALSE(schedule.samples_kernel_at(2));
    EXPECT_FALSE(schedule.samples_kernel_at(1'593)) << "nothing changes by it";
    Schedule sooner(options);
    sooner.end_early(400);
    EXPECT_FALSE(sooner.changes_kernel_after(schedule.average_begin));
    options.iterations = 7;  // more changes than iterations: one after each
    options.average_from = 1;
    EXPECT_EQ(changes(7), 7);
}

TEST(Schedule, steps_of_a_batch_begin_at_its_multiples_and_end_with_the_run) {
    TrainOptions o;
    o.iterations = 21;
    o.batch = 8;
    const Schedule s(o);
    EXPECT_EQ(s.step_end(0), 8);
    EXPECT_EQ(s.step_end(8), 16);
    EXPECT_EQ(s.step_end(16), 21);
    EXPECT_EQ(s.step_begin(8), 0);
    EXPECT_EQ(s.step_begin(21), 16);
    EXPECT_EQ(s.step_begin(0), 0);
    for (const int batch : {0, 3, 12}) {
        o.batch = batch;
        EXPECT_THROW(Schedule{o}, Error) << batch;
    }
}

TEST(Lengths, are_a_gaussians_or_longer_where_a_kernel_covers_less) {
    TrainOptions o;
    EXPECT_EQ(Schedule(o).length_scale, 1);
    EXPECT_EQ(Schedule(o).largest_scale, 0) << "no limit";
    o.kernel = KERNEL_RAISED_COSINE;
    EXPECT_NEAR(Schedule(o).length_scale, 1.28, 0.005);
    EXPECT_EQ(Schedule(o).largest_scale, 1);
    EXPECT_FLOAT_EQ(Schedule(o).first.scale, 0.0075f);
    o.largest_scale = 0;
    EXPECT_EQ(Schedule(o).largest_scale, 0);
    o.lengths_by_area = false;
    EXPECT_EQ(Schedule(o).length_scale, 1);
}

TEST(OpacityReset, leaves_what_is_drawn_and_twice_what_is_pruned) {
    TrainOptions o;
    EXPECT_FLOAT_EQ(Schedule(o).resets.to, 0.2f);
    o.prune_opacity = 0.005f;
    EXPECT_FLOAT_EQ(Schedule(o).resets.to, 0.01f);
    o.prune_opacity = 0;
    EXPECT_GE(Schedule(o).resets.to, 0.01f);
    o.prune_opacity = 1;
    EXPECT_FLOAT_EQ(Schedule(o).resets.to, 0.9f);
}

TEST(ResolutionRamp, its_steps_are_what_its_divisors_say) {
    for (const int iterations : {1, 7, 60, 1'000, 30'000})
        for (const int side : {50, 150, 300, 1'600}) {
            TrainOptions o;
            o.iterations = iterations;
            const Schedule s(o);
            int i = 0;
            for (const RampStep& step : s.ramp_steps(side))
                for (int end = i + step.iterations; i < end;)
                    EXPECT_EQ(s.resolution_divisor(++i, side), step.divisor) << iterations;
            EXPECT_EQ(s.resolution_divisor(i + 1, side), 1) << iterations << " " << side;
        }
}

}  // namespace
}  // namespace darb::test
