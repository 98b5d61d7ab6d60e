// SPDX-License-Identifier: MIT
// Training on the scene that ships with the sources, held-out views as the measure.
#include <nlohmann/json.hpp>

#include "engine/core/files.h"
#include "tests/support/shared_device.h"
#include "trainer/growth/initial_model.h"
#include "trainer/growth/predicted_growth.h"
#include "trainer/options/strategy.h"
#include "trainer/run/run_report.h"
#include "trainer/step/trainer.h"

namespace darb::test {
namespace {

const std::filesystem::path kSources = DARB_SOURCE_DIR;

struct Gain {
    double psnr_before = 0, psnr_after = 0;  // dB, mean over the held-out views
};

Gain train(const Dataset& dataset, const TrainOptions& options) {
    const std::vector<ImageU8> photos = load_photos(dataset.views);
    Trainer trainer(shared_device(), dataset, photos, initial_model(dataset, options), options);
    const auto psnr = [&] {
        Evaluation e = evaluate_held_out(trainer, dataset, photos);
        take_means(e);
        return e.psnr_db;
    };
    Gain outcome{psnr(), 0};
    while (trainer.iteration() < options.iterations) trainer.step();
    outcome.psnr_after = psnr();
    EXPECT_EQ(trainer.counters().bad_gradients, 0U);
    return outcome;
}

TEST(ShippedScene, a_short_run_gains_3_db) {
    const Dataset dataset =
        load_dataset(kSources / "assets/scene", {.resolution = 8, .hold_out = true});
    TrainOptions options;
    options.iterations = 400;
    const Gain outcome = train(dataset, options);
    EXPECT_GT(outcome.psnr_before, 5) << "the start already shows something";
    EXPECT_GT(outcome.psnr_after, outcome.psnr_before + 3);
}

// Rounds from the start on, so that the strategy takes part in a run this short.
TEST(ShippedScene, a_short_run_of_mcmc_gains_3_db) {
    const Dataset dataset =
        load_dataset(kSources / "assets/scene", {.resolution = 8, .hold_out = true});
    TrainOptions options;
    options.strategy = Strategy::mcmc;
    options.iterations = 400;
    options.densify_from = 50;
    options.densify_interval = 50;
    options.max_splats = default_budget(dataset, options);
    const Gain outcome = train(dataset, options);
    EXPECT_GT(outcome.psnr_before, 5) << "the start already shows something";
    EXPECT_GT(outcome.psnr_after, outcome.psnr_before + 3);
}

// The measured runs of five seeds: {"iterations": N, "held_out_psnr_db": {"median": X}}.
TEST(ShippedScene, a_full_run_is_as_good_as_the_published_one_long) {
    const std::filesystem::path file = kSources / "assets/results/shipped_scene.json";
    if (!std::filesystem::exists(file)) GTEST_SKIP() << "no published figures at " << file;
    const auto published = nlohmann::json::parse(read_text_file(file));
    const double median = published.at("held_out_psnr_db").at("median").get<double>();
    TrainOptions options;
    options.iterations = published.at("iterations").get<int>();
    const Gain outcome =
        train(load_dataset(kSources / "assets/scene", {.hold_out = true}), options);
    EXPECT_GT(outcome.psnr_after, median - 0.5) << "published: " << median << " dB";
}

}  // namespace
}  // namespace darb::test
