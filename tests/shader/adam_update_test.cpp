// SPDX-License-Identifier: MIT
// The Adam step inside project_backward.comp against Adam in double, and what it must not change.
#include "engine/reference/reference_density_control.h"

#include <algorithm>

#include "tests/support/backward_pass.h"
#include "tests/support/compare_arrays.h"
#include "tests/support/test_scene.h"

namespace darb::test {
namespace {

constexpr AdamStep kRates{.rate = {2e-3f, 5e-3f, 1e-3f, 0.025f, 2.5e-3f, 1.25e-4f}};

double rate_of(int attribute) {
    return kRates.rate[static_cast<size_t>(attribute)];
}

struct Training {
    TestScene scene;
    Partials partials;

    explicit Training(size_t count = 50, std::uint64_t seed = 61)
        : scene(random_scene({.count = count, .seed = seed})),
          partials(Partials::random(count, seed + 1)) {}

    PassState gradient(const PassState& state) const {
        return run_backward_pass(scene.model, scene.camera, 3, UPDATE_STORE, state, partials);
    }
    PassState update(const PassState& state, int t, int degree = 3) const {
        return run_backward_pass(scene.model, scene.camera, degree, UPDATE_ADAM, state, partials,
                                 adam_step(kRates, t));
    }
};

/// Adam in double on the device's own gradient. Moves are compared in units of the learning rate.
void expect_step_matches(const PassState& before, const PassState& gradient, const PassState& after,
                         int t) {
    const auto g32 = gradient.d;
    for (int a = 0; a < kAttributeCount; ++a) {
        if (before.parameters[a].empty()) continue;
        std::vector<double> x(before.parameters[a].begin(), before.parameters[a].end());
        std::vector<double> first, second, move, got_move, got_first, got_second;
        for (size_t i = 0; i < x.size(); ++i) {
            first.push_back(before.moments[a][2 * i]);
            second.push_back(before.moments[a][2 * i + 1]);
            got_first.push_back(after.moments[a][2 * i]);
            got_second.push_back(after.moments[a][2 * i + 1]);
        }
        const std::vector<double> g(g32[a].begin(), g32[a].end());
        reference::adam_step<double>(x, g, first, second, rate_of(a), t);
        for (size_t i = 0; i < x.size(); ++i) {
            const double was = before.parameters[a][i];
            move.push_back((x[i] - was) / rate_of(a));
            got_move.push_back((double(after.parameters[a][i]) - was) / rate_of(a));
            // The parameter itself is rounded, which limits the accuracy of the move.
            const double rounding = std::abs(was) * 0x1p-23 / rate_of(a);
            EXPECT_NEAR(got_move[i], move[i], 2e-5 * (1 + std::abs(move[i])) + rounding)
                << attribute_name(a) << " " << i << ", step " << t;
        }
        EXPECT_TRUE(compare(fmt::format("{} first moment", attribute_name(a)), first, got_first,
                            tolerance("adam_float32")));
        EXPECT_TRUE(compare(fmt::format("{} second moment", attribute_name(a)), second, got_second,
                            tolerance("adam_float32")));
    }
}

TEST(AdamUpdate, steps_match_double_while_gradients_change) {
    Training training;
    PassState state = start_state(training.scene.model);
    for (int t = 1; t <= 6; ++t) {
        training.partials = Partials::random(50, 100 + static_cast<std::uint64_t>(t));
        for (int a = 0; a < kAttributeCount; ++a)
            attribute_values(training.scene.model, a) = state.parameters[a];
        const PassState after = training.update(state, t);
        expect_step_matches(state, training.gradient(state), after, t);
        EXPECT_NE(after.parameters, state.parameters);
        state = after;
    }
}

TEST(AdamUpdate, late_steps_match_double) {
    for (const int t : {100, 1000, 30'000}) {
        Training training;
        PassState state = start_state(training.scene.model);
        Pcg32 rng(static_cast<std::uint64_t>(t));
        for (auto& moments : state.moments)
            for (size_t i = 0; i < moments.size(); i += 2) {
                moments[i] = static_cast<float>(rng.uniform(-1e-3, 1e-3));
                moments[i + 1] = static_cast<float>(rng.uniform(1e-8, 1e-5));
            }
        expect_step_matches(state, training.gradient(state), training.update(state, t), t);
    }
}

// The other attributes step every time, as they do otherwise.
TEST(AdamUpdate, harmonics_step_every_fourth_time_of_the_mean_gradient) {
    constexpr int kEvery = 4;
    Training training;
    PassState state = start_state(training.scene.model);
    const size_t n = state.parameters[kShRest].size();
    std::vector<double> x(state.parameters[kShRest].begin(), state.parameters[kShRest].end());
    std::vector<double> first(n), second(n), mean(n);
    for (int t = 1; t <= 3 * kEvery; ++t) {
        training.partials = Partials::random(50, 200 + static_cast<std::uint64_t>(t));
        for (int a = 0; a < kAttributeCount; ++a)
            attribute_values(training.scene.model, a) = state.parameters[a];
        const auto gradient = training.gradient(state).d[kShRest];
        for (size_t i = 0; i < n; ++i) mean[i] += double(gradient[i]) / kEvery;
        AdamStep rates = kRates;
        rates.rest_every = kEvery;
        const PassState after =
            run_backward_pass(training.scene.model, training.scene.camera, 3, UPDATE_ADAM, state,
                              training.partials, adam_step(rates, t));
        const PassState same = training.update(state, t);
        for (int a = 0; a < kShRest; ++a) EXPECT_EQ(after.parameters[a], same.parameters[a]);
        if (t % kEvery != 0) {
            EXPECT_EQ(after.parameters[kShRest], state.parameters[kShRest]) << t;
            EXPECT_EQ(after.moments[kShRest], state.moments[kShRest]) << t;
        } else {
            reference::adam_step<double>(x, mean, first, second, rate_of(kShRest), t / kEvery);
            for (size_t i = 0; i < n; ++i)
                EXPECT_NEAR(after.parameters[kShRest][i], x[i],
                            1e-4 * rate_of(kShRest) + 2e-7 * std::abs(x[i]))
                    << i << ", step " << t;
            mean.assign(n, 0.0);
            EXPECT_EQ(after.rest_sum, std::vector<float>(n, 0.0f));
        }
        state = after;
    }
}

TEST(AdamUpdate, unseen_splats_decay_and_move_on) {
    Training training(20);
    training.partials.count.assign(20, 0);
    PassState state = start_state(training.scene.model);
    for (auto& moments : state.moments)
        for (size_t i = 0; i < moments.size(); i += 2) {
            moments[i] = 0.5f;
            moments[i + 1] = 0.25f;
        }
    const PassState after = training.update(state, 10);
    for (int a = 0; a < kAttributeCount; ++a)
        for (size_t i = 0; i < after.parameters[a].size(); ++i) {
            EXPECT_FLOAT_EQ(after.moments[a][2 * i], 0.45f);
            EXPECT_FLOAT_EQ(after.moments[a][2 * i + 1], 0.24975f);
            EXPECT_NE(after.parameters[a][i], state.parameters[a][i]);
        }
    EXPECT_EQ(after.gradient_sum, state.gradient_sum) << "unseen frames do not count";
}

TEST(AdamUpdate, zero_moments_and_zero_gradient_move_nothing) {
    Training training(20);
    training.partials.count.assign(20, 0);
    const PassState state = start_state(training.scene.model);
    EXPECT_EQ(training.update(state, 3000), state);
}

// An unseen splat with mcmc: its gradient is that of the regularisers alone, weight o (1 - o) and
// weight s.
TEST(AdamUpdate, regularisers_pull_opacity_and_scale) {
    Training training(20);
    training.partials.count.assign(20, 0);
    const PassState state = start_state(training.scene.model);
    AdamStep step = adam_step(kRates, 1);
    step.opacity_weight = 0.3f;
    step.scale_weight = 0.7f;
    step.regularise_unseen = true;
    const PassState after = run_backward_pass(training.scene.model, training.scene.camera, 3,
                                              UPDATE_ADAM, state, training.partials, step);
    for (size_t i = 0; i < 20; ++i) {
        const double o = 1 / (1 + std::exp(-double(state.parameters[kOpacityLogit][i])));
        EXPECT_NEAR(after.moments[kOpacityLogit][2 * i], 0.1 * 0.3 * o * (1 - o), 1e-6);
        EXPECT_LT(after.parameters[kOpacityLogit][i], state.parameters[kOpacityLogit][i]);
    }
    for (size_t i = 0; i < 60; ++i) {
        const double scale = std::exp(double(state.parameters[kLogScale][i]));
        EXPECT_NEAR(after.moments[kLogScale][2 * i], 0.1 * 0.7 * scale, 1e-6 * (1 + scale));
        EXPECT_LT(after.parameters[kLogScale][i], state.parameters[kLogScale][i]);
    }
    EXPECT_EQ(after.parameters[kPosition], state.parameters[kPosition]);
}

// An unseen splat whose gradient is that of the regularisers alone: weight s of the smallest scale,
// of the first of equal ones, and none beyond the limit.
TEST(AdamUpdate, flatness_shortens_the_smallest_axis_alone) {
    Training training(20);
    training.partials.count.assign(20, 0);
    PassState state = start_state(training.scene.model);
    std::vector<float>& scales = state.parameters[kLogScale];
    for (size_t c = 0; c < 3; ++c) scales[c] = -1;
    for (size_t c = 3; c < 6; ++c) scales[c] = -100;
    AdamStep step = adam_step(kRates, 1);
    step.flatness_weight = 0.7f;
    step.regularise_unseen = true;
    const PassState after = run_backward_pass(training.scene.model, training.scene.camera, 3,
                                              UPDATE_ADAM, state, training.partials, step);
    for (size_t i = 0; i < 20; ++i) {
        const auto first = scales.begin() + std::ptrdiff_t(3 * i);
        const auto least = static_cast<size_t>(std::min_element(first, first + 3) - first);
        for (size_t c = 0; c < 3; ++c) {
            const double scale =
                c == least && i != 1 ? std::exp(double(first[std::ptrdiff_t(c)])) : 0;
            EXPECT_NEAR(after.moments[kLogScale][2 * (3 * i + c)], 0.1 * 0.7 * scale,
                        1e-6 * (1 + scale))
                << i << " " << c;
        }
    }
    EXPECT_NE(after.parameters[kLogScale], state.parameters[kLogScale]);
    EXPECT_EQ(after.parameters[kOpacityLogit], state.parameters[kOpacityLogit]);
}

// Adam would turn these into full steps, although no photo has said anything yet.
TEST(AdamUpdate, regularisers_leave_what_the_frame_does_not_show) {
    Training training(20);
    const PassState state = start_state(training.scene.model);
    AdamStep step = adam_step(kRates, 1);
    step.opacity_weight = 0.3f;
    step.scale_weight = 0.7f;
    const PassState plain = training.update(state, 1);
    const PassState after = run_backward_pass(training.scene.model, training.scene.camera, 3,
                                              UPDATE_ADAM, state, training.partials, step);
    int seen = 0;
    for (size_t i = 0; i < 20; ++i) {
        const bool shown = training.partials.count[i] > 0;
        seen += shown;
        EXPECT_EQ(after.moments[kOpacityLogit][2 * i] != plain.moments[kOpacityLogit][2 * i], shown)
            << i;
        for (size_t at = 3 * i; at < 3 * i + 3; ++at)
            EXPECT_EQ(after.moments[kLogScale][2 * at] != plain.moments[kLogScale][2 * at], shown)
                << i;
    }
    EXPECT_GT(seen, 0);
    EXPECT_LT(seen, 20);
}

// exp(100) overflows float: beyond the limit the regulariser has no gradient, as everywhere that a
// scale is read.
TEST(AdamUpdate, regularisers_leave_scales_beyond_their_limit) {
    Training training(20);
    training.partials.count.assign(20, 0);
    PassState state = start_state(training.scene.model);
    state.parameters[kLogScale] = std::vector<float>(60, 100.0f);
    AdamStep step = adam_step(kRates, 1);
    step.scale_weight = 0.7f;
    step.regularise_unseen = true;
    const PassState after = run_backward_pass(training.scene.model, training.scene.camera, 3,
                                              UPDATE_ADAM, state, training.partials, step);
    EXPECT_EQ(after.parameters[kLogScale], state.parameters[kLogScale]);
}

TEST(AdamUpdate, no_scale_grows_beyond_the_largest) {
    Training training(20);
    const PassState state = start_state(training.scene.model);
    AdamStep step = adam_step(kRates, 1);
    const auto updated = [&] {
        return run_backward_pass(training.scene.model, training.scene.camera, 3, UPDATE_ADAM, state,
                                 training.partials, step);
    };
    const PassState free = updated();
    std::vector<float> sorted = state.parameters[kLogScale];
    std::sort(sorted.begin(), sorted.end());
    step.largest_log_scale = sorted[30];  // half of them are larger already
    const PassState limited = updated();
    int held = 0;
    for (size_t i = 0; i < 60; ++i) {
        const float before = state.parameters[kLogScale][i];
        const float limit = std::max(before, step.largest_log_scale);
        EXPECT_EQ(limited.parameters[kLogScale][i], std::min(free.parameters[kLogScale][i], limit));
        held += free.parameters[kLogScale][i] > limit;
    }
    EXPECT_GT(held, 3);
    EXPECT_EQ(limited.moments, free.moments);
}

TEST(AdamUpdate, splats_beside_the_camera_fade) {
    Training training(20);
    const SplatModel& model = training.scene.model;
    const PassState state = start_state(model);
    AdamStep step = adam_step(kRates, 1);
    const auto updated = [&] {
        return run_backward_pass(model, training.scene.camera, 3, UPDATE_ADAM, state,
                                 training.partials, step);
    };
    const PassState free = updated();
    const auto from_camera = [&](size_t i) {  // after the step
        const std::vector<float>& p = free.parameters[kPosition];
        return glm::distance(training.scene.camera.centre(),
                             glm::dvec3(p[3 * i], p[3 * i + 1], p[3 * i + 2]));
    };
    std::vector<double> distances;
    for (size_t i = 0; i < 20; ++i) distances.push_back(from_camera(i));
    std::sort(distances.begin(), distances.end());
    step.clearance = static_cast<float>((distances[9] + distances[10]) / 2);
    PassState faded = updated();
    for (size_t i = 0; i < 20; ++i)
        EXPECT_NEAR(faded.parameters[kOpacityLogit][i],
                    free.parameters[kOpacityLogit][i] - (from_camera(i) < step.clearance), 1e-5);
    faded.parameters[kOpacityLogit] = free.parameters[kOpacityLogit];
    EXPECT_EQ(faded, free) << "nothing else changes";
    const PassState gradient = run_backward_pass(model, training.scene.camera, 3, UPDATE_STORE,
                                                 state, training.partials, step);
    EXPECT_EQ(gradient.parameters, state.parameters) << "no update, no fading";
}

TEST(AdamUpdate, an_overflowed_frame_changes_nothing) {
    Training training;
    PassState state = training.update(start_state(training.scene.model), 1);
    state.status.overflow = 1;
    EXPECT_EQ(training.update(state, 2), state);
    EXPECT_EQ(training.gradient(state), state);
}

TEST(AdamUpdate, gradient_sum_adds_up_over_frames) {
    Training training;
    PassState state = start_state(training.scene.model);
    const PassState once = training.update(state, 1);
    state.gradient_sum = once.gradient_sum;
    const PassState twice = training.update(state, 1);
    int seen = 0;
    for (size_t i = 0; i < 50; ++i) {
        EXPECT_FLOAT_EQ(twice.gradient_sum[i].x, 2 * once.gradient_sum[i].x);
        EXPECT_EQ(twice.gradient_sum[i].y, training.partials.count[i] > 0 ? 2 : 0);
        seen += once.gradient_sum[i].x > 0;
    }
    EXPECT_EQ(seen, 40);
}

TEST(AdamUpdate, a_gradient_that_is_not_finite_is_counted_and_skipped) {
    const float infinity = std::numeric_limits<float>::infinity();
    // 1e25 is finite, but its square would stay in the second moment as infinity.
    for (const float bad : {std::nanf(""), infinity, -infinity, 1e25f})
        for (size_t value = 0; value < 9; ++value) {
            SCOPED_TRACE(fmt::format("{} in partial {}", bad, value));
            Training training(10);
            const PassState start = start_state(training.scene.model);
            PassState expected = training.update(start, 1);
            ASSERT_GT(training.partials.count[3], 0U);
            training.partials.intersections[training.partials.begin[3]][value] = bad;
            const PassState after = training.update(start, 1);
            EXPECT_EQ(after.status.bad_gradients, 1U);
            expected.status.bad_gradients = 1;
            expected.gradient_sum[3] = start.gradient_sum[3];
            for (int a = 0; a < kAttributeCount; ++a) {  // splat 3 as it was
                const size_t stride = start.parameters[a].size() / 10;
                for (size_t i = 3 * stride; i < 4 * stride; ++i)
                    expected.parameters[a][i] = start.parameters[a][i];
                for (size_t i = 6 * stride; i < 8 * stride; ++i)
                    expected.moments[a][i] = start.moments[a][i];
            }
            EXPECT_EQ(after, expected);
        }
}

TEST(AdamUpdate, bands_above_the_degree_in_use_stay_as_they_are) {
    Training training;
    const PassState start = start_state(training.scene.model);
    const PassState after = training.update(start, 1, 1);
    size_t moved = 0;
    for (size_t i = 0; i < start.parameters[kShRest].size(); ++i) {
        const bool used = i % 45 < 9;  // degree 1 of 3: three coefficients of three channels
        const bool same = after.parameters[kShRest][i] == start.parameters[kShRest][i] &&
                          after.moments[kShRest][2 * i] == 0;
        EXPECT_TRUE(used || same) << i;
        moved += !same;
    }
    EXPECT_GT(moved, 200U);
}

}  // namespace
}  // namespace darb::test
