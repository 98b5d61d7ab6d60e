// SPDX-License-Identifier: MIT
// Training of kernels with a shape per splat: every splat learns its shape, under every strategy
// and with anti-aliasing; a run repeats and resumes bit for bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/kernels/shaped_kernel.h"
#include "engine/scene/ply.h"
#include "engine/scene/splat_model.h"
#include "tests/support/every_kernel.h"
#include "tests/support/resumed_run.h"

namespace darb::test {
namespace {

using Param = std::pair<int, Strategy>;

class ShapedTraining : public testing::TestWithParam<Param> {
  protected:
    TinyTraining tiny() const {
        const auto [kernel, strategy] = GetParam();
        TinyTraining t = tiny_training();
        t.options.kernel = kernel;
        t.options.footprint = has_exact_footprint(kernel) ? Footprint::exact : Footprint::psi;
        t.options.strategy = strategy;
        t.options.sh_degree = 1;
        if (strategy != Strategy::adc) t.options.max_splats = 90;
        return t;
    }
};

std::vector<Param> every_kernel_and_strategy() {
    std::vector<Param> all;
    for (const int kernel : every_shaped_kernel())
        for (const Strategy strategy : {Strategy::adc, Strategy::mcmc, Strategy::budget})
            all.emplace_back(kernel, strategy);
    return all;
}

TEST_P(ShapedTraining, shapes_are_learned_and_a_resumed_run_equals_one_that_never_stopped) {
    const TinyTraining t = tiny();
    Trainer whole = t.trainer();
    run_to(whole, 26);
    const SplatModel model = whole.state().model;
    ASSERT_EQ(model.shape.size(), model.size());
    const auto [least, most] = std::minmax_element(model.shape.begin(), model.shape.end());
    EXPECT_GT(*most - *least, 0.02f) << "each its own";
    EXPECT_TRUE(std::ranges::all_of(model.shape, [](float s) { return std::isfinite(s); }));
    EXPECT_EQ(whole.counters().bad_gradients, 0U);
    expect_resumes(t, whole, {15});
    EXPECT_EQ(parse_ply(encode_ply(model), "memory").shape, model.shape);
}

INSTANTIATE_TEST_SUITE_P(strategies, ShapedTraining, testing::ValuesIn(every_kernel_and_strategy()),
                         [](const auto& p) {
                             std::string name(kernel_name(p.param.first));
                             for (char& c : name) c = c == ':' || c == ',' ? '_' : c;
                             const bool some = p.param.first == KERNEL_BETA;
                             return name + "_" + std::string(strategy_name(p.param.second)) +
                                    (some ? "" : "_long");
                         });

// Photos of splats with one exponent, and the same splats at the start shape: training finds the
// exponent.
TEST(ShapedTrainingRecovery, a_picture_of_exponent_4_is_fitted_from_2_long) {
    TinyTraining t = tiny_training();
    TestScene truth = random_scene({.count = 60,
                                    .width = 64,
                                    .height = 48,
                                    .sh_degree = 0,
                                    .min_log_scale = -2.2,
                                    .max_log_scale = -1.6,
                                    .seed = 91});
    set_kernel(truth.model, KERNEL_GENERALIZED_EXPONENTIAL);
    truth.model.shape.assign(truth.model.size(), std::log(2.0f));
    Renderer renderer(shared_device(), truth.model);
    for (std::size_t v = 0; v < t.photos.size(); ++v)
        t.photos[v] = with_alpha(to_8bit(renderer.render(t.dataset.views[v].camera)));
    SplatModel start = truth.model;
    start.shape.assign(start.size(), 0.0f);
    t.options.kernel = KERNEL_GENERALIZED_EXPONENTIAL;
    t.options.iterations = 400;
    t.options.sh_degree = 0;
    t.options.densify_until = 0;
    t.options.opacity_reset_interval = 1000;
    t.options.shape_lr = 0.02f;
    Trainer trainer(shared_device(), t.dataset, t.photos, start, t.options);
    run_to(trainer, 300);
    std::vector<float> shapes = trainer.state().model.shape;
    std::ranges::sort(shapes);
    const auto exponent = [&](double share) {
        return 2 *
               std::exp(
                   shapes[static_cast<std::size_t>(share * static_cast<double>(shapes.size()))]);
    };
    EXPECT_NEAR(exponent(0.5), 4, 0.4) << "the median";
    EXPECT_GT(exponent(0.2), 2.8);
    EXPECT_LT(exponent(0.8), 5.5);
}

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
