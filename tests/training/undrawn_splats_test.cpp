// SPDX-License-Identifier: MIT
// Splats that nothing draws any more leave a run after growth, and leave no trace: pictures and the
// other splats have the bits that they would have beside them.
#include "engine/scene/edit_splats.h"
#include "shaders/shared/limits.h"
#include "tests/support/resumed_run.h"

namespace darb::test {
namespace {

// Without growth. Every fifth of the rounds that there would be drops splats, up to the mean from
// iteration 51 on: after iteration 50 with an interval of 10, never with one of 11.
TinyTraining fading_splats(int interval) {
    TinyTraining t = tiny_training();
    t.options.densify_from = 11;
    t.options.densify_until = 12;
    t.options.densify_interval = interval;
    t.options.opacity_weight = 2;
    t.options.opacity_lr = 0.5f;
    return t;
}

TEST(UndrawnSplats, leave_the_run_and_no_trace) {
    const TinyTraining t = fading_splats(10), beside = fading_splats(11);
    Trainer without = t.trainer(), with = beside.trainer();
    std::vector<int> rounds;
    without.on_round = [&](int iteration, const DensityResult& result) {
        rounds.push_back(iteration);
        EXPECT_EQ(result.grown, 0U);
        EXPECT_EQ(result.after, result.before - result.pruned);
    };
    run_and_drain(without, 60);
    run_and_drain(with, 60);
    EXPECT_EQ(rounds, (std::vector<int>{50}));
    EXPECT_GT(without.counters().undrawn, 5U);
    EXPECT_EQ(without.splat_count() + without.counters().undrawn, with.splat_count());
    EXPECT_GT(without.splat_count(), 5U);
    for (std::size_t v = 0; v < t.dataset.views.size(); ++v)
        EXPECT_EQ(without.render(without.camera(v)).data, with.render(with.camera(v)).data) << v;
    SplatModel left = without.model(), all = with.model();
    drop_undrawn(ALPHA_CUTOFF_DEFAULT, 0, left);
    drop_undrawn(ALPHA_CUTOFF_DEFAULT, 0, all);
    for (int a = 0; a < kAttributeCount; ++a)
        EXPECT_EQ(attribute_values(left, a), attribute_values(all, a)) << attribute_name(a);
}

TEST(UndrawnSplats, a_resumed_run_equals_one_that_never_stopped) {
    const TinyTraining t = fading_splats(10);
    Trainer whole = t.trainer();
    run_to(whole, 60);
    EXPECT_GT(whole.counters().undrawn, 5U);
    expect_resumes(t, whole, {49, 50, 51, 55});
}

TEST(UndrawnSplats, stay_where_a_number_was_asked_for) {
    TinyTraining t = fading_splats(10);
    t.options.strategy = Strategy::budget;
    t.options.max_splats = 60;
    Trainer trainer = t.trainer();
    run_and_drain(trainer, 60);
    EXPECT_EQ(trainer.counters().undrawn, 0U);
    EXPECT_EQ(trainer.splat_count(), 60U);
}

}  // namespace
}  // namespace darb::test
