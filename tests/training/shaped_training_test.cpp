// Training of the kernel beta: every splat learns its shape, under every strategy and with
// anti-aliasing; a run repeats, and resumes, bit by bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/scene/ply.h"
#include "tests/support/resumed_run.h"

namespace darb::test {
namespace {

class ShapedTraining : public testing::TestWithParam<Strategy> {
  protected:
    TinyTraining tiny(Footprint footprint = Footprint::exact) const {
        TinyTraining t = tiny_training();
        t.options.kernel = KERNEL_BETA;
        t.options.footprint = footprint;
        t.options.strategy = GetParam();
        t.options.sh_degree = 1;
        if (GetParam() != Strategy::adc) t.options.max_splats = 90;
        return t;
    }
};

TEST_P(ShapedTraining, shapes_are_learned_and_a_resumed_run_equals_one_that_never_stopped) {
    const TinyTraining t = tiny();
    Trainer whole = t.trainer();
    run_to(whole, 26);
    const SplatModel model = whole.state().model;
    ASSERT_EQ(model.shape.size(), model.size());
    const auto [least, most] = std::minmax_element(model.shape.begin(), model.shape.end());
    EXPECT_GT(*most - *least, 0.05f) << "each its own";
    EXPECT_TRUE(std::ranges::all_of(model.shape, [](float s) { return std::isfinite(s); }));
    EXPECT_EQ(whole.counters().bad_gradients, 0U);
    expect_resumes(t, whole, {15});
    EXPECT_EQ(parse_ply(encode_ply(model), "memory").shape, model.shape);
}

INSTANTIATE_TEST_SUITE_P(strategies, ShapedTraining,
                         testing::Values(Strategy::adc, Strategy::mcmc, Strategy::budget),
                         [](const auto& p) { return std::string(strategy_name(p.param)); });

TEST(ShapedTrainingRate, of_0_leaves_every_shape_where_it_starts) {
    TinyTraining t = tiny_training();
    t.options.kernel = KERNEL_BETA;
    t.options.shape_lr = 0;
    t.options.antialias = true;
    Trainer trainer = t.trainer();
    run_to(trainer, 15);
    const SplatModel model = trainer.state().model;
    EXPECT_EQ(model.shape, std::vector<float>(model.size(), 0.0f));
}

}  // namespace
}  // namespace darb::test
