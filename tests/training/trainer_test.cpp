// SPDX-License-Identifier: MIT
// Training runs of a few dozen iterations: they repeat bit by bit, go on from a checkpoint as if
// never stopped, survive frames that need more room, and bring the loss down.
#include "engine/core/error.h"
#include "engine/data/metrics.h"
#include "tests/support/resumed_run.h"
#include "tests/support/test_device_options.h"
#include "tests/support/tiny_training.h"

namespace darb::test {
namespace {

TEST(Training, the_same_seed_gives_the_same_bits) {
    const TinyTraining t = tiny_training();
    Trainer one = t.trainer(), two = t.trainer();
    run_to(one, 60);
    run_to(two, 60);
    EXPECT_TRUE(same_state(one, two));
    EXPECT_GT(one.counters().cloned_or_split, 10U) << "density control must take part";
    EXPECT_GT(one.counters().pruned, 0U) << one.splat_count();
    EXPECT_GT(one.splat_count(), 30U);
}

TEST(Training, another_seed_gives_other_bits) {
    TinyTraining t = tiny_training();
    Trainer one = t.trainer();
    run_to(one, 20);
    t.options.seed = 6;
    Trainer two = t.trainer();
    run_to(two, 20);
    EXPECT_FALSE(same_state(one, two));
}

/// Photos of nothing: what is trained over the colour that pictures are compared over may stay as
/// it is, what is trained over other colours must become opaque to hide them.
TEST(Training, a_random_background_makes_surfaces_opaque) {
    TinyTraining t = tiny_training();
    t.options.densify_until = 0;
    t.options.opacity_weight = 0;
    const auto darkness = [&](bool random) {
        t.options.random_background = random;
        Trainer trainer = t.trainer();
        run_to(trainer, 60);
        double opacity = 0;
        for (const float logit : trainer.model().opacity_logit)
            opacity += 1 / (1 + std::exp(-logit));
        return opacity;
    };
    EXPECT_GT(darkness(true), 1.1 * darkness(false));
}

// Stops right before, at and after density control and the opacity reset, and in between.
TEST(Training, a_resumed_run_equals_one_that_never_stopped) {
    TinyTraining t = tiny_training();
    t.options.white_background = true;  // over a fixed background: resets opacities once more
    Trainer whole = t.trainer();
    run_to(whole, 60);
    expect_resumes(t, whole, {1, 20, 33, 59});
}

/// The mean over iterations of what `raw` left, a run without a mean, in double.
class MeanOfRun {
  public:
    void add(const SplatModel& model) {
        ++count_;
        for (int a = 0; a < kAttributeCount; ++a) {
            const std::vector<float>& values = attribute_values(model, a);
            sum_[a].resize(values.size());
            for (size_t i = 0; i < values.size(); ++i) sum_[a][i] += double(values[i]);
        }
    }
    void expect_near(const SplatModel& model) const {
        for (int a = 0; a < kAttributeCount; ++a) {
            const std::vector<float>& values = attribute_values(model, a);
            ASSERT_EQ(values.size(), sum_[a].size());
            for (size_t i = 0; i < values.size(); ++i) {
                const double mean = sum_[a][i] / count_;
                ASSERT_NEAR(values[i], mean, 2e-6 * (1 + std::abs(mean)))
                    << attribute_name(a) << " " << i << " of " << count_ << " iterations";
            }
        }
    }

