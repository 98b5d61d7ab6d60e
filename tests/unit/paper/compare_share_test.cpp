// SPDX-License-Identifier: MIT
// Runs of a comparison, sent between ranks.
#include "tools/paper/compare_report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

namespace darb {
namespace {

namespace fs = std::filesystem;

// The first rank, to which the others have sent these.
class SentByOthers : public OneRank {
  public:
    explicit SentByOthers(std::vector<Bytes> others) : others_(std::move(others)) {}
    int count() const override { return 1 + static_cast<int>(others_.size()); }
    std::vector<Bytes> gather(std::span<const std::byte> bytes) override {
        std::vector<Bytes> all{Bytes(bytes.begin(), bytes.end())};
        all.insert(all.end(), others_.begin(), others_.end());
        return all;
    }

  private:
    std::vector<Bytes> others_;
};

ComparedRun measured_run(const std::string& kernel, std::uint64_t seed) {
    ComparedRun run;
    run.kernel = kernel;
    run.seed = seed;
    run.folder = "out/\xff";  // a name of a file need not be UTF-8
    run.failure = "failed";
    run.notes = "a note";
    run.exit_code = 2;
    ComparedAt at;
    at.iteration = 7;
    at.seconds = 1.5;
    at.psnr_db = INFINITY;
    at.ssim = NAN;
    at.lpips = 0.25;
    at.splats = 3e9;
    at.model = "point_cloud.ply";
    at.model_mb = 0.5;
    at.arc_db = 11;
    at.views = {{"a.jpg", 20.125, 0.5, std::nullopt, "a.png"}};
    at.scales = {{0.5, 30, 0.75}};
    at.off_path_db = 12;
    run.at = {at};
    run.curve = {{5, 0.5, 0.1, 6}};
    run.peak_mb = 3;
    run.blending = BlendStatistics{1, 2, 3, 4, 5};
    run.shapes = LearnedShapes{{0, 1}, {1}, {0.1, 0.2, 0.3, 0.4, 0.5}};
    return run;
}

TEST(CompareShare, Runs_keepEveryFieldOnTheirWay) {
    const ComparedRun sent = measured_run("sinc", 1ull << 63);
    const std::vector<ComparedRun> got = runs_of_bytes(bytes_of_runs({sent, ComparedRun()}));
    ASSERT_EQ(got.size(), 2u);
    Comparison before, after;
    before.datasets = {{"set", "set", {sent}}};
    after.datasets = {{"set", "set", {got[0]}}};
    for (Comparison* c : {&before, &after}) {
        EXPECT_EQ(c->datasets[0].runs[0].folder, fs::path("out/\xff"));
        c->datasets[0].runs[0].folder = "out";  // JSON wants UTF-8
    }
    EXPECT_EQ(comparison_json(before).dump(), comparison_json(after).dump());
    EXPECT_EQ(got[0].exit_code, 2);
    EXPECT_TRUE(std::isinf(got[0].at[0].psnr_db) && std::isnan(got[0].at[0].ssim));
    EXPECT_EQ(got[0].at[0].views[0].picture, fs::path("a.png"));
    EXPECT_EQ(got[0].at[0].lpips, 0.25);
    EXPECT_EQ(got[0].at[0].model, fs::path("point_cloud.ply"));
    EXPECT_FALSE(got[0].at[0].views[0].lpips || got[1].blending || got[1].shapes || got[1].peak_mb);
}

TEST(CompareShare, RunsOfRanks_comeInTheirOrder) {
    // By seed and then kernel: 0 to rank 0, 1 and 2 to rank 1, 3 to rank 0.
    const auto run = [](std::uint64_t item) {
        return measured_run(item % 2 == 0 ? "gaussian" : "sinc", item / 2);
    };
    SentByOthers ranks({bytes_of_runs({run(1), run(2)})});
    std::vector<ComparedRun> all = runs_of_all(ranks, {run(0), run(3)}, 4);
    ASSERT_EQ(all.size(), 4u);
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(all[i].kernel, run(i).kernel) << i;
        EXPECT_EQ(all[i].seed, i / 2) << i;
    }
    SentByOthers interrupted({bytes_of_runs({run(1)})});
    all = runs_of_all(interrupted, {run(0), run(3)}, 4);
    ASSERT_EQ(all.size(), 3u);
    EXPECT_EQ(all[2].seed, 1u);
    EXPECT_EQ(all[2].kernel, "sinc");
}

}  // namespace
}  // namespace darb
