// SPDX-License-Identifier: MIT
#include "trainer/run/run_log.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>

#include "engine/core/files.h"
#include "tests/support/test_device_options.h"
#include "trainer/growth/initial_model.h"

namespace darb {
namespace {

TEST(CfgArgs, names_what_the_photos_were_loaded_with) {
    Dataset dataset;
    dataset.root = "/photos";
    dataset.views.resize(2);
    dataset.views[1].is_test = true;
    dataset.options = {.images_folder = "images_4", .resolution = 2};
    TrainOptions options;
    options.sh_degree = 2;
    EXPECT_EQ(cfg_args(dataset, options, "/out"),
              "Namespace(sh_degree=2, source_path='../photos', model_path='.', "
              "images='images_4', resolution=2, white_background=False, data_device='cpu', "
              "eval=True)");
    dataset.root = "/a', x=__import__('os').system('id'), b='";
    EXPECT_NE(cfg_args(dataset, options, "/out")
                  .find("source_path=\"../a', x=__import__('os').system('id'), b='\", model_path="),
              std::string::npos);
}

TEST(RunLog, names_that_are_no_utf_8_and_numbers_that_are_not_finite_are_written_and_read) {
    const auto folder = std::filesystem::path(testing::TempDir()) / fmt::format("log_{}", getpid());
    Evaluation evaluation;
    evaluation.iteration = 7;
    evaluation.views = {{"f\xfcr.jpg", std::nan(""), std::nan("")}};
    evaluation.psnr_db = std::nan("");
    evaluation.ssim = 0.5;
    RunLog first(folder), again(folder);
    first.begin();
    first.evaluation(evaluation);
    again.go_on(7);
    ReportData data;
    add_events({nlohmann::json::parse(read_text_file(folder / "run.jsonl"))}, data);
    std::filesystem::remove_all(folder);
    ASSERT_EQ(data.evaluations.size(), 1u);
    EXPECT_TRUE(std::isnan(data.evaluations[0].psnr_db));
    EXPECT_EQ(data.evaluations[0].ssim, 0.5);
    add_events({{{"event", "iteration"}, {"iteration", 50}, {"loss", nullptr}}}, data);
    EXPECT_TRUE(std::isnan(data.samples.at(0).loss));
}

TEST(RunLog, a_report_says_where_the_photos_change) {
    const auto step = [](int iteration, int divisor) {
        return nlohmann::json{
            {"event", "resolution"}, {"iteration", iteration}, {"divisor", divisor}};
    };
    ReportData data;
    add_events({}, data);
    EXPECT_TRUE(data.notes.empty());
    add_events({step(1, 4), step(151, 2), step(451, 1)}, data);
    ASSERT_EQ(data.notes.size(), 1u);
    EXPECT_NE(data.notes[0].find("1/4 of the sides from iteration 1, 1/2 of the sides from "
                                 "iteration 151, whole from iteration 451;"),
              std::string::npos)
        << data.notes[0];
}

// Probes after 3 and 6 iterations and growth that ends before the checkpoint, all found again by
// the run that goes on behind them.
TEST(RunLog, a_resumed_run_reports_what_it_found_before) {
    Dataset dataset = load_dataset(std::filesystem::path(DARB_SOURCE_DIR) / "assets" / "scene",
                                   {.resolution = 8});
    dataset.views.resize(6);  // too few photos for a trial: each degree is admitted
    dataset.points.seen_begin.clear();
    dataset.points.seen_by.clear();
    TrainOptions options;
    options.iterations = 8;
    options.probe_sh = true;
    options.sh_interval = 3;
    options.densify_from = 1;
    options.densify_interval = 2;
    options.densify_until = 5;
    options.densify_grad_threshold = 1e-7f;
    options.prune_opacity = 0;
    RunOptions run;
    run.output = std::filesystem::path(testing::TempDir()) / fmt::format("again_{}", getpid());
    run.checkpoint_iterations = {7};
    run.quiet = true;
    run.report = false;
    const auto metrics = [&](std::uint64_t most_bytes) {
        options.max_memory_bytes = most_bytes;
        Device device{test::device_options()};
        run_training(device, dataset, options, run);
        return nlohmann::json::parse(read_text_file(run.output / "metrics.json"));
    };
    const std::vector<ImageU8> photos = load_photos(dataset.views);
    const auto peak = [&](int densify_until) {
        TrainOptions unlimited = options;
        unlimited.densify_until = densify_until;
        Device device{test::device_options()};
        Trainer trainer(device, dataset, photos, initial_model(dataset, unlimited), unlimited);
        while (trainer.iteration() < options.iterations) trainer.step();
        return device.peak_bytes();
    };
    const std::uint64_t still = peak(0), grown = peak(*options.densify_until);
    ASSERT_GT(grown, still);
    const nlohmann::json whole = metrics(still + (grown - still) / 2);
    ASSERT_EQ(whole["sh_probes"].size(), 2U) << whole["sh_probes"];
    ASSERT_GT(whole["splats_stopped_by_memory"].get<int>(), 0);
    run.resume_from = run.output / "chkpnt7.darb";
    const nlohmann::json resumed = metrics(*options.max_memory_bytes);
    std::filesystem::remove_all(run.output);
    for (const char* name : {"sh_probes", "splats_stopped_by_memory", "splats", "sh_degree"})
        EXPECT_EQ(resumed[name], whole[name]) << name;
}

}  // namespace
}  // namespace darb
