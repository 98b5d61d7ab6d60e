// SPDX-License-Identifier: MIT
// The output folder of darb train over several runs: whose scene it holds, what --resume continues
// with, and what --schedule writes into the settings of a run.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "engine/core/files.h"
#include "engine/data/dataset.h"
#include "tests/support/run_command.h"
#include "trainer/growth/predicted_growth.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const std::string kTrain = "train " + kScene + " -r 8 ";

class RunFolder : public testing::Test {
  protected:
    void TearDown() override { fs::remove_all(folder_); }
    Outcome train(const std::string& options) const {
        return darb(kTrain + "-o " + folder_.string() + " " + options);
    }
    json settings() const {
        std::istringstream lines(read_text_file(folder_ / "run.jsonl"));
        std::string first;
        std::getline(lines, first);
        return json::parse(first)["settings"];
    }
    fs::path folder_ = scratch() / "run_folder";
};

TEST_F(RunFolder, a_shorter_run_after_a_longer_one_is_the_scene) {
    ASSERT_EQ(train("--iterations 3 -q").code, 0);
    ASSERT_EQ(train("--iterations 2 -q --kernel sinc").code, 0);
    const Outcome info = darb("info " + folder_.string());
    EXPECT_NE(info.out.find("iteration_2"), std::string::npos) << info.out;
    EXPECT_NE(info.out.find("sinc"), std::string::npos) << info.out;
    const fs::path earlier = folder_ / "earlier.1" / "point_cloud" / "iteration_3";
    ASSERT_TRUE(fs::exists(earlier / "point_cloud.ply")) << "kept";
    fs::rename(earlier, folder_ / "point_cloud" / "iteration_3");
    EXPECT_NE(darb("info " + folder_.string()).out.find("iteration_2"), std::string::npos);
    fs::remove(folder_ / "metrics.json");  // as of another program: the last one
    EXPECT_NE(darb("info " + folder_.string()).out.find("iteration_3"), std::string::npos);
}

// Three starts afresh: each earlier run is there as it was, with what the user put beside it.
TEST_F(RunFolder, nothing_of_earlier_runs_is_lost) {
    std::vector<std::map<fs::path, std::vector<std::byte>>> runs;
    for (const char* options : {"--kernel gaussian --eval",
                                "--kernel sinc --checkpoint-iterations 1", "--kernel cosine"}) {
        ASSERT_EQ(train(std::string("--iterations 2 -q ") + options).code, 0);
        runs.emplace_back();
        for (const auto& entry : fs::recursive_directory_iterator(folder_))
            if (const fs::path name = entry.path().lexically_relative(folder_);
                entry.is_regular_file() && !name.string().starts_with("earlier."))
                runs.back()[name] = read_file(entry.path());
        write_file_atomic(folder_ / "notes.txt", "mine");
    }
    for (size_t run = 0; run < 2; ++run)
        for (const auto& [name, bytes] : runs[run]) {
            if (name == "notes.txt") continue;
            EXPECT_EQ(read_file(folder_ / fmt::format("earlier.{}", run + 1) / name), bytes)
                << name;
        }
    EXPECT_EQ(read_text_file(folder_ / "notes.txt"), "mine");
    for (const auto& [name, bytes] : runs[2]) EXPECT_EQ(read_file(folder_ / name), bytes) << name;
    // An earlier run is a folder like any other.
    EXPECT_NE(darb("info " + (folder_ / "earlier.2").string()).out.find("sinc"), std::string::npos);
}

TEST_F(RunFolder, a_run_that_is_resumed_and_killed_shows_its_latest_scene) {
    ASSERT_EQ(train("--iterations 4 -q --checkpoint-iterations 2 --save-iterations 2").code, 0);
    // As after Ctrl-C at iteration 2.
    json metrics = json::parse(read_text_file(folder_ / "metrics.json"));
    metrics["iteration"] = 2;
    metrics["interrupted"] = true;
    std::ofstream(folder_ / "metrics.json") << metrics.dump();
    fs::remove_all(folder_ / "point_cloud" / "iteration_4");
    fs::rename(folder_ / "chkpnt2.darb", folder_ / "checkpoint.darb");
    fs::create_directory(folder_ / "chkpnt4.darb");  // ends it once iteration 4 is saved
    const Outcome o = train(
        "--iterations 4 -q --resume --checkpoint-iterations 4 --save-iterations 2 --no-report");
    ASSERT_EQ(o.code, 2) << o.err;
    const Outcome info = darb("info " + folder_.string());
    EXPECT_NE(info.out.find("iteration_4"), std::string::npos) << info.out;
}

