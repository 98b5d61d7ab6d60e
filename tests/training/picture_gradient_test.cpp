// SPDX-License-Identifier: MIT
// Training with a loss of the caller's: Trainer::set_picture_gradient.
#include "engine/core/error.h"
#include "tests/support/resumed_run.h"
#include "tests/support/tiny_training.h"

namespace darb::test {
namespace {

/// dL/d(picture) of the mean absolute difference, which the built-in loss is without SSIM.
ImageF of_absolute_difference(const TrainingPicture& picture) {
    ImageF d = composite(picture.photo, picture.background);
    const float share = 1.0f / static_cast<float>(d.data.size());
    for (size_t i = 0; i < d.data.size(); ++i) {
        const float apart = picture.image.data[i] - d.data[i];
        d.data[i] = apart > 0 ? share : apart < 0 ? -share : 0;
    }
    return d;
}

TEST(Training, a_loss_of_the_callers_trains_as_the_built_in_one_does) {
    TinyTraining t = tiny_training();
    t.options.lambda_dssim = 0;
    Trainer built_in = t.trainer(), own = t.trainer();
    int asked = 0;
    std::vector<int> rounds;
    double last_loss = 0, own_loss = 0;
    own.set_picture_gradient([&](const TrainingPicture& picture) {
        EXPECT_EQ(picture.image.data.size() / 3, picture.photo.data.size() / 4);
        asked = std::max(asked, picture.iteration);
        return of_absolute_difference(picture);
    });
    own.on_round = [&](int iteration, const DensityResult& result) {
        rounds.push_back(iteration);
        EXPECT_EQ(result.after, own.splat_count());
    };
    built_in.on_result = [&](const IterationResult& r) { last_loss = r.loss; };
    own.on_result = [&](const IterationResult& r) { own_loss = r.loss; };
    run_to(built_in, 60);
    run_to(own, 60);
    EXPECT_EQ(asked, 60);
    EXPECT_NEAR(own_loss, last_loss, 0.15 * last_loss);
    EXPECT_NEAR(own.splat_count(), built_in.splat_count(), 0.2 * built_in.splat_count());
    ASSERT_GT(rounds.size(), 1U);
    EXPECT_GE(rounds[0], t.options.densify_from);
}

TEST(Training, a_loss_that_throws_or_is_no_gradient_leaves_the_iteration_to_be_done) {
    const TinyTraining t = tiny_training();
    Trainer whole = t.trainer(), failed = t.trainer();
    run_to(whole, 30);
    for (int i = 0; i < 30; ++i) {
        failed.set_picture_gradient(
            [](const TrainingPicture&) -> ImageF { throw Error("mine", "fails"); });
        EXPECT_THROW(failed.step(), Error);
        failed.set_picture_gradient([](const TrainingPicture&) { return ImageF(2, 2, 3); });
        EXPECT_THROW(failed.step(), Error);
        failed.set_picture_gradient(nullptr);
        EXPECT_EQ(failed.iteration(), i);
        failed.step();
    }
    EXPECT_TRUE(same_state(whole, failed));
}

// At iteration 20 a round of density control and a probe of the first degree are due. The loss
// fails in the first and in the second of the probe's trials; the run goes on as if it had not.
TEST(Training, a_loss_that_throws_while_a_degree_is_probed_leaves_the_run_as_it_was) {
    TinyTraining t = tiny_training({.views = 12});
    t.options.probe_sh = true;
    t.options.sh_degree = 1;
    t.options.iterations = 40;
    Trainer whole = t.trainer(), failed = t.trainer();
    std::vector<int> rounds, results, told_rounds, told_results;
    whole.on_round = [&](int iteration, const DensityResult&) { rounds.push_back(iteration); };
    whole.on_result = [&](const IterationResult& r) { results.push_back(r.iteration); };
    failed.on_round = [&](int iteration, const DensityResult&) {
        told_rounds.push_back(iteration);
    };
    failed.on_result = [&](const IterationResult& r) { told_results.push_back(r.iteration); };
    int calls = 0, fails_at = -1;
    const auto loss = [&](const TrainingPicture& picture) {
        if (calls++ == fails_at) throw Error("mine", "fails");
        return of_absolute_difference(picture);
    };
    whole.set_picture_gradient(loss);
    run_and_drain(whole, 40);
    ASSERT_EQ(whole.probes().size(), 1U);

    failed.set_picture_gradient(loss);
    run_to(failed, 20);
    for (const int at : {0, 77, 210}) {
        calls = 0;
        fails_at = at;
        EXPECT_THROW(failed.step(), Error);
        EXPECT_EQ(failed.iteration(), 20);
        EXPECT_EQ(failed.sh_degree(), 0);
        EXPECT_TRUE(failed.probes().empty());
    }
    fails_at = -1;
    run_and_drain(failed, 40);
    ASSERT_EQ(failed.probes().size(), 1U);
    EXPECT_EQ(failed.probes()[0].gain_db, whole.probes()[0].gain_db);
    EXPECT_TRUE(same_state(whole, failed));
    EXPECT_EQ(told_rounds, rounds);
    EXPECT_EQ(told_results, results);
}

}  // namespace
}  // namespace darb::test
