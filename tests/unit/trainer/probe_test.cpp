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
    probe.run(state, views(20), true, run.fork());
    EXPECT_EQ(state.model.sh_degree, 1);
    EXPECT_EQ(state.next_probe, 2'000);
    EXPECT_EQ(state.averaged, 0U) << "the mean begins anew";
    ASSERT_EQ(probe.results().size(), 1U);
    EXPECT_TRUE(probe.results()[0].admitted);
    EXPECT_EQ(probe.results()[0].degree, 1);
    EXPECT_NEAR(probe.results()[0].gain_db, 0.5, 1e-9);
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
    probe.run(state, views(20), true, run.fork());
    EXPECT_EQ(state.next_probe, 4'000);
    EXPECT_FALSE(probe.results()[1].admitted);
}

TEST(DegreeProbe, nothing_is_trained_where_nothing_can_be_measured) {
    const TrainOptions options = probing();
    for (const bool has_room : {false, true}) {
        DegreeProbe probe{Schedule(options)};
        FakeRun run{.gain_db = 0};
        TrainerState state = state_at(1'000);
        probe.run(state, views(has_room ? 7 : 20), has_room, run.fork());
        EXPECT_TRUE(run.restored.empty());
        EXPECT_EQ(probe.results()[0].admitted, has_room) << "few photos admit, no room refuses";
        EXPECT_TRUE(std::isnan(probe.results()[0].gain_db));
    }
}

}  // namespace
}  // namespace darb
