// SPDX-License-Identifier: MIT
// The strategies mcmc and budget in whole training runs: they repeat bit by bit, go on from a
// checkpoint as if never stopped, keep to their counts and bring held-out pictures closer.
#include "trainer/options/strategy.h"

#include "engine/core/error.h"
#include "tests/support/resumed_run.h"
#include "trainer/growth/predicted_growth.h"

namespace darb::test {
namespace {

TinyTraining tiny_with(Strategy strategy, const TinyOptions& tiny = {}) {
    TinyTraining t = tiny_training(tiny);
    t.options.strategy = strategy;
    t.options.initial_opacity.reset();
    t.options.prune_opacity.reset();
    t.options.max_splats = 90;
    return t;
}

class EveryStrategy : public testing::TestWithParam<Strategy> {};

// Photos of 210 px: the ramp of budget has a step, up to iteration 18.
TEST_P(EveryStrategy, a_resumed_run_equals_one_that_never_stopped) {
    TinyTraining t = tiny_with(GetParam(), {.width = 210, .height = 60});
    if (GetParam() == Strategy::budget) t.options.sh_rest_every = 16;
    Trainer whole = t.trainer();
    run_to(whole, 42);
    EXPECT_GT(whole.splat_count(), 60U) << "growth must take part";
    EXPECT_LE(whole.splat_count(), 90U);
    const auto gathered = [](const Trainer::State& s) {
        return std::ranges::any_of(s.rest_sum, [](float sum) { return sum != 0; });
    };
    EXPECT_EQ(gathered(whole.state()), GetParam() == Strategy::budget) << "harmonics take part";
    expect_resumes(t, whole, {18});
}

// 28 iterations in batches of 8: the last has 4. The stop is where a batch ends, in the middle of
// an epoch of 3 photos; rounds come where single views have them, or with the batch that they are
// in.
void expect_batches_resume(Strategy strategy) {
    TinyTraining t = tiny_with(strategy, {.views = 4, .width = 32, .height = 24});
    t.options.batch = 8;
    t.options.iterations = 28;
    t.options.densify_from = 5;
    t.options.densify_until = 26;
    t.options.densify_interval = 6;
    t.options.sh_interval = 4;
    t.options.exposure = t.options.antialias = strategy == Strategy::adc;
    Trainer whole = t.trainer();
    std::vector<int> results, rounds;
    whole.on_result = [&](const IterationResult& r) {
        results.push_back(r.iteration);
        EXPECT_EQ(r.ends_step, r.iteration % 8 == 0 || r.iteration == 28) << r.iteration;
    };
    whole.on_round = [&](int iteration, const DensityResult&) { rounds.push_back(iteration); };
    const std::uint32_t start = whole.splat_count();
    run_to(whole, 28);
    EXPECT_EQ(whole.iteration(), 28);
    ASSERT_EQ(results.size(), 28U);
    for (int i = 0; i < 28; ++i) EXPECT_EQ(results[static_cast<size_t>(i)], i + 1);
    // The rounds of iterations 6 and 12 take place with the batches that end at 8 and 16, those of
    // 18 and 24 with the batch that ends at 24.
    EXPECT_EQ(rounds, (std::vector<int>{8, 16, 24}));
    EXPECT_NE(whole.splat_count(), start) << "growth must take part";
    expect_resumes(t, whole, {16});
}

TEST(Batches, of_budget_resume_bit_by_bit_and_count_views) {
    expect_batches_resume(Strategy::budget);
}

TEST(Batches, of_the_other_strategies_resume_bit_by_bit_long) {
    expect_batches_resume(Strategy::adc);
    expect_batches_resume(Strategy::mcmc);
}

TEST(ResolutionRamp, results_tell_the_pixels_and_harmonics_that_were_trained) {
    TinyTraining t = tiny_with(Strategy::budget, {.width = 210, .height = 60});
    t.options.sh_degree = 1;
    Trainer trainer = t.trainer();
    std::vector<IterationResult> results;
    trainer.on_result = [&](const IterationResult& r) { results.push_back(r); };
    run_to(trainer, 20);
    trainer.drain();
    ASSERT_EQ(results.size(), 20U);
    const auto is_whole = [&](const IterationResult& r) {
        return std::ranges::any_of(t.dataset.views, [&](const View& v) {
            return std::uint32_t(v.camera.width * v.camera.height) == r.pixels;
        });
    };
    EXPECT_TRUE(is_whole(results.back()));
    EXPECT_GT(results.front().pixels, 0U);
    EXPECT_LT(3 * results.front().pixels, results.back().pixels);
    EXPECT_EQ(results.back().rest_floats, 9);
}

TEST_P(EveryStrategy, held_out_picture_gets_closer_to_the_photo) {
    TinyTraining t = tiny_with(GetParam());
    t.options.iterations = 200;
    t.options.densify_until = 150;
    Trainer trainer = t.trainer();
    const double before = evaluate_held_out(trainer, t.dataset, t.photos).views[0].psnr_db;
    run_to(trainer, 200);
    const double after = evaluate_held_out(trainer, t.dataset, t.photos).views[0].psnr_db;
    EXPECT_GT(after, before + 2) << "from " << before << " dB";
    EXPECT_EQ(trainer.counters().bad_gradients, 0U);
}

// Frames that want more intersections than there is room for are done again, noise with them.
TEST_P(EveryStrategy, frames_that_overflow_leave_no_trace) {
    TinyTraining t =
        tiny_with(GetParam(), {.width = 320, .height = 200, .splats = 24, .close_up = 3});
    t.options.initial_scale = 1;
    t.options.resolution_ramp = false;
    t.options.iterations = 30;
    if (GetParam() == Strategy::mcmc)
        t.options.max_splats = 26;  // there is room for their intersections
    Trainer tight = t.trainer(), roomy = t.trainer();
    for (const View& view : t.dataset.views) roomy.render(view.camera);
    run_to(tight, 30);
    run_to(roomy, 30);
    EXPECT_TRUE(same_state(tight, roomy));
    EXPECT_GT(tight.counters().redone_iterations, 0U);
    EXPECT_EQ(roomy.counters().redone_iterations, 0U) << "the comparison must not overflow";
}

INSTANTIATE_TEST_SUITE_P(strategies, EveryStrategy,
                         testing::Values(Strategy::mcmc, Strategy::budget),
                         [](const auto& p) { return std::string(strategy_name(p.param)); });

/// Whether a run with the options `now` resumes one with `then`; if not, the error tells why.
testing::AssertionResult resumes(const TinyTraining& then, const TinyTraining& now) {
    Checkpoint checkpoint{{}, settings_text(then.options), "", 0};
    checkpoint.state.model.kernel = then.options.kernel;
    checkpoint.state.model.footprint = then.options.footprint;
    try {
        check_resumable(checkpoint, "file", now.options, now.dataset, "");
    } catch (const Error& e) {
        return testing::AssertionFailure() << e.what();
    }
    return testing::AssertionSuccess();
}

/// Whether it does not resume, and the error says `why`.
testing::AssertionResult refuses(const TinyTraining& then, const TinyTraining& now,
                                 const std::string& why) {
    const testing::AssertionResult resumed = resumes(then, now);
    if (!resumed && std::string(resumed.message()).find(why) != std::string::npos)
        return testing::AssertionSuccess();
    return testing::AssertionFailure() << "not '" << why << "': " << resumed.message();
}

TEST(Strategy, another_one_cannot_resume) {
    const TinyTraining adc = tiny_training(), mcmc = tiny_with(Strategy::mcmc);
    EXPECT_TRUE(refuses(adc, mcmc, "was written with --strategy adc"));
    EXPECT_TRUE(refuses(mcmc, adc, "was written with --strategy mcmc"));
}

TEST(Strategy, a_run_resumes_with_the_photos_that_it_saw) {
    TinyTraining with = tiny_training(), without = tiny_training();
    without.options.resolution_ramp = false;
    EXPECT_TRUE(refuses(with, without, "resolution_ramp: true then, false now"));
    EXPECT_TRUE(refuses(without, with, "resolution_ramp: false then, true now"));
    EXPECT_TRUE(resumes(with, with));
    EXPECT_TRUE(resumes(without, without));
}

TEST(Strategy, a_run_does_not_resume_without_what_it_had) {
    TinyTraining with = tiny_training();
    const TinyTraining without = tiny_training();
    with.options.morton_order = true;  // settings name it only there
    EXPECT_TRUE(refuses(with, without, "morton_order: true then, not given now"));
}

TEST(Strategy, adc_has_the_settings_that_it_always_had) {
    TrainOptions options;
    EXPECT_EQ(settings_text(options).find("strategy"), std::string::npos);
    options.strategy = Strategy::adc;
    EXPECT_EQ(settings_text(options), settings_text({}));
}

TEST(Strategy, mcmc_keeps_every_splat_and_moves_the_dead) {
    TinyTraining t = tiny_with(Strategy::mcmc);
    t.options.max_splats = 60;
    Trainer trainer = t.trainer();
    Trainer::State state = trainer.state();
    for (size_t i = 0; i < 60; i += 4) state.model.opacity_logit[i] = -9;
    trainer.restore(state);
    run_to(trainer, 21);  // opens with the first round
    EXPECT_EQ(trainer.splat_count(), 60U);
    EXPECT_EQ(trainer.counters().pruned, 15U);
    for (const float logit : trainer.model().opacity_logit) EXPECT_GT(logit, -5);
}

TEST(Strategy, budget_ends_at_its_budget) {
    TinyTraining t = tiny_with(Strategy::budget);
    t.options.prune_opacity = 0.01f;
    Trainer trainer = t.trainer();
    run_to(trainer, 50);
    EXPECT_EQ(trainer.splat_count(), 90U);
}

TEST(Regularisers, fade_what_no_photo_shows) {
    for (const int views : {6, 60}) {
        const TinyTraining t = tiny_training({.views = views});
        SplatModel start = t.start();
        start.position[1] = 1000;
        Trainer trainer(shared_device(), t.dataset, t.photos, start, t.options);
        run_to(trainer, 1);
        const float first = trainer.model().opacity_logit[0];
        run_to(trainer, 2);
        const float second = trainer.model().opacity_logit[0];
        if (views == 6)
            EXPECT_LT(first, start.opacity_logit[0]);
        else
            EXPECT_EQ(first, start.opacity_logit[0]);
        EXPECT_LT(second, first);
    }
}

TEST(GrowthTarget, follows_its_rule_to_the_limit) {
    TrainOptions options;
    options.strategy = Strategy::mcmc;
    EXPECT_EQ(growth_target(Schedule(options), 600, 1000, 5000), 1050U);
    EXPECT_EQ(growth_target(Schedule(options), 600, 1000, 1020), 1020U);
    EXPECT_EQ(growth_target(Schedule(options), 600, 1000, 900), 1000U)
        << "never below what is there";
    EXPECT_EQ(Schedule(options).rounds.end, 25'000);
    EXPECT_EQ(growth_target(Schedule(options), 24'800, 1000, 4000), 1050U)
        << "nobody asked for a number";
    options.max_splats = 4000;
    EXPECT_EQ(growth_target(Schedule(options), 24'800, 1000, 4000), 2000U) << "two rounds are left";
    EXPECT_EQ(growth_target(Schedule(options), 24'900, 1000, 4000), 4000U) << "this is the last";
    options.strategy = Strategy::budget;
    const Schedule::Rounds rounds = Schedule(options).rounds;
    const int last = rounds.end - rounds.interval;
    EXPECT_EQ(growth_target(Schedule(options), last, 1000, 5000), 5000U);
    EXPECT_EQ(growth_target(Schedule(options), last - rounds.interval, 1000, 5000), 4000U)
        << "a quarter of the gap is left for the last of two rounds";
    EXPECT_EQ(growth_target(Schedule(options), 600, 7000, 5000), 5000U);
}

TEST(GrowthTarget, the_forecast_knows_it) {
    TrainOptions options;
    const GrowthStart start{.splats = 4'000, .limit = 100'000};
    for (const Strategy strategy : {Strategy::mcmc, Strategy::budget}) {
        SCOPED_TRACE(std::string(strategy_name(strategy)));
        options.strategy = strategy;
        EXPECT_EQ(predict_splats(options, start), 100'000U);
        const double mean = mean_splats(4'000, 100'000, options);
        EXPECT_GT(mean, 50'000);
        EXPECT_LT(mean, 100'000);
    }
    options.speed_up_short_runs = false;
    options.iterations = 1'200;  // one round of budget, which at most doubles
    EXPECT_EQ(predict_splats(options, start), 4'000U);
    options.iterations = 1'300;
    EXPECT_EQ(predict_splats(options, start), 8'000U);
}

TEST(ResolutionRamp, a_divided_camera_sees_the_same) {
    Camera camera;
    camera.width = 203;
    camera.height = 98;
    camera.fx = 150;
    camera.fy = 160;
    camera.cx = 90;
    camera.cy = 49;
    const Camera smaller = divided(camera, 4);
    EXPECT_EQ(smaller.width, 51);
    EXPECT_EQ(smaller.height, 25);
    for (const double edge : {0.0, 1.0}) {  // rays through the picture's edges
        EXPECT_NEAR((edge * smaller.width - smaller.cx) / smaller.fx,
                    (edge * camera.width - camera.cx) / camera.fx, 1e-12);
        EXPECT_NEAR((edge * smaller.height - smaller.cy) / smaller.fy,
                    (edge * camera.height - camera.cy) / camera.fy, 1e-12);
    }
}

TEST(ResolutionRamp, serves_adc_too_and_ends_at_the_full_size) {
    TinyTraining t = tiny_training({.width = 400, .height = 32});
    t.options.iterations = 20;
    Trainer trainer = t.trainer();
    std::vector<int> divisors;
    while (trainer.iteration() < 20) {
        trainer.step();
        divisors.push_back(trainer.resolution_divisor());
    }
    trainer.drain();
    EXPECT_EQ(std::count(divisors.begin(), divisors.end(), 4), 2);
    EXPECT_EQ(std::count(divisors.begin(), divisors.end(), 2), 4);
    EXPECT_EQ(std::count(divisors.begin(), divisors.end(), 1), 14);
    EXPECT_EQ(trainer.counters().bad_gradients, 0U);
}

}  // namespace
}  // namespace darb::test