TEST_F(RunFolder, a_checkpoint_of_another_folder_begins_a_log_of_its_own) {
    const fs::path other = scratch() / "other_folder";
    ASSERT_EQ(train("--iterations 3 -q --checkpoint-iterations 2 --eval").code, 0);
    ASSERT_EQ(darb(kTrain + "-o " + other.string() +
                   " --iterations 2 -q --eval --test-iterations "
                   "1 --kernel sinc --effects +exposure")
                  .code,
              0);
    ASSERT_TRUE(fs::exists(other / "exposure.json"));
    const Outcome o = darb(kTrain + "-o " + other.string() +
                           " --iterations 3 -q --eval --no-report "
                           "--start-checkpoint " +
                           (folder_ / "chkpnt2.darb").string());
    ASSERT_EQ(o.code, 0) << o.err;
    const json metrics = json::parse(read_text_file(other / "metrics.json"));
    ASSERT_EQ(metrics["evaluations"].size(), 1U) << metrics["evaluations"];
    EXPECT_EQ(metrics["evaluations"][0]["iteration"], 3);
    EXPECT_TRUE(fs::exists(other / "earlier.1" / "metrics.json"));
    EXPECT_FALSE(fs::exists(other / "report.html")) << "this run writes none";
    EXPECT_TRUE(fs::exists(other / "earlier.1" / "report.html"));
    EXPECT_FALSE(fs::exists(other / "exposure.json")) << "this run trains none";
    EXPECT_TRUE(fs::exists(other / "earlier.1" / "exposure.json"));
    EXPECT_FALSE(fs::exists(other / "point_cloud" / "iteration_2"));

    fs::remove_all(other);  // and from the end of a run
    EXPECT_EQ(darb(kTrain + "-o " + other.string() + " --iterations 3 -q --eval " +
                   "--start-checkpoint " + (folder_ / "checkpoint.darb").string())
                  .code,
              0);
    EXPECT_NE(darb("info " + other.string()).out.find("iteration_3"), std::string::npos);
    EXPECT_EQ(json::parse(read_text_file(other / "metrics.json"))["evaluations"].size(), 1U);
}

TEST_F(RunFolder, resume_takes_the_runs_own_checkpoint_once_there_is_one) {
    ASSERT_EQ(train("--iterations 2 -q --checkpoint-iterations 1").code, 0);
    const std::string first = (folder_ / "chkpnt1.darb").string();
    ASSERT_TRUE(fs::exists(first));
    const std::string metrics = read_text_file(folder_ / "metrics.json");
    const Outcome o = train("--iterations 2 --start-checkpoint " + first + " --resume");
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.err.find("at iteration 2"), std::string::npos) << o.err;
    EXPECT_EQ(read_text_file(folder_ / "metrics.json"), metrics) << "the run was finished";
}

TEST_F(RunFolder, schedule_of_3dgs_is_what_is_trained_and_other_options_count) {
    ASSERT_EQ(train("--iterations 1 -q --opacity-reg 0.5 --schedule 3dgs").code, 0);
    const json s = settings();
    EXPECT_EQ(s["regularisers"], json({0.5f, 0.0f})) << s;
    EXPECT_NEAR(s["opacity_reset"][1].get<double>(), 0.01, 1e-6) << s;
    EXPECT_NEAR(s["position_lr"][0].get<double>(), 1.6e-4, 1e-9) << s;
    EXPECT_NEAR(s["position_lr"][1].get<double>(), 1.6e-6, 1e-11) << s;
    EXPECT_EQ(s["random_background"], false) << s;
    ASSERT_EQ(train("--iterations 1 -q").code, 0);
    EXPECT_NEAR(settings()["opacity_reset"][1].get<double>(), 0.2, 1e-6);
    const Outcome o = train("--iterations 1 --schedule 3dgs --strategy mcmc");
    EXPECT_EQ(o.code, 2);
    EXPECT_NE(o.err.find("--schedule 3dgs"), std::string::npos) << o.err;
}

