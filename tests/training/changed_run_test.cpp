// SPDX-License-Identifier: MIT
// Settings that change while a run trains: what is refused, that the run follows them, and that a
// run which is resumed knows them, to the bit.
#include <gtest/gtest.h>

#include "engine/core/files.h"
#include "tests/support/run_command.h"
#include "tests/support/shared_device.h"
#include "trainer/job/job.h"
#include "trainer/job/request_options.h"
#include "trainer/run/run_change.h"

namespace darb::test {
namespace {

TEST(RunChange, is_refused_with_a_reason_where_it_makes_no_sense) {
    TrainOptions o;
    o.iterations = 1000;
    const ChangePlace place{.iteration = 400, .peak_bytes = 100 << 20};
    EXPECT_EQ(change_refusal({.iterations = 2000, .max_splats = 5}, o, place), "");
    EXPECT_NE(change_refusal({.iterations = 400}, o, place).find("is over"), std::string::npos);
    EXPECT_NE(change_refusal({.max_splats = 0}, o, place), "");
    EXPECT_NE(change_refusal({.max_memory_bytes = 50 << 20}, o, place).find("100 MiB"),
              std::string::npos);
    EXPECT_EQ(change_refusal({.max_memory_bytes = 0}, o, place), "") << "no limit";
    ChangePlace late = place;
    late.averages = true;
    EXPECT_NE(change_refusal({.iterations = 2000}, o, late).find("mean"), std::string::npos);
    EXPECT_EQ(change_refusal({.iterations = 1000, .max_splats = 9}, o, late), "") << "as it is";
    ChangePlace ranks = place;
    ranks.several = true;
    EXPECT_NE(change_refusal({.max_splats = 9}, o, ranks), "");
    o.end_without_gain = 100;
    EXPECT_NE(change_refusal({.iterations = 2000}, o, place).find("--end-without-gain"),
              std::string::npos);
    o = {};
    o.learn_kernel = 5;
    EXPECT_NE(change_refusal({.iterations = 2000}, o, place), "");
}

TEST(RunChange, is_said_as_what_it_is_instead_of) {
    TrainOptions before, after;
    apply_change({.iterations = 9, .max_splats = 7, .max_memory_bytes = 3 << 20}, after);
    EXPECT_EQ(
        change_text(before, after),
        "iterations 9 instead of 30000, at most 7 splats instead of any number, device memory "
        "of 3 MiB instead of what there is");
    EXPECT_EQ(change_text(after, after), "");
}

class ChangedRun : public testing::Test {
  protected:
    void TearDown() override { fs::remove_all(folder_); }
    TrainRequest request(const std::string& name) const {
        TrainRequest r;
        r.dataset = kScene;
        r.output = folder_ / name;
        for (const auto& [option, value] : GivenOptions{
                 {"-r", "8"}, {"--iterations", "80"}, {"--effects", "none"}, {"--eval", "on"}})
            set_request_option(r, option, value);
        complete_request(r);
        return r;
    }
    /// Trains on; after iteration 20 the settings change, after `stop` the run ends.
    TrainResult train_on(const TrainRequest& r, int stop = 1'000'000) {
        JobSinks sinks{.quiet = true};
        sinks.on_step = [&, stop](const LiveStep& step) {
            LiveAnswer answer;
            if (step.iteration == 20)
                answer.changes = {{.iterations = 10}, {.iterations = 120, .max_splats = 4'100}};
            answer.measures = step.iteration == 30;
            answer.saves = step.iteration == 30;
            answer.stops = step.iteration == stop;
            said_ = step.said;
            iterations_ = step.options.iterations;
            return answer;
        };
        return train(shared_device(), r, sinks);
    }

    const fs::path folder_ = scratch() / "changed";
    std::vector<std::string> said_;
    int iterations_ = 0;
};

TEST_F(ChangedRun, goes_on_with_its_settings_and_is_resumed_with_them) {
    const TrainResult whole = train_on(request("whole"));
    EXPECT_EQ(whole.iteration, 120);
    EXPECT_EQ(iterations_, 120);
    EXPECT_LE(whole.saved, 4'100u);
    ASSERT_GE(said_.size(), 3u);
    EXPECT_NE(said_[0].find("not changed: Iteration 10 is over"), std::string::npos) << said_[0];
    EXPECT_NE(said_[1].find("iterations 120 instead of 80"), std::string::npos) << said_[1];
    EXPECT_NE(said_[2].find("saved the checkpoint"), std::string::npos) << said_[2];
    EXPECT_TRUE(fs::exists(folder_ / "whole/point_cloud/iteration_30/point_cloud.ply"));
    ASSERT_EQ(whole.evaluations.size(), 2u) << "one that was asked for, one at the end";
    EXPECT_EQ(whole.evaluations[0].iteration, 30);

    const auto metrics = read_json(folder_ / "whole/metrics.json");
    ASSERT_EQ(metrics["changes"].size(), 1u);
    EXPECT_EQ(metrics["changes"][0]["iteration"], 20);
    EXPECT_EQ(metrics["changes"][0]["settings"]["iterations"], 120);
    EXPECT_EQ(metrics["changes"][0]["settings"]["max_splats"], 4'100);
    EXPECT_NE(read_text_file(folder_ / "whole/report.html").find("settings were changed"),
              std::string::npos);

    const TrainResult part = train_on(request("part"), 50);
    EXPECT_TRUE(part.interrupted);
    EXPECT_EQ(part.iteration, 50);
    TrainRequest saved = read_request(folder_ / "part");
    EXPECT_EQ(saved.train.iterations, 120);
    EXPECT_EQ(saved.train.max_splats, 4'100u);
    const TrainResult resumed = train_on(saved);
    EXPECT_EQ(resumed.iteration, 120);
    EXPECT_EQ(read_file(resumed.model), read_file(whole.model));
}

}  // namespace
}  // namespace darb::test
