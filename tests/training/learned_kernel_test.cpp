// SPDX-License-Identifier: MIT
// Training that learns the profile of its kernel: a start from a wrong one comes nearer to that of
// the photos, every strategy and batches go with it, a run resumes bit for bit, and what it leaves
// is a kernel as a user's own.
#include <gtest/gtest.h>

#include <filesystem>

#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/learned_profile.h"
#include "engine/scene/ply.h"
#include "tests/support/resumed_run.h"

namespace darb::test {
namespace {

/// The largest distance of two profiles in q / psi, as drawn with the same second moment.
double apart(int one, int other) {
    double largest = 0;
    for (double q = 0; q < 20; q += 0.05)
        largest =
            std::max(largest, std::abs(kernel_value(one, Footprint::psi, q * kernel_psi(one)) -
                                       kernel_value(other, Footprint::psi, q * kernel_psi(other))));
    return largest;
}

class LearnedKernel : public testing::TestWithParam<std::pair<Strategy, int>> {  // and the batch
  protected:
    TinyTraining tiny() const {
        TinyTraining t = tiny_training();
        t.options.learn_kernel = 8;
        t.options.footprint = Footprint::exact;
        t.options.strategy = GetParam().first;
        t.options.batch = GetParam().second;
        t.options.sh_degree = 1;
        if (t.options.strategy != Strategy::adc) t.options.max_splats = 90;
        return t;
    }
};

TEST_P(LearnedKernel, changes_and_a_resumed_run_equals_one_that_never_stopped) {
    const TinyTraining t = tiny();
    Trainer whole = t.trainer();
    const int first = whole.kernel();
    run_to(whole, 32);
    EXPECT_NE(whole.kernel(), first);
    EXPECT_EQ(whole.counters().bad_gradients, 0U);
    const SplatModel model = whole.model();
    EXPECT_EQ(model.kernel, whole.kernel());
    EXPECT_EQ(parse_ply(encode_ply(model), "memory").kernel, whole.kernel());
    expect_resumes(t, whole, {12, 20});
}

INSTANTIATE_TEST_SUITE_P(strategies, LearnedKernel,
                         testing::Values(std::pair(Strategy::adc, 1), std::pair(Strategy::mcmc, 1),
                                         std::pair(Strategy::budget, 4)),
                         [](const auto& p) {
                             return fmt::format("{}_{}", strategy_name(p.param.first),
                                                p.param.second);
                         });

// Photos of splats of one kernel, and the same splats to start from with another.
TEST(LearnedKernelRecovery, a_start_from_a_wrong_kernel_comes_nearer_to_that_of_the_photos) {
    TinyTraining t = tiny_training();
    TestScene truth = random_scene({.count = 60,
                                    .width = 64,
                                    .height = 48,
                                    .sh_degree = 0,
                                    .min_log_scale = -2.2,
                                    .max_log_scale = -1.6,
                                    .seed = 91});
    set_kernel(truth.model, KERNEL_PARABOLIC);
    truth.model.footprint = Footprint::psi;
    Renderer renderer(shared_device(), truth.model);
    for (std::size_t v = 0; v < t.photos.size(); ++v)
        t.photos[v] = with_alpha(to_8bit(renderer.render(t.dataset.views[v].camera)));
    SplatModel start = truth.model;
    set_kernel(start, KERNEL_GAUSSIAN);
    for (float& scale : start.log_scale)  // as wide in the picture
        scale += std::log(static_cast<float>(kernel_psi(KERNEL_PARABOLIC)));
    t.options.kernel = KERNEL_GAUSSIAN;
    t.options.footprint = Footprint::psi;
    t.options.iterations = 96;
    t.options.sh_degree = 0;
    t.options.densify_until = 0;
    t.options.opacity_reset_interval = 1000;
    t.options.learn_kernel = 8;
    t.options.kernel_lr = 0.5f;
    Trainer trainer(shared_device(), t.dataset, t.photos, start, t.options);
    const double before = apart(trainer.kernel(), KERNEL_PARABOLIC);
    run_and_drain(trainer, 96);
    EXPECT_LT(apart(trainer.kernel(), KERNEL_PARABOLIC), 0.6 * before);
}

TEST(LearnedKernelCheckpoint, of_a_run_that_learns_none_is_refused) {
    TinyTraining t = tiny_training();
    Trainer plain = t.trainer();
    run_to(plain, 3);
    const Checkpoint checkpoint{plain.state(), settings_text(t.options),
                                dataset_fingerprint(t.dataset, t.photos), 1.0};
    t.options.learn_kernel = 8;
    EXPECT_THROW(check_resumable(checkpoint, "file", t.options, t.dataset, checkpoint.dataset),
                 Error);
    Trainer learning = t.trainer();
    Trainer::State cut = learning.state();
    cut.profile.pop_back();
    EXPECT_THROW(learning.restore(cut), Error);
}

}  // namespace
}  // namespace darb::test
