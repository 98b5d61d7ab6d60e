// The strategies mcmc and budget in whole training runs: they repeat bit by bit, go on from a
// checkpoint as if never stopped, keep to their counts and bring held-out pictures closer.
#include "trainer/strategy.h"

#include "engine/core/error.h"
#include "tests/support/resumed_run.h"
#include "trainer/forecast.h"

namespace darb::test {
namespace {

TinyTraining tiny_with(Strategy strategy, const TinyOptions& tiny = {}) {
    TinyTraining t = tiny_training(tiny);
    use_strategy(strategy, t.options);
    t.options.max_splats = 90;
    return t;
}

class EveryStrategy : public testing::TestWithParam<Strategy> {};

// Photos of 210 px: the ramp of budget has a step, up to iteration 18.
TEST_P(EveryStrategy, a_resumed_run_equals_one_that_never_stopped) {
    const TinyTraining t = tiny_with(GetParam(), {.width = 210, .height = 60});
    Trainer whole = t.trainer();
    run_to(whole, 42);
    EXPECT_GT(whole.splat_count(), 60U) << "growth must take part";
    EXPECT_LE(whole.splat_count(), 90U);
    const auto gathered = [](const Trainer::State& s) {
        return std::ranges::any_of(s.rest_sum, [](float sum) { return sum != 0; });
    };
    EXPECT_EQ(gathered(whole.state()), GetParam() == Strategy::budget) << "harmonics take part";
    expect_resumes(t, whole, {18, 30});
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

// Frames that want more pairs than there is room for are done again, noise and scores with them.
TEST_P(EveryStrategy, frames_that_overflow_leave_no_trace) {
    TinyTraining t =
        tiny_with(GetParam(), {.width = 320, .height = 200, .splats = 24, .close_up = 3});
    t.options.initial_scale = 1;
    t.options.resolution_ramp = false;
    t.options.iterations = 30;
    if (GetParam() == Strategy::mcmc) t.options.max_splats = 26;  // there is room for their pairs
    Trainer tight = t.trainer(), roomy = t.trainer();
    for (const View& view : t.dataset.views) roomy.render(view.camera);
    run_to(tight, 30);
    run_to(roomy, 30);
    EXPECT_TRUE(same_state(tight, roomy));
    EXPECT_EQ(tight.state().error_shares, roomy.state().error_shares);
    EXPECT_GT(tight.counters().redone_iterations, 0U);
    EXPECT_EQ(roomy.counters().redone_iterations, 0U) << "the comparison must not overflow";
}

INSTANTIATE_TEST_SUITE_P(strategies, EveryStrategy,
                         testing::Values(Strategy::mcmc, Strategy::budget),
                         [](const auto& p) { return std::string(strategy_name(p.param)); });

/// Whether a run with the options `now` resumes one with `then`; if not, the error says why.
testing::AssertionResult resumes(const TinyTraining& then, const TinyTraining& now) {
    const Checkpoint checkpoint{{}, settings_text(then.options), "", 0};
    try {
        check_resumable(checkpoint, "file", now.options, now.dataset, "");
    } catch (const Error& e) {
        return testing::AssertionFailure() << e.what();
    }
    return testing::AssertionSuccess();
}

/// Whether it does not, and the error says `why`.
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
    options.prune_opacity = 0.3f;
    use_strategy(Strategy::adc, options);
    EXPECT_EQ(settings_text(options), settings_text({}));
}

TEST(Strategy, mcmc_keeps_every_splat_and_moves_the_dead) {
    TinyTraining t = tiny_with(Strategy::mcmc);
    t.options.max_splats = 60;
    Trainer trainer = t.trainer();
    Trainer::State state = trainer.state();
    for (size_t i = 0; i < 60; i += 4) state.model.opacity[i] = -9;
    trainer.restore(state);
    run_to(trainer, 21);  // opens with the first round
    EXPECT_EQ(trainer.splat_count(), 60U);
    EXPECT_EQ(trainer.counters().pruned, 15U);
    for (const float logit : trainer.model().opacity) EXPECT_GT(logit, -5);
}

TEST(Strategy, budget_ends_at_its_budget) {
    TinyTraining t = tiny_with(Strategy::budget);
    t.options.prune_opacity = 0.01f;
    Trainer trainer = t.trainer();
    run_to(trainer, 50);
    EXPECT_EQ(trainer.splat_count(), 90U);
}

// At 50 frames in a round of the photos at most, but for mcmc.
TEST(Regularisers, act_on_the_unseen_by_the_number_of_photos) {
    TrainOptions adc, mcmc;
    use_strategy(Strategy::mcmc, mcmc);
    for (const auto& [photos, expected] :
         {std::pair<std::size_t, int>{1, 600}, {50, 600}, {51, 300}, {100, 300}, {1000, 30}}) {
        int at_adc = 0, at_mcmc = 0;
        for (int i = 1; i <= 600; ++i) {
            at_adc += regularises_unseen(adc, photos, i);
            at_mcmc += regularises_unseen(mcmc, photos, i);
        }
        EXPECT_EQ(at_adc, expected) << photos;
        EXPECT_EQ(at_mcmc, 600) << photos;
    }
}

TEST(Regularisers, fade_what_no_photo_shows) {
    for (const int views : {6, 60}) {
        const TinyTraining t = tiny_training({.views = views});
        SplatModel start = t.start();
        start.position[1] = 1000;
        Trainer trainer(shared_device(), t.dataset, t.photos, start, t.options);
        run_to(trainer, 1);
        const float first = trainer.model().opacity[0];
        run_to(trainer, 2);
        const float second = trainer.model().opacity[0];
        if (views == 6)
            EXPECT_LT(first, start.opacity[0]);
        else
            EXPECT_EQ(first, start.opacity[0]);
        EXPECT_LT(second, first);
    }
}

TEST(OpacityReset, the_last_one_by_the_length_of_the_run) {
    TrainOptions options;
    EXPECT_EQ(options.last_opacity_reset(), 12'000);
    options.iterations = 12'000;
    EXPECT_EQ(options.last_opacity_reset(), 3'000);
    options.iterations = 7'000;
    EXPECT_EQ(options.last_opacity_reset(), 0);
    options.iterations = 1;
    EXPECT_EQ(options.last_opacity_reset(), 0);
    options.iterations = 7'000;
    options.densify_until = 15'000;  // of a longer run: growth ends with this one
    EXPECT_EQ(options.last_opacity_reset(), 3'000);
    options.densify_until = -1;
    use_3dgs_schedule(options);
    EXPECT_EQ(options.last_opacity_reset(), 3'000);
}

TEST(Pace, a_short_run_learns_and_grows_faster) {
    TrainOptions options;
    for (const int iterations : {30'000, 4'000}) {
        options.iterations = iterations;
        EXPECT_FLOAT_EQ(options.scale_rate(), 0.005f);
        EXPECT_FLOAT_EQ(options.rotation_rate(), 0.001f);
        EXPECT_FLOAT_EQ(options.opacity_rate(), 0.05f);
        EXPECT_EQ(options.degree_interval(), 1'000);
        EXPECT_FALSE(refines_after(options, 500));
        EXPECT_TRUE(refines_after(options, 600));
    }
    options.iterations = 1'000;
    EXPECT_EQ(options.degree_interval(), 250);
    EXPECT_FLOAT_EQ(options.scale_rate(), 0.02f);
    EXPECT_FLOAT_EQ(options.rotation_rate(), 0.004f);
    EXPECT_FLOAT_EQ(options.opacity_rate(), 0.1f);
    EXPECT_FALSE(refines_after(options, 125));
    EXPECT_TRUE(refines_after(options, 150));
    options.iterations = 1;
    EXPECT_FLOAT_EQ(options.scale_rate(), 0.025f) << "five times at the most";
    EXPECT_EQ(options.densify_begin(), 100);
    EXPECT_EQ(options.round_interval(), 20);
}

TEST(Pace, colours_that_change_with_the_view_learn_faster_the_shorter_the_run) {
    TrainOptions options;
    EXPECT_FLOAT_EQ(options.sh_rest_rate(1), 1.25e-4f);
    options.iterations = 7'500;
    EXPECT_FLOAT_EQ(options.sh_rest_rate(1), 5e-4f);
    EXPECT_FLOAT_EQ(options.sh_rest_rate(4), 1e-3f) << "steps of means are steadier";
    options.iterations = 1'000;
    EXPECT_FLOAT_EQ(options.sh_rest_rate(1), 1.25e-3f);
    EXPECT_FLOAT_EQ(options.sh_rest_rate(16), options.sh_dc_lr) << "at most the first band's";
    use_3dgs_schedule(options);
    options.sh_dc_lr = 0.002f;
    EXPECT_FLOAT_EQ(options.sh_rest_rate(1), 0.0001f);
}

TEST(Pace, is_not_for_what_is_given_nor_for_3dgs) {
    TrainOptions given;
    given.iterations = 1'000;
    given.scale_lr = given.rotation_lr = given.opacity_lr = 0.01f;
    given.densify_from = given.densify_interval = 30;
    given.sh_interval = 700;
    EXPECT_EQ(given.degree_interval(), 700);
    EXPECT_FLOAT_EQ(given.scale_rate(), 0.01f);
    EXPECT_FLOAT_EQ(given.rotation_rate(), 0.01f);
    EXPECT_FLOAT_EQ(given.opacity_rate(), 0.01f);
    EXPECT_TRUE(refines_after(given, 60));
    TrainOptions theirs;
    theirs.iterations = 1'000;
    use_3dgs_schedule(theirs);
    EXPECT_FLOAT_EQ(theirs.scale_rate(), 0.005f);
    EXPECT_FLOAT_EQ(theirs.rotation_rate(), 0.001f);
    EXPECT_FLOAT_EQ(theirs.opacity_rate(), 0.025f);
    EXPECT_EQ(theirs.densify_begin(), 500);
    EXPECT_EQ(theirs.round_interval(), 100);
    EXPECT_EQ(theirs.degree_interval(), 1'000);
    EXPECT_EQ(theirs.clearance, 0);
}

TEST(OpacityReset, only_adc_has_them) {
    TrainOptions options;
    EXPECT_TRUE(resets_after(options, 12'000));
    EXPECT_FALSE(resets_after(options, 15'000));
    options.iterations = 7'000;
    EXPECT_FALSE(resets_after(options, 3'000));
    use_strategy(Strategy::budget, options);
    options.iterations = 30'000;
    EXPECT_FALSE(resets_after(options, 12'000));
}

TEST(PruneBySize, only_3dgs_does_and_after_its_first_reset) {
    TrainOptions options;
    EXPECT_FALSE(prunes_by_size(options, 3'100));
    use_3dgs_schedule(options);
    EXPECT_FALSE(prunes_by_size(options, 3'000));
    EXPECT_TRUE(prunes_by_size(options, 3'100));
}

TEST(OpacityReset, over_white_where_growth_begins_if_it_does) {
    TrainOptions options;
    EXPECT_FALSE(resets_after(options, 500));
    options.white_background = true;
    options.random_background = false;
    EXPECT_TRUE(resets_after(options, 500));
    options.iterations = 1'200;  // growth would end with the round of iteration 600
    EXPECT_FALSE(resets_after(options, 500));
}

TEST(GrowthTarget, follows_its_rule_to_the_limit) {
    TrainOptions options;
    use_strategy(Strategy::mcmc, options);
    EXPECT_EQ(growth_target(options, 600, 1000, 5000), 1050U);
    EXPECT_EQ(growth_target(options, 600, 1000, 1020), 1020U);
    EXPECT_EQ(growth_target(options, 600, 1000, 900), 1000U) << "never below what is there";
    EXPECT_EQ(options.densify_end(), 25'000);
    EXPECT_EQ(growth_target(options, 24'800, 1000, 4000), 1050U) << "nobody asked for a number";
    options.max_splats = 4000;
    EXPECT_EQ(growth_target(options, 24'800, 1000, 4000), 2000U) << "two rounds are left";
    EXPECT_EQ(growth_target(options, 24'900, 1000, 4000), 4000U) << "this is the last";
    use_strategy(Strategy::budget, options);
    const int last = options.densify_end() - options.round_interval();
    EXPECT_EQ(growth_target(options, last, 1000, 5000), 5000U);
    EXPECT_EQ(growth_target(options, last - options.round_interval(), 1000, 5000), 4000U)
        << "a quarter of the gap is left for the last of two rounds";
    EXPECT_EQ(growth_target(options, 600, 7000, 5000), 5000U);
}

TEST(GrowthTarget, the_forecast_knows_it) {
    TrainOptions options;
    for (const Strategy strategy : {Strategy::mcmc, Strategy::budget}) {
        SCOPED_TRACE(std::string(strategy_name(strategy)));
        use_strategy(strategy, options);
        EXPECT_EQ(predict_splats(4'000, 0, options, 100'000), 100'000U);
        const double mean = mean_splats(4'000, 100'000, options);
        EXPECT_GT(mean, 50'000);
        EXPECT_LT(mean, 100'000);
    }
    options.paced = false;
    options.iterations = 1'200;  // one round of budget, which at most doubles
    EXPECT_EQ(predict_splats(4'000, 0, options, 100'000), 4'000U);
    options.iterations = 1'300;
    EXPECT_EQ(predict_splats(4'000, 0, options, 100'000), 8'000U);
}

TEST(ResolutionRamp, divisors_follow_the_run_and_the_size_of_the_photos) {
    TrainOptions options, theirs;
    use_3dgs_schedule(theirs);
    EXPECT_EQ(ramp_divisor(theirs, 1, 1600), 1);
    EXPECT_EQ(ramp_divisor(options, 1, 1600), 4);
    EXPECT_EQ(ramp_divisor(options, 3'000, 1600), 4);
    EXPECT_EQ(ramp_divisor(options, 3'001, 1600), 2);
    EXPECT_EQ(ramp_divisor(options, 9'001, 1600), 1);
    EXPECT_EQ(ramp_divisor(options, 1, 399), 2);
    EXPECT_EQ(ramp_divisor(options, 1, 199), 1);
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