// The number goes by the photos' detail, which the command measures; the device is lost soon after
// it is written.
TEST_F(RunFolder, mcmc_has_the_splats_that_the_detail_of_the_photos_asks_for) {
    TrainOptions options;
    options.iterations = 1'600;
    DatasetOptions small;
    small.resolution = 8;
    Dataset dataset = load_dataset(kScene, small);
    for (View& view : dataset.views) view.is_test = false;  // without --eval all are trained on
    const std::uint32_t without = default_budget(dataset, options);
    dataset.detail = photo_detail(dataset.views);
    const std::uint32_t by_detail = default_budget(dataset, options);
    ASSERT_GT(std::abs(double(without) - by_detail), 0.1 * by_detail);
    ::setenv("DARB_FAULT", "lost:40", 1);
    const Outcome o = train("--iterations 1600 -q --strategy mcmc");
    ::unsetenv("DARB_FAULT");
    EXPECT_EQ(o.code, 2) << o.err;
    EXPECT_EQ(settings().at("max_splats"), by_detail);
}

TEST_F(RunFolder, schedule_of_3dgs_has_the_lengths_of_a_gaussian_for_every_kernel_long) {
    const std::string raised_cosine = "--iterations 1 -q --kernel raised_cosine ";
    ASSERT_EQ(train(raised_cosine + "--schedule 3dgs").code, 0);
    EXPECT_FALSE(settings().contains("length_scale"));
    EXPECT_NEAR(settings()["scale_lr"].get<double>(), 0.005, 1e-6);
    EXPECT_EQ(settings()["largest_scale"], 0);
    ASSERT_EQ(train(raised_cosine).code, 0);
    EXPECT_NEAR(settings()["length_scale"].get<double>(), 1.2816, 1e-4);
    EXPECT_NEAR(settings()["scale_lr"].get<double>(), 0.0375, 1e-6)
        << "1.5 times, 5 for the length";
    EXPECT_EQ(settings()["largest_scale"], 1);
    ASSERT_EQ(train("--iterations 1 -q").code, 0);
    EXPECT_EQ(settings()["largest_scale"], 0) << "a Gaussian has none";
    for (const std::string own : {"--largest-scale 2", "--largest-scale 2 --schedule 3dgs",
                                  "--schedule 3dgs --largest-scale 2"}) {
        ASSERT_EQ(train("--iterations 1 -q " + own).code, 0) << own;
        EXPECT_EQ(settings()["largest_scale"], 2) << own;
    }
}

TEST_F(RunFolder, a_run_too_short_to_grow_says_so) {
    const std::string nothing = "growth: none";
    EXPECT_NE(train("--iterations 4 --no-report").err.find(nothing), std::string::npos);
    const Outcome grows =
        train("--iterations 8 --densify-from-iter 0 --densification-interval 1 --no-report");
    EXPECT_EQ(grows.err.find(nothing), std::string::npos) << grows.err;
}

TEST_F(RunFolder, without_held_out_photos_there_is_no_evaluation) {
    const fs::path whole = scratch() / "whole_scene";  // names no test views of its own
    fs::create_directories(whole);
    for (const char* part : {"images", "sparse"})
        fs::create_symlink(fs::path(DARB_SOURCE_DIR) / "assets" / "scene" / part, whole / part);
    const Outcome o = darb("train " + whole.string() + " -r 8 --iterations 2 -q --no-report -o " +
                           folder_.string());
    fs::remove_all(whole);
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(json::parse(read_text_file(folder_ / "metrics.json"))["evaluations"].size(), 0U);
}

