// SPDX-License-Identifier: MIT
// trainer/probe: what a probe of the degree does with the run that it forks, on a stand-in for a
// run.
#include "trainer/step/held_out_gain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "engine/raster/gpu_splats.h"

namespace darb {
namespace {

TrainOptions probing() {
    TrainOptions options;
    options.iterations = 10'000;
    options.probe_sh = true;
    return options;
}

TrainerState state_at(int iteration) {
    TrainerState state;
    state.iteration = iteration;
    state.model.sh_degree = 0;
    state.model.resize(2);
    state.moments.resize(kAttributeCount);
    state.averaged = 3;
    return state;
}

/// A run whose pictures are better by gain_db where harmonics are in use.
struct FakeRun {
    double gain_db;
    std::vector<TrainerState> restored = {};
    std::vector<int> steps = {}, trained = {}, compared = {};
    std::vector<float> shares = {};

    ProbeFork fork() {
        return {.restore = [this](const TrainerState& state) { restored.push_back(state); },
                .step =
                    [this](int iteration, int view, float share) {
                        steps.push_back(iteration);
                        trained.push_back(view);
                        shares.push_back(share);
                    },
                .fit = {},
                .photo_psnr =
                    [this](int view) {
                        compared.push_back(view);
                        return 20 + gain_db * restored.back().model.sh_degree;
                    }};
    }
};

std::vector<int> views(int count) {
    std::vector<int> all;
    for (int v = 0; v < count; ++v) all.push_back(v);
    return all;
}

TEST(DegreeProbe, is_due_at_its_iteration_until_the_highest_degree) {
    const TrainOptions options = probing();
    const DegreeProbe probe{Schedule(options)};
    EXPECT_FALSE(probe.is_due(999, 0));
    EXPECT_TRUE(probe.is_due(1'000, 0));
    EXPECT_TRUE(probe.is_due(1'000, 2));
    EXPECT_FALSE(probe.is_due(1'000, 3));
    TrainOptions off = options;
    off.probe_sh = false;
    EXPECT_FALSE(DegreeProbe(Schedule(off)).is_due(1'000, 0));
}

TEST(DegreeProbe, both_arms_start_from_the_same_state_and_train_alike) {
    const TrainOptions options = probing();
    DegreeProbe probe{Schedule(options)};
    FakeRun run{.gain_db = 0.5};
    TrainerState state = state_at(1'000);
    probe.run(state, views(20), true, run.fork());
    ASSERT_EQ(run.restored.size(), 2U);
    EXPECT_EQ(run.restored[0].model.sh_degree, 0);
    EXPECT_EQ(run.restored[1].model.sh_degree, 1);
    EXPECT_EQ(run.restored[1].model.sh_rest, std::vector<float>(2 * 9, 0.0f));
    EXPECT_EQ(run.restored[1].moments[kShRest], std::vector<float>(2 * 18, 0.0f));
    for (const TrainerState& start : run.restored) EXPECT_EQ(start.iteration, 1'000);
    ASSERT_EQ(run.steps.size(), 300U);
    for (size_t i = 0; i < 150; ++i) {
        EXPECT_EQ(run.steps[i], 1'001 + static_cast<int>(i));
        EXPECT_EQ(run.steps[150 + i], run.steps[i]);
        EXPECT_EQ(run.trained[150 + i], run.trained[i]);
        EXPECT_EQ(run.shares[150 + i], run.shares[i]);
    }
    EXPECT_EQ(run.shares.front(), 1);
    EXPECT_LT(run.shares.back(), 0.02f) << "rates fall to nothing";
    const std::set<int> trained(run.trained.begin(), run.trained.end());
    for (const int view : run.compared) EXPECT_FALSE(trained.contains(view)) << view;
    EXPECT_GT(run.compared.size(), 0U);
}

TEST(DegreeProbe, a_gain_admits_the_degree_and_tries_the_next_an_interval_later) {
    const TrainOptions options = probing();
    DegreeProbe probe{Schedule(options)};
    FakeRun run{.gain_db = 0.5};
    TrainerState state = state_at(1'000);
    const ProbeResult result = probe.run(state, views(20), true, run.fork());
    EXPECT_EQ(state.model.sh_degree, 1);
    EXPECT_EQ(state.next_probe, 2'000);
    EXPECT_EQ(state.averaged, 0U) << "the mean begins anew";
    EXPECT_TRUE(result.admitted);
    EXPECT_EQ(result.effect, EFFECT_VIEW_COLOUR);
    EXPECT_EQ(result.degree, 1);
    EXPECT_NEAR(result.gain_db, 0.5, 1e-9);
}

TEST(DegreeProbe, a_loss_leaves_the_state_and_tries_again_after_as_many_iterations) {
    const TrainOptions options = probing();
    DegreeProbe probe{Schedule(options)};
    FakeRun run{.gain_db = -0.5};
    TrainerState state = state_at(1'000);
    probe.run(state, views(20), true, run.fork());
    EXPECT_EQ(state.model.sh_degree, 0);
    EXPECT_EQ(state.next_probe, 2'000);
    EXPECT_EQ(state.averaged, 3U);
    state.iteration = 2'000;
    EXPECT_FALSE(probe.run(state, views(20), true, run.fork()).admitted);
    EXPECT_EQ(state.next_probe, 4'000);
}

TEST(DegreeProbe, nothing_is_trained_where_nothing_can_be_measured) {
    const TrainOptions options = probing();
    for (const bool has_room : {false, true}) {
        DegreeProbe probe{Schedule(options)};
        FakeRun run{.gain_db = 0};
        TrainerState state = state_at(1'000);
        const ProbeResult result = probe.run(state, views(has_room ? 7 : 20), has_room, run.fork());
        EXPECT_TRUE(run.restored.empty());
        EXPECT_EQ(result.admitted, has_room) << "few photos admit, no room refuses";
        EXPECT_TRUE(std::isnan(result.gain_db));
    }
}

TrainOptions trying_shutters() {
    TrainOptions options;
    options.iterations = 10'000;
    options.refine_cameras = options.probe_shutter = true;
    return options;
}

TEST(ShutterProbe, is_due_once_after_cameras_began_to_move) {
    const ShutterProbe probe{Schedule(trying_shutters())};
    const int at = ShutterProbe::at(Schedule(trying_shutters()));
    EXPECT_GT(at, 1'000);
    EXPECT_FALSE(probe.is_due(at - 1));
    EXPECT_TRUE(probe.is_due(at));
    EXPECT_FALSE(probe.is_due(at + 1));
    TrainOptions late = trying_shutters();
    late.camera_from = 0.8f;
    EXPECT_GT(ShutterProbe::at(Schedule(late)), 8'000);
    EXPECT_EQ(ShutterProbe::at(Schedule(probing())), 0) << "of a run that does not try";
    EXPECT_FALSE(ShutterProbe{Schedule(probing())}.is_due(0));
}

// Photos set aside are visited by their cameras alone, and judge.
TEST(ShutterProbe, a_gain_on_photos_set_aside_admits_the_state_that_rolls) {
    for (const double gain : {0.3, -0.3}) {
        const ShutterProbe probe{Schedule(trying_shutters())};
        FakeRun run{.gain_db = 0};
        std::vector<int> fitted;
        ProbeFork fork = run.fork();
        fork.fit = [&](int, int view, float) { fitted.push_back(view); };
        fork.photo_psnr = [&](int view) {
            run.compared.push_back(view);
            return 20 + (run.restored.back().cameras.empty() ? 0 : gain);
        };
        TrainerState state = state_at(3'500), rolling = state;
        rolling.cameras = {1.0f};
        const ProbeResult result = probe.run(state, rolling, views(20), fork);
        EXPECT_EQ(result.effect, EFFECT_SHUTTER);
        EXPECT_NEAR(result.gain_db, gain, 1e-9);
        EXPECT_EQ(result.admitted, gain > 0);
        EXPECT_EQ(state.cameras.size(), gain > 0 ? 1U : 0U);
        const std::set<int> trained(run.trained.begin(), run.trained.end());
        for (const int view : fitted) EXPECT_FALSE(trained.contains(view)) << view;
        EXPECT_EQ(std::set<int>(fitted.begin(), fitted.end()),
                  std::set<int>(run.compared.begin(), run.compared.end()));
    }
}

TEST(ShutterProbe, too_few_photos_refuse_unmeasured) {
    FakeRun run{.gain_db = 0};
    TrainerState state = state_at(3'500), rolling = state;
    rolling.cameras = {1.0f};
    const ProbeResult result =
        ShutterProbe{Schedule(trying_shutters())}.run(state, rolling, views(7), run.fork());
    EXPECT_FALSE(result.admitted);
    EXPECT_TRUE(std::isnan(result.gain_db));
    EXPECT_TRUE(state.cameras.empty());
    EXPECT_TRUE(run.restored.empty());
}

TEST(RowBands, each_half_of_the_rows_counts_alone) {
    ImageF image(3, 16, 3);
    ImageU8 photo(3, 16, 4);
    for (size_t p = 0; p < 3 * 16; ++p) {
        photo.data[4 * p + 3] = p % 3 == 2 ? 0 : 255;  // a masked column
        const bool fitted = p / 3 / 2 % 2 == 0;        // two rows a band
        for (size_t c = 0; c < 3; ++c) image.data[3 * p + c] = fitted ? 0.5f : -0.25f;
    }
    const BandError fitted = band_error(image, photo, glm::vec3(0.0f), true, RowBands::fitted);
    const BandError judged = band_error(image, photo, glm::vec3(0.0f), true, RowBands::judged);
    EXPECT_NEAR(fitted.squared, 0.25, 1e-9);
    EXPECT_NEAR(judged.squared, 0.0625, 1e-9);
    const float each = 1.0f / (2 * 8 * 3);  // two columns, eight rows
    for (size_t p = 0; p < 3 * 16; ++p) {
        const bool counts = p % 3 != 2, first = p / 3 / 2 % 2 == 0;
        EXPECT_EQ(fitted.d_image.data[3 * p], counts && first ? each : 0.0f) << p;
        EXPECT_EQ(judged.d_image.data[3 * p], counts && !first ? -each : 0.0f) << p;
    }
}

}  // namespace
}  // namespace darb