  private:
    int count_ = 0;
    std::array<std::vector<double>, kAttributeCount> sum_;
};

/// With or without a mean, the same rates.
TinyTraining with_rates_given() {
    TinyTraining t = tiny_training();
    t.options.position_lr_falls = t.options.final_lr_share = 0.5;
    return t;
}

TEST(Training, ends_with_the_mean_of_its_last_iterations) {
    TinyTraining t = with_rates_given();
    t.options.average_from = 1;
    Trainer raw = t.trainer();
    t.options.average_from = 0.9;
    Trainer whole = t.trainer();
    run_to(raw, 54);
    run_to(whole, 54);
    EXPECT_TRUE(same_state(raw, whole)) << "before the mean begins";
    MeanOfRun mean;
    while (raw.iteration() < 60) {
        SCOPED_TRACE(raw.iteration());
        EXPECT_EQ(whole.state().model.position, raw.state().model.position) << "it only looks on";
        raw.step();
        whole.step();
        mean.add(raw.state().model);
        const SplatModel shown = whole.model();
        mean.expect_near(shown);
        const Camera& camera = t.dataset.views[0].camera;
        const ImageF picture = whole.render(camera);
        EXPECT_EQ(picture.data, Renderer(shared_device(), shown).render(camera).data);
        if (raw.iteration() > 55) {
            EXPECT_NE(picture.data, raw.render(camera).data);
        }
    }
    mean.expect_near(whole.state().model);
    EXPECT_EQ(whole.state().averaged, 0U) << "the run is over";
    EXPECT_NE(raw.model().position, whole.model().position);
}

TEST(Training, the_mean_begins_anew_where_a_degree_is_added) {
    TinyTraining t = with_rates_given();
    t.options.probe_sh = true;  // too few photos for a trial: each degree is admitted
    t.options.sh_interval = 28;
    t.options.average_from = 1;
    Trainer raw = t.trainer();
    t.options.average_from = 0;  // from the end of density control on
    Trainer whole = t.trainer();
    run_to(raw, 56);
    run_to(whole, 56);
    EXPECT_EQ(whole.state().averaged, 6U);
    MeanOfRun mean;
    while (raw.iteration() < 60) {
        raw.step();
        whole.step();
        mean.add(raw.state().model);
    }
    EXPECT_EQ(whole.model().sh_degree, 2);
    mean.expect_near(whole.model());
}

TEST(Training, looking_at_pictures_meanwhile_changes_nothing) {
    const TinyTraining t = tiny_training();
    Trainer one = t.trainer(), two = t.trainer();
    run_to(one, 30);
    while (two.iteration() < 30) {
        two.step();
        two.render(t.dataset.views[two.iteration() % 6].camera);
        if (two.iteration() % 7 == 0) two.state();
    }
    EXPECT_TRUE(same_state(one, two));
}

/// Wide splats and a close-up, so that one view wants more intersections than the first room of
/// 1,024.
TinyTraining overflowing() {
    TinyTraining t = tiny_training({.width = 320, .height = 200, .splats = 24, .close_up = 3});
    t.options.resolution_ramp = false;
    t.options.densify_grad_threshold = 2e-4f;
    t.options.iterations = 30;
    return t;
}

TEST(Training, frames_that_overflow_are_done_again_and_leave_no_trace) {
    const TinyTraining t = overflowing();
    Trainer tight = t.trainer(), roomy = t.trainer();
    for (const View& view : t.dataset.views) roomy.render(view.camera);  // grows its buffers
    std::vector<IterationResult> results[2];
    tight.on_result = [&](const IterationResult& r) { results[0].push_back(r); };
    roomy.on_result = [&](const IterationResult& r) { results[1].push_back(r); };
    run_to(tight, 30);
    run_to(roomy, 30);
    EXPECT_TRUE(same_state(tight, roomy));
    EXPECT_GT(tight.counters().redone_iterations, 0U);
    EXPECT_EQ(roomy.counters().redone_iterations, 0U) << "the comparison must not overflow";
    tight.drain();
    roomy.drain();
    for (const auto& r : results) ASSERT_EQ(r.size(), 30U);
    std::uint32_t most = 0;
    for (int i = 0; i < 30; ++i) {
        EXPECT_EQ(results[0][i].iteration, i + 1) << "each iteration once and in order";
        EXPECT_EQ(results[0][i].loss, results[1][i].loss) << i;
        EXPECT_EQ(results[0][i].intersections, results[1][i].intersections) << i;
        most = std::max(most, results[0][i].intersections);
    }
    EXPECT_GT(most, 1024U);
    EXPECT_EQ(tight.counters().culled, roomy.counters().culled);
}

// A colour of 1e25 makes SSIM, and with it dL/dimage, not a number: the run ends, and the splats
// stay as they were.
TEST(Training, gradients_that_are_not_finite_are_counted_over_the_whole_run) {
    const TinyTraining t = overflowing();
    Trainer trainer = t.trainer();
    Trainer::State state = trainer.state();
    for (size_t c = 0; c < 3; ++c) state.model.sh_dc[c] = 1e25f;
    state.counters.bad_gradients = 1000;  // from the run so far
    trainer.restore(state);
    EXPECT_THROW(run_to(trainer, 8), Error);
    EXPECT_GT(trainer.counters().bad_gradients, 1000U);
}

// As an exception leaves it; validation tells whether the device still used anything.
TEST(Training, a_trainer_dropped_in_flight_waits_for_the_device) {
    const TinyTraining t = tiny_training();
    for (const int iterations : {1, 2, 3}) {
        Trainer trainer = t.trainer();
        run_to(trainer, iterations);
    }
    EXPECT_EQ(shared_device().validation_message_count(), 0U);
}

TEST(Training, held_out_picture_gets_closer_to_the_photo) {
    TinyTraining t = tiny_training();
    t.options.iterations = 300;
    t.options.densify_until = 0;
    Trainer trainer = t.trainer();
    const double before = evaluate_held_out(trainer, t.dataset, t.photos).views[0].psnr_db;
    run_to(trainer, 300);
    const double after = evaluate_held_out(trainer, t.dataset, t.photos).views[0].psnr_db;
    EXPECT_GT(after, before + 3) << "from " << before << " dB";
}

// The same views and points in a map's coordinates, where a float has steps of half a metre.
TEST(Training, map_coordinates_train_as_those_at_the_origin) {
    TinyTraining t = tiny_training();
    t.options.densify_until = 0;
    std::vector<double> losses[2];
    for (std::vector<double>& loss : losses) {
        Trainer trainer = t.trainer();
        trainer.on_result = [&](const IterationResult& r) { loss.push_back(r.loss); };
        run_to(trainer, 40);
        trainer.drain();
        const glm::dvec3 corner(431'000.25, 5'412'000.5, 812.125);
        for (View& v : t.dataset.views) v.camera.translation -= v.camera.rotation * corner;
        for (size_t i = 0; i < t.dataset.points.position.size(); ++i)
            t.dataset.points.position[i] += corner[int(i % 3)];
    }
    for (size_t i = 0; i < losses[0].size(); ++i)
        EXPECT_NEAR(losses[1][i], losses[0][i], 1e-3 * losses[0][i]) << "iteration " << i + 1;
}

// A splat culled because a parameter is not a number has no influence on its neighbours.
TEST(Training, poisoned_splats_leave_the_others_alone) {
    TinyTraining t = tiny_training();
    t.options.densify_until = 0;
    t.options.opacity_weight = t.options.scale_weight = 0;  // they divide by the number of splats
    const SplatModel start = t.start();
    SplatModel sick = start;
    sick.resize(start.size() + 5);
    for (size_t i = start.size(); i < sick.size(); ++i)
        for (int a = 0; a < kAttributeCount; ++a) {
            std::vector<float>& values = attribute_values(sick, a);
            const size_t stride = values.size() / sick.size();
            for (size_t c = 0; c < stride; ++c) values[i * stride + c] = values[c];
        }
    size_t at = start.size();
    sick.position[3 * at++] = std::nanf("");
    sick.rotation[4 * at++] = std::numeric_limits<float>::infinity();
    sick.log_scale[3 * at++] = std::nanf("");
    sick.opacity_logit[at++] = std::nanf("");
    sick.sh_dc[3 * at++] = 1e38f;
    Trainer clean(shared_device(), t.dataset, t.photos, start, t.options);
    Trainer poisoned(shared_device(), t.dataset, t.photos, sick, t.options);
    run_to(clean, 12);
    run_to(poisoned, 12);
    const SplatModel expected = clean.model(), got = poisoned.model();
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<float>&x = attribute_values(expected, a), &y = attribute_values(got, a);
        EXPECT_TRUE(std::equal(x.begin(), x.end(), y.begin())) << attribute_name(a);
    }
    EXPECT_EQ(poisoned.counters().bad_gradients, 0U);
    EXPECT_GE(poisoned.counters().culled[CULL_ROTATION], 12U);
}

TEST(Training, a_model_that_lost_every_splat_trains_on) {
    TinyTraining t = tiny_training();
    t.options.prune_opacity = 2;  // nothing survives the first density control
    Trainer trainer = t.trainer();
    run_to(trainer, 40);
    EXPECT_EQ(trainer.splat_count(), 0U);
    EXPECT_EQ(trainer.model().size(), 0U);
    for (const float value : trainer.render(t.dataset.views[1].camera).data) ASSERT_EQ(value, 0);
}

TEST(Training, one_splat_is_a_model) {
    TinyTraining t = tiny_training();
    t.dataset.points.position.resize(3);
    t.dataset.points.colour.resize(3);
    Trainer trainer = t.trainer();
    ASSERT_EQ(trainer.splat_count(), 1U);
    run_to(trainer, 30);
    for (const float value : trainer.model().position) EXPECT_TRUE(std::isfinite(value));
}

// What does not fit a binding is processed range by range, density control included.
TEST(Training, a_device_of_small_bindings_trains_the_same_bits) {
    TinyTraining t = tiny_training({.width = 32, .height = 24, .splats = 700});
    t.options.sh_degree = 3;
    t.options.sh_interval = 5;
    for (const int every : {1, 4}) {
        t.options.sh_rest_every = every;
        Trainer whole = t.trainer();
        ::setenv("DARB_FAULT", "binding:163840", 1);
        Device narrow{test::device_options()};
        ::unsetenv("DARB_FAULT");
        Trainer parts(narrow, t.dataset, t.photos, t.start(), t.options);
        ASSERT_GT(parts.splats().ranges().size(), 1U);
        run_to(whole, 45);
        run_to(parts, 45);
        EXPECT_GT(parts.splats().ranges().size(), 1U);
        EXPECT_GT(parts.counters().cloned_or_split, 10U);
        EXPECT_TRUE(same_state(whole, parts));
        EXPECT_EQ(whole.state().rest_sum.empty(), every == 1);
    }
}

// The same for the sums of intersections, window by window.
TEST(Training, a_device_whose_bindings_hold_few_intersections_trains_the_same_bits) {
    for (const Strategy strategy : {Strategy::adc, Strategy::budget}) {
        TinyTraining t = tiny_training({.width = 32, .height = 24, .splats = 330});
        t.options.strategy = strategy;
        t.options.max_splats = 600;
        const bool grows = strategy == Strategy::budget;
        if (!grows) t.options.densify_until = 0;
        t.options.initial_scale = grows ? 2 : 5;
        Trainer whole = t.trainer();
        ::setenv("DARB_FAULT", "binding:20480", 1);  // 640 intersections a window
        Device narrow{test::device_options()};
        ::unsetenv("DARB_FAULT");
        Trainer windows(narrow, t.dataset, t.photos, t.start(), t.options);
        run_to(whole, 45);
        run_to(windows, 45);
        EXPECT_GT(windows.counters().most_intersections, (grows ? 1 : 4) * 640U);
        EXPECT_TRUE(same_state(whole, windows));
    }
}

TEST(Training, a_driver_with_few_allocations_or_the_largest_bindings_trains_the_same_bits) {
    TinyTraining t = tiny_training();
    Trainer whole = t.trainer();
    run_to(whole, 30);
    for (const char* fault :
         {"allocations:8,timestamps:0", "binding:4294967295,allocation:1099511627776",
          "buffers:28,own_subgroups"}) {
        SCOPED_TRACE(fault);
        ::setenv("DARB_FAULT", fault, 1);
        Device other{test::device_options()};
        ::unsetenv("DARB_FAULT");
        Trainer trainer(other, t.dataset, t.photos, t.start(), t.options);
        run_to(trainer, 30);
        EXPECT_TRUE(same_state(whole, trainer));
    }
}

// Whether opacities fall when iteration 26 begins: an evaluation at the iteration of a reset shows
// the scene that was trained.
bool resets_after_25(int densify_until, bool late_resets) {
    TinyTraining t = tiny_training();
    t.options.opacity_reset_interval = 25;
    t.options.densify_until = densify_until;
    t.options.late_resets = late_resets;
    t.options.prune_opacity = 0.05f;
    t.options.opacity_lr = 0.05f;
    Trainer trainer = t.trainer();
    const auto largest = [&] {
        const SplatModel model = trainer.model();
        return *std::max_element(model.opacity_logit.begin(), model.opacity_logit.end());
    };
    run_to(trainer, 25);
    const float before = largest();
    EXPECT_GT(before, -1);
    run_to(trainer, 26);
    return largest() < before - 1;
}

TEST(Training, opacities_are_reset_where_density_control_goes_on_for_another_interval) {
    EXPECT_TRUE(resets_after_25(50, false));
    EXPECT_FALSE(resets_after_25(49, false));
    EXPECT_TRUE(resets_after_25(49, true));
    EXPECT_FALSE(resets_after_25(25, true));
}

TEST(Training, a_kernel_that_covers_less_has_longer_lengths) {
    TinyTraining t = tiny_training();
    t.options.kernel = KERNEL_RAISED_COSINE;
    const double length = equal_area_scale(t.options.kernel, t.options.footprint);
    const auto trained = [&](bool by_area, double times) {
        TinyTraining own = t;
        own.options.lengths_by_area = by_area;
        own.options.initial_scale = static_cast<float>(times);
        own.options.clone_split_extent *= static_cast<float>(times);
        own.options.prune_extent *= static_cast<float>(times);
        own.options.largest_scale = static_cast<float>(times);
        own.options.scale_weight /= static_cast<float>(times);
        if (times > 1) own.options.scale_lr = 1.5f * Schedule(own.options).first.scale;
        Trainer trainer = own.trainer();
        run_to(trainer, 40);
        EXPECT_GT(trainer.counters().cloned_or_split, 5U);
        return trainer.model();
    };
    const SplatModel by_area = trained(true, 1), by_hand = trained(false, length);
    const SplatModel plain = trained(false, 1);
    ASSERT_EQ(by_area.size(), by_hand.size());
    double difference = 0;  // in the mean: where Adam has no gradient, rounding decides its step
    for (size_t i = 0; i < by_area.log_scale.size(); ++i)
        difference += std::abs(by_area.log_scale[i] - by_hand.log_scale[i]);
    EXPECT_LT(difference / double(by_area.log_scale.size()), 1e-3);
    EXPECT_NE(by_area.size(), plain.size());
}

TEST(Training, no_scale_grows_beyond_the_largest) {
    const auto largest = [](float limit) {
        TinyTraining t = tiny_training();
        t.options.largest_scale = limit;
        t.options.initial_scale = 0.01f;
        t.options.scale_lr = 0.5f;
        Trainer trainer = t.trainer();
        run_to(trainer, 40);
        const SplatModel model = trainer.model();
        const double log_scale = *std::max_element(model.log_scale.begin(), model.log_scale.end());
        return std::exp(log_scale) / (scene_reach(t.dataset) * Schedule(t.options).length_scale);
    };
    EXPECT_GT(largest(0), 0.11) << "0: no limit";
    EXPECT_LE(largest(0.1f), 0.1 * (1 + 1e-6));
}

TEST(Training, splats_beside_a_photo_fade_where_no_point_is_as_near) {
    const auto opacity_beside_a_photo = [](float clearance) {
        TinyTraining t = tiny_training();
        t.options.clearance = clearance;
        t.options.densify_until = 0;
        SplatModel start = t.start();
        const glm::dvec3 beside = t.dataset.views[1].camera.centre() * 0.9;  // points are around 0
        for (int c = 0; c < 3; ++c) start.position[c] = static_cast<float>(beside[c]);
        Trainer trainer(shared_device(), t.dataset, t.photos, start, t.options);
        run_to(trainer, 40);
        return trainer.model().opacity_logit[0] - start.opacity_logit[0];
    };
    EXPECT_LT(opacity_beside_a_photo(0.5f), -4);
    EXPECT_GT(opacity_beside_a_photo(0), -4);
}

// A colour whose square is beyond float32: SSIM's windows there have no finite gradient.
TEST(Training, more_bad_gradients_than_one_in_a_thousand_stop_the_run) {
    const TinyTraining t = tiny_training({.splats = 600});
    SplatModel start = t.start();
    start.sh_dc[0] = 1e28f;
    Trainer trainer(shared_device(), t.dataset, t.photos, start, t.options);
    try {
        run_to(trainer, 20);
        trainer.drain();
        ADD_FAILURE() << "no error";
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("more than 1 in 1000"), std::string::npos) << e.what();
        EXPECT_NE(std::string(e.what()).find("darb check"), std::string::npos) << e.what();
    }
}

// Each kernel in one footprint only: gradients of both are compared with double elsewhere.
TEST(Training, every_kernel_brings_the_loss_down_long) {
    for (int kernel = 0; kernel < KERNEL_ROWS; ++kernel) {
        const bool exact = kernel % 2 == 1 && has_exact_footprint(kernel);
        SCOPED_TRACE(std::string(kernel_name(kernel)) + (exact ? " exact" : " psi"));
        TinyTraining t = tiny_training();
        t.options.kernel = kernel;
        t.options.footprint = exact ? Footprint::exact : Footprint::psi;
        t.options.densify_until = 0;
        t.options.sh_degree = 0;
        std::vector<double> losses;
        Trainer trainer = t.trainer();
        trainer.on_result = [&](const IterationResult& r) { losses.push_back(r.loss); };
        run_to(trainer, 60);
        trainer.drain();
        double first = 0, last = 0;  // sums over two epochs of five views
        for (int i = 0; i < 10; ++i) first += losses[i], last += losses[50 + i];
        EXPECT_LT(last, 0.9 * first);
        EXPECT_EQ(trainer.counters().bad_gradients, 0U);
    }
}

}  // namespace
}  // namespace darb::test