// Held out in training, so measured.
TEST_F(RunFolder, an_arc_is_held_out_and_measured_apart) {
    const std::string arc = "--iterations 1 -q --hold-out arc:6";
    ASSERT_EQ(train(arc).code, 0);
    const json metrics = json::parse(read_text_file(folder_ / "metrics.json"));
    EXPECT_EQ(metrics["start"]["hold_out"], "arc:6");
    const json trained = metrics["evaluations"][0];
    const fs::path file = scratch() / "arc.json";
    const auto measured = [&](const std::string& options) {
        const Outcome o = darb(fmt::format("eval {} {} -r 8 --json {} {}", folder_.string(), kScene,
                                           file.string(), options));
        EXPECT_EQ(o.code, 0) << o.err;
        return json::parse(read_text_file(file));
    };
    const json eval = measured("");
    ASSERT_EQ(eval["views"].size(), trained["views"].size());
    EXPECT_EQ(eval["arc"]["views"], 8) << "a sixth of 48";
    EXPECT_EQ(trained["arc"]["views"], 8);
    EXPECT_NEAR(eval["arc"]["psnr_db"].get<double>(), trained["arc"]["psnr_db"].get<double>(),
                1e-6);
    EXPECT_NEAR(eval["mean"]["psnr_db"].get<double>(), trained["psnr_db"].get<double>(), 1e-6);
    EXPECT_FALSE(measured("--hold-out every:8").contains("arc"));
    EXPECT_EQ(train("--resume --iterations 1 -q --hold-out arc:3").code, 2) << "another split";
    EXPECT_EQ(train("--iterations 1 -q --hold-out ring").code, 2);
}

TEST_F(RunFolder, the_plan_decides_on_antialiasing_long) {
    const auto antialias = [&](const char* options) {
        EXPECT_EQ(train(std::string("--iterations 1 -q ") + options).code, 0);
        return settings()["effects"]["antialias"].get<bool>();
    };
    EXPECT_TRUE(antialias("--kernel gaussian"));
    EXPECT_TRUE(antialias("--kernel sinc"));
    EXPECT_FALSE(antialias("--kernel sinc --effects=-antialias"));
    EXPECT_FALSE(antialias("--kernel sinc --schedule 3dgs"));
    EXPECT_FALSE(antialias("--kernel sinc --effects=-huge --schedule 3dgs"));
    EXPECT_FALSE(antialias("--kernel sinc --schedule 3dgs --effects auto"));
    EXPECT_TRUE(antialias("--kernel sinc --schedule 3dgs --effects +antialias"));
    EXPECT_TRUE(antialias("--kernel sinc --schedule 3dgs --effects all"));
}

// Also in a quiet run.
TEST_F(RunFolder, splats_that_are_lost_are_said) {
    const Outcome none = train(
        "--iterations 40 -q --no-report --prune-opacity 0.99 --densify-from-iter 1 "
        "--densification-interval 5");
    EXPECT_EQ(none.code, 0);
    EXPECT_NE(none.err.find("warning: no splat is left: "), std::string::npos) << none.err;
    const Outcome infinite = train("--iterations 4 -q --no-report --rotation-lr 1e38");
    EXPECT_EQ(infinite.code, 0);
    EXPECT_NE(infinite.err.find("splats with NaN or infinity are left out of "), std::string::npos)
        << infinite.err;
    const Outcome points = train("--iterations 1 --no-report --random-points 50");
    EXPECT_NE(points.err.find("--random-points 50 is for data sets without points"),
              std::string::npos)
        << points.err;
}

TEST_F(RunFolder, an_opacity_reset_leaves_what_can_be_seen) {
    ASSERT_EQ(train("--iterations 1 -q --prune-opacity 0").code, 0);
    EXPECT_NEAR(settings()["opacity_reset"][1].get<double>(), 0.01, 1e-6);
    ASSERT_EQ(train("--iterations 1 -q --prune-opacity 0 --accuracy fast").code, 0);
    EXPECT_NEAR(settings()["opacity_reset"][1].get<double>(), 2.0 / 64, 1e-6);
}

}  // namespace
}  // namespace darb::test
