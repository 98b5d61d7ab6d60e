// SPDX-License-Identifier: MIT
// Comparisons: which runs count as done, medians and marks, crops, and the paper's printed numbers.
#include "tools/paper/compare_runs.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/image_io.h"
#include "engine/kernels/kernel_family.h"
#include "tools/paper/compare_pictures.h"
#include "tools/paper/compare_stats.h"
#include "tools/paper/paper_numbers.h"

namespace darb {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSettings = R"({"kernel":"sinc","seed":0})";
constexpr const char* kCameras = "[]";

class CompareFolder : public testing::Test {
  protected:
    CompareFolder()
        : folder_(fs::path(testing::TempDir()) / fmt::format("compare_{}", ::getpid())) {}
    ~CompareFolder() override { fs::remove_all(folder_); }

    void write_metrics(const std::string& settings, int iteration, bool interrupted) {
        write_file_atomic(
            folder_ / "metrics.json",
            fmt::format(R"({{"start":{{"settings":{},"held_out_views":2}},"iteration":{},)"
                        R"("interrupted":{},"peak_device_bytes":3000000,"evaluations":[)"
                        R"({{"iteration":10,"seconds":1,"psnr_db":20,"ssim":0.5,"splats":7,)"
                        R"("views":[{{"name":"a/b.jpg","psnr_db":20,"ssim":0.5}}]}}]}})",
                        settings, iteration, interrupted));
        write_file_atomic(folder_ / "cameras.json", std::string_view(kCameras));
    }
    RunState state() const { return run_state(folder_, kSettings, kCameras, 10, 2); }

    fs::path folder_;
};

TEST_F(CompareFolder, State_isNoneThenPartialThenFinished) {
    EXPECT_EQ(state(), RunState::none);
    write_file_atomic(folder_ / "checkpoint.darb", std::string_view("x"));
    EXPECT_EQ(state(), RunState::partial);
    write_metrics(kSettings, 5, true);
    EXPECT_EQ(state(), RunState::partial);
    write_metrics(kSettings, 10, false);
    EXPECT_EQ(state(), RunState::finished);
}

TEST_F(CompareFolder, OtherSettingsCamerasOrViews_areErrorsThatNameThem) {
    write_metrics(R"({"kernel":"gaussian","seed":0})", 10, false);
    try {
        state();
        FAIL() << "no error";
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("kernel is \"gaussian\", wanted \"sinc\""),
                  std::string::npos)
            << e.what();
    }
    write_metrics(kSettings, 10, false);
    EXPECT_THROW(run_state(folder_, kSettings, "[1]", 10, 2), Error);
    EXPECT_THROW(run_state(folder_, kSettings, kCameras, 10, 3), Error);
}

TEST_F(CompareFolder, Run_isReadWithCurveAndPictures) {
    write_metrics(kSettings, 10, false);
    write_file_atomic(folder_ / "run.jsonl",
                      std::string_view("{\"event\":\"start\"}\n{\"event\":\"iteration\","
                                       "\"iteration\":5,\"seconds\":0.5,\"loss\":0.25,"
                                       "\"splats\":6}\n"));
    write_file_atomic(folder_ / "point_cloud/iteration_10/point_cloud.ply",
                      std::string_view("0123456789"));
    ComparedRun run;
    run.folder = folder_;
    read_run(run, {10, 20});
    ASSERT_EQ(run.at.size(), 1u);
    EXPECT_NE(run.notes.find("without an evaluation after 20 iterations"), std::string::npos)
        << run.notes;
    EXPECT_EQ(run.at[0].psnr_db, 20);
    EXPECT_DOUBLE_EQ(*run.at[0].model_mb, 1e-5);
    EXPECT_EQ(run.at[0].views[0].picture, folder_ / "held_out/10/a_b.png");
    ASSERT_EQ(run.curve.size(), 1u);
    EXPECT_EQ(run.curve[0].loss, 0.25);
    EXPECT_EQ(run.peak_mb, 3);
}

TEST_F(CompareFolder, BrokenLineOfTheLog_isAnErrorThatNamesIt) {
    write_metrics(kSettings, 10, false);
    write_file_atomic(folder_ / "run.jsonl",
                      std::string_view("{\"event\":\"start\"}\nbroken\n{\"event\":\"end\"}\n"));
    ComparedRun run;
    run.folder = folder_;
    try {
        read_run(run, {10, 20});
        FAIL() << "accepted";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("run.jsonl, line 2"), std::string::npos)
            << error.what();
    }
}

TEST_F(CompareFolder, UnfinishedRun_isReadAsFarAsItCame) {
    write_file_atomic(folder_ / "cameras.json", std::string_view(kCameras));
    write_file_atomic(folder_ / "run.jsonl", fmt::format(R"({{"event":"start","settings":{}}}
{{"event":"evaluation","iteration":10,"seconds":1,"psnr_db":20,"ssim":0.5,"splats":7,"views":[
)",
                                                         kSettings));
    const auto read = [&](const char* settings, const char* cameras) {
        ComparedRun run;
        run.folder = folder_;
        run.failure = "device lost";
        read_unfinished_run(run, {10, 20}, settings, cameras);
        return run;
    };
    EXPECT_TRUE(read(kSettings, kCameras).at.empty());  // the line is cut
    write_file_atomic(folder_ / "run.jsonl",
                      fmt::format(R"({{"event":"start","settings":{}}}
{{"event":"evaluation","iteration":10,"seconds":1,"psnr_db":20,"ssim":0.5,"splats":7,"views":)"
                                  R"([{{"name":"a/b.jpg","psnr_db":20,"ssim":0.5}},)"
                                  R"({{"name":"a_b.png","psnr_db":20,"ssim":0.5}}]}}
)",
                                  kSettings));
    const ComparedRun run = read(kSettings, kCameras);
    ASSERT_EQ(run.at.size(), 1u);
    EXPECT_EQ(run.at[0].psnr_db, 20);
    EXPECT_EQ(run.at[0].views[0].picture, folder_ / "held_out/10/a_b.png");
    EXPECT_EQ(run.at[0].views[1].picture, folder_ / "held_out/10/a_b_2.png");
    EXPECT_FALSE(run.peak_mb);
    EXPECT_TRUE(read(R"({"kernel":"gaussian"})", kCameras).at.empty());
    EXPECT_TRUE(read(kSettings, "[1]").at.empty());
}

TEST_F(CompareFolder, Crops_areWhereTheKernelsDifferMost) {
    // photo | render | error, 40 x 30 each; the photo is black.
    const auto write = [&](const fs::path& path, int x0, int y0, std::uint8_t grey) {
        ImageU8 all(120, 30, 3);
        for (int y = y0; y < y0 + 4; ++y)
            for (int x = x0; x < x0 + 4; ++x)
                for (int c = 0; c < 3; ++c) all.at(40 + x, y, c) = grey;
        write_png(path, all);
    };
    write(folder_ / "a.png", 1, 1, 200);    // the first errs at the upper left
    write(folder_ / "b.png", 35, 25, 100);  // the second at the lower right
    ComparedAt first, second;
    first.views.push_back({"v", 0, 0, {}, folder_ / "a.png"});
    second.views.push_back({"v", 0, 0, {}, folder_ / "b.png"});
    const std::vector<Crop> crops = crops_of(first, second);
    ASSERT_EQ(crops.size(), 2u);
    EXPECT_EQ(crops[0].side, 24);
    EXPECT_GT(crops[0].gain, 0);
    EXPECT_LE(crops[0].x, 1);
    EXPECT_LE(crops[0].y, 1);
    EXPECT_LT(crops[1].gain, 0);
    EXPECT_GE(crops[1].x + 24, 39);
    EXPECT_GE(crops[1].y + 24, 29);
    EXPECT_EQ(crops[0].photo.width, 24);
}

TEST_F(CompareFolder, TellingViews_areThoseWhereMethodsDiffer) {
    // photo | render | error, 40 x 30 each; the photo is black.
    std::vector<ComparedAt> methods(3);
    for (int m = 0; m < 3; ++m)
        for (const char* view : {"alike", "apart"}) {
            ImageU8 all(120, 30, 3);
            const bool apart = std::string(view) == "apart";
            for (int y = 22; y < 26; ++y)
                for (int x = 30; x < 34; ++x)
                    for (int c = 0; c < 3; ++c)
                        all.at(40 + x, y, c) = static_cast<std::uint8_t>(apart ? 80 * m : 250);
            const fs::path path = folder_ / fmt::format("{}{}.png", view, m);
            write_png(path, all);
            methods[m].views.push_back({view, 20, 0, {}, path});
        }
    const std::vector<const ComparedAt*> all{&methods[0], &methods[1], &methods[2]};
    const std::vector<TellingView> views = telling_views(all, 5);
    ASSERT_EQ(views.size(), 2u);
    EXPECT_EQ(views[0].view, "apart") << "not where all are equally wrong";
    EXPECT_EQ(views[0].side, 24);
    EXPECT_GE(views[0].x + 24, 34);
    EXPECT_GE(views[0].y + 24, 26);
    EXPECT_EQ(views[0].square_error[0], 0);
    EXPECT_NEAR(views[0].square_error[2], 16 * std::pow(160 / 255.0, 2) / (24 * 24), 1e-9);
    EXPECT_NEAR(views[1].spread, 0, 1e-9);
    EXPECT_EQ(telling_views(all, 1).size(), 1u);
    EXPECT_TRUE(telling_views({&methods[0]}, 1).empty()) << "one method differs from none";
    fs::remove(methods[2].views[1].picture);
    EXPECT_EQ(telling_views(all, 5).size(), 1u) << "every method has to have a picture";
}

/// A run for each value, seeds rising from 0.
void add_runs(ComparedDataset& dataset, const std::string& kernel,
              const std::vector<double>& psnr_db) {
    for (std::size_t seed = 0; seed < psnr_db.size(); ++seed) {
        ComparedRun& run = dataset.runs.emplace_back();
        run.kernel = kernel;
        run.seed = seed;
        run.at.emplace_back();
        run.at[0].iteration = 7000;
        run.at[0].psnr_db = psnr_db[seed];
        run.at[0].ssim = psnr_db[seed] / 40;
        run.curve = {{1, 1, psnr_db[seed], 5}, {2, 2, psnr_db[seed] / 2, 5}};
    }
}

TEST(CompareStats, StudentsT_isThatOfTables) {
    // Two-sided 95 %, from the NIST handbook's table.
    for (const auto& [freedom, t] : {std::pair{1, 12.706},
                                     {2, 4.303},
                                     {3, 3.182},
                                     {4, 2.776},
                                     {5, 2.571},
                                     {9, 2.262},
                                     {10, 2.228},
                                     {30, 2.042}})
        EXPECT_NEAR(student_t_95(freedom), t, 5e-4) << freedom;
}

TEST(CompareStats, PairedDifferences_areOfEqualSeeds) {
    Comparison c;
    c.kernels = {"gaussian", "sinc"};
    c.iterations = {7000};
    c.seeds = 3;
    ComparedDataset& set = c.datasets.emplace_back();
    set.name = "set";
    add_runs(set, "gaussian", {20, 25, 30});
    add_runs(set, "sinc", {21, 26.1, 30.9});
    const Column& psnr = quality_columns()[0];
    const auto d = paired_difference(set, "gaussian", "sinc", 7000, psnr);
    ASSERT_TRUE(d);
    EXPECT_EQ(d->seeds, 3);
    EXPECT_NEAR(d->mean, 1, 1e-12);
    EXPECT_NEAR(d->high - d->low, 2 * 4.3027 * 0.1 / std::sqrt(3.0), 1e-4);
    EXPECT_TRUE(d->clear()) << "though the seeds differ by more than the kernels";
    const std::vector<Table> tables = paired_tables(c);
    ASSERT_EQ(tables.size(), 2u) << "PSNR and SSIM; there is no LPIPS";
    EXPECT_EQ(tables[0].rows[0].cells[5].text, "yes");
    EXPECT_EQ(comparison_json(c)["paired"].size(), 2u);
    set.runs.pop_back();
    EXPECT_FALSE(paired_difference(set, "gaussian", "sinc", 7000, psnr)) << "two seeds are few";
    EXPECT_TRUE(paired_tables(c).empty());
}

TEST(CompareStats, SeveralSeeds_areMeansWithBands) {
    Comparison c;
    c.kernels = {"gaussian", "sinc"};
    c.iterations = {7000};
    c.seeds = 3;
    add_runs(c.datasets.emplace_back(), "gaussian", {20, 22, 27});
    const OverSeeds three = over_seeds(c.datasets[0], "gaussian", 7000, quality_columns()[0]);
    EXPECT_EQ(*three.mean, 23);
    EXPECT_EQ(*three.median, 22);
    EXPECT_NEAR(*three.deviation, std::sqrt(13.0), 1e-12);
    const std::string page = comparison_report(c).page();
    EXPECT_NE(page.find("23.00 \u00b1 3.61"), std::string::npos);
    EXPECT_NE(page.find("class='band s0'"), std::string::npos);
    EXPECT_NE(comparison_table(c).find("23.00 +- 3.61"), std::string::npos) << comparison_table(c);
}

TEST(CompareStats, SeveralDataSets_areRowsWithTheirMean) {
    Comparison c;
    c.kernels = {"gaussian", "sinc"};
    c.iterations = {7000};
    for (const double more : {0.0, 4.0}) {
        ComparedDataset& set = c.datasets.emplace_back();
        set.name = more > 0 ? "two" : "one";
        add_runs(set, "gaussian", {20 + more});
        add_runs(set, "sinc", {21 + more});
    }
    const std::vector<Table> tables = tables_by_dataset(c, 7000);
    ASSERT_EQ(tables.size(), 2u);
    ASSERT_EQ(tables[0].rows.size(), 3u);
    EXPECT_EQ(tables[0].rows[2].cells[1].value, 22);
    EXPECT_EQ(marks_of(tables[0])[2], (std::vector<Mark>{Mark::none, Mark::none, Mark::best}));
}

TEST(CompareStats, MeansOverDataSets_leaveOutWhereAKernelFailed) {
    Comparison c;
    c.kernels = {"sinc", "gaussian"};
    c.iterations = {7000};
    for (const double psnr : {21.25, 22.5, 90.0}) {
        ComparedDataset dataset;
        for (const std::string& kernel : c.kernels) {
            ComparedRun run;
            run.kernel = kernel;
            run.failure = psnr > 80 && kernel == "sinc" ? "diverged" : "";
            if (run.failure.empty()) {
                run.at.emplace_back();
                run.at[0].iteration = 7000;
                run.at[0].psnr_db = psnr;
            }
            dataset.runs.push_back(run);
        }
        c.datasets.push_back(dataset);
    }
    const std::string page = comparison_report(c).page();
    EXPECT_NE(page.find("<tr><td>gaussian</td><td>21.88</td>"), std::string::npos);
    EXPECT_EQ(page.find("<td>44.58</td>"), std::string::npos);
    EXPECT_NE(page.find("<tr><td>data sets</td><td>2</td>"), std::string::npos);
}

TEST(CompareStats, MeansOfBenchmarks_standApartBesideThePapers) {
    Comparison c;
    c.kernels = {"gaussian"};
    c.iterations = {7000};
    double psnr = 20;
    for (const char* name : {"Truck", "fox", "train", "room"}) {
        ComparedRun run;
        run.kernel = "gaussian";
        run.at.emplace_back();
        run.at[0].iteration = 7000;
        run.at[0].psnr_db = psnr++;
        c.datasets.push_back({name, name, {run}});
    }
    const std::vector<Means> means = means_of(c, 7000, quality_columns());
    ASSERT_EQ(means.size(), 2u);  // one scene of Mip-NeRF 360 is no mean
    EXPECT_EQ(*means[0].values[0][0], 21.5);
    EXPECT_FALSE(means[0].paper[0][0]);  // it has no fox
    EXPECT_EQ(means[1].benchmark, "Tanks and Temples");
    EXPECT_EQ(means[1].names, (std::vector<std::string>{"Truck", "train"}));
    EXPECT_EQ(*means[1].values[0][0], 21);
    EXPECT_NEAR(*means[1].paper[0][0], 21.864, 1e-9);
    EXPECT_EQ(means[1].covered[0], 2);
    EXPECT_NE(comparison_report(c).page().find("<tr><td>gaussian, the paper</td><td>21.86</td>"),
              std::string::npos);
    c.datasets = {c.datasets[0], c.datasets[2]};
    EXPECT_EQ(means_of(c, 7000, quality_columns()).size(), 1u);
}

TEST(CompareStats, LpipsColumn_isLeftOutWithoutAValue) {
    Comparison c;
    c.kernels = {"sinc"};
    c.iterations = {7000};
    ComparedRun run;
    run.kernel = "sinc";
    run.at.emplace_back();
    run.at[0].iteration = 7000;
    c.datasets.push_back({"set", "set", {run}});
    EXPECT_EQ(comparison_table(c).find("LPIPS"), std::string::npos);
    EXPECT_EQ(comparison_report(c).page().find("<th>LPIPS</th>"), std::string::npos);
    c.datasets[0].runs[0].at[0].lpips = 0.25;
    EXPECT_NE(comparison_table(c).find("LPIPS"), std::string::npos);
    EXPECT_NE(comparison_report(c).page().find("<th>LPIPS</th>"), std::string::npos);
}

TEST(ComparePulses, MoreAgainstOne_isJudgedByModelAndPsnr) {
    ComparedDataset dataset;
    dataset.name = "set";
    const auto add = [&](const char* kernel, double psnr, double mb) {
        ComparedRun run;
        run.kernel = kernel;
        run.at.emplace_back();
        run.at[0].iteration = 7000;
        run.at[0].psnr_db = psnr;
        run.at[0].model_mb = mb;
        run.at[0].splats = 1000 * mb;
        dataset.runs.push_back(run);
    };
    add("sinc", 25, 4);
    add("sinc_2_pulses", 24, 3);
    add("raised_cosine_2_pulses", 24, 3);  // without one of one pulse
    Comparison c;
    c.datasets = {dataset};
    c.kernels = {"sinc", "sinc_2_pulses", "sinc_3_pulses", "raised_cosine_2_pulses"};
    c.iterations = {7000};
    const std::vector<PulseChange> changes = pulse_changes(c, dataset, 7000);
    ASSERT_EQ(changes.size(), 2u);
    EXPECT_EQ(changes[0].kernel, "sinc");
    EXPECT_EQ(changes[0].pulses, 2);
    EXPECT_DOUBLE_EQ(*changes[0].psnr_db, -1);
    EXPECT_DOUBLE_EQ(*changes[0].model, 0.75);
    EXPECT_TRUE(changes[0].less_memory() && changes[0].less_psnr());
    EXPECT_FALSE(changes[1].model);  // three pulses were not run
    EXPECT_FALSE(changes[1].less_memory() || changes[1].less_psnr());
    EXPECT_NE(comparison_table(c).find("sinc with 2 pulses against one: PSNR -1.00 dB"),
              std::string::npos)
        << comparison_table(c);
    EXPECT_FALSE(changes[0].less_ssim());  // both 0
    EXPECT_NE(comparison_report(c).page().find("More pulses against one"), std::string::npos);
}

TEST(CompareStats, Medians_takeWhatThereIsOfFailedRuns) {
    ComparedDataset dataset;
    for (const double psnr : {20.0, 24.0, 21.0, 0.0}) {  // the last did not come to 7,000
        ComparedRun run;
        run.kernel = "sinc";
        run.failure = psnr == 24 || psnr == 0 ? "diverged" : "";
        run.at.emplace_back();
        run.at[0].iteration = psnr == 0 ? 1000 : 7000;
        run.at[0].psnr_db = psnr;
        dataset.runs.push_back(run);
    }
    const OverSeeds v = over_seeds(dataset, "sinc", 7000, quality_columns()[0]);
    EXPECT_EQ(v.count, 3);
    EXPECT_EQ(*v.median, 21);
    EXPECT_EQ(cell_text(v.cell(), {"PSNR", "dB"}), "21.67 \u00b1 2.08");
    EXPECT_FALSE(over_seeds(dataset, "sinc", 30000, quality_columns()[0]).median);
    Comparison c;
    c.datasets = {dataset};
    c.kernels = {"sinc", "gaussian"};
    c.iterations = {7000};
    EXPECT_NE(comparison_report(c).page().find("diverged"), std::string::npos);
    EXPECT_NE(comparison_table(c).find("21.67"), std::string::npos);
    EXPECT_EQ(comparison_json(c)["datasets"][0]["medians"][1]["psnr_db"], nullptr);
}

TEST(PaperNumbers, Means_areThoseThatTheErrataOfThePageGive) {
    // A row: | benchmark | iterations | what | kernel | printed | mean of its scenes |
    const std::map<std::string, double PaperNumbers::*> columns{
        {"PSNR", &PaperNumbers::psnr_db},
        {"SSIM", &PaperNumbers::ssim},
        {"LPIPS", &PaperNumbers::lpips},
        {"model, MB", &PaperNumbers::model_mb},
        {"training, s", &PaperNumbers::training_s}};
    std::istringstream page(read_text_file(fs::path(DARB_SOURCE_DIR) / "docs/paper.md"));
    int rows = 0;
    for (std::string line; std::getline(page, line);) {
        std::vector<std::string> cells;
        std::istringstream words(line);
        for (std::string cell; std::getline(words, cell, '|');) {
            const std::size_t first = cell.find_first_not_of(' ');
            cells.push_back(first == std::string::npos
                                ? ""
                                : cell.substr(first, cell.find_last_not_of(' ') - first + 1));
        }
        if (cells.size() != 7 || (cells[2] != "7,000" && cells[2] != "30,000")) continue;
        double sum = 0;
        int scenes = 0;
        for (const PaperNumbers& p : paper_numbers())
            if (paper_benchmark_of(p.scene) == cells[1] && kernel_name(p.kernel) == cells[4] &&
                p.iteration == (cells[2] == "7,000" ? 7000 : 30000)) {
                sum += p.*columns.at(cells[3]);
                ++scenes;
            }
        ASSERT_GT(scenes, 1) << line;
        const double printed = std::stod(cells[5]), mean = sum / scenes;
        const bool whole = cells[3].find(',') != std::string::npos;  // MB and seconds
        EXPECT_NEAR(mean, std::stod(cells[6]), whole ? 0.5 : 5.1e-5) << line;
        EXPECT_GT(std::abs(mean - printed), whole ? 1 : 6e-4) << line;  // more than rounding
        ++rows;
    }
    EXPECT_EQ(rows, 29);
    EXPECT_EQ(paper_numbers().size(), 130u);
    EXPECT_EQ(paper_numbers_of("DrJohnson").size(), 10u);
    EXPECT_TRUE(paper_numbers_of("fox").empty());
    EXPECT_EQ(paper_benchmark_of("fox"), "");
}

TEST(LearnedShapes, Histogram_holdsTheExponentsOfWhatIsDrawn) {
    SplatModel model;
    model.kernel = KERNEL_BETA;
    model.footprint = Footprint::psi;
    const float twice = std::log(2.0f);  // b = 8; the others start at 4
    model.shape = {0, twice, 0, 3, 0};
    model.opacity_logit = {2, 2, 2, -9, 2};  // the fourth is below the cut-off
    model.position.resize(15);
    const auto shapes = learned_shapes(model);
    ASSERT_TRUE(shapes);
    double sum = 0;
    for (std::size_t i = 0; i < shapes->shares.size(); ++i) {
        const double low = shapes->edges[i], high = shapes->edges[i + 1];
        EXPECT_LT(low, high);
        EXPECT_NEAR(shapes->shares[i],
                    (4 >= low && 4 < high ? 0.75 : 0) + (8 >= low && 8 < high ? 0.25 : 0), 1e-12)
            << low << " to " << high;
        sum += shapes->shares[i];
    }
    EXPECT_NEAR(sum, 1, 1e-12);
    EXPECT_NEAR(shapes->percentiles[2], 4, 1e-6);
    EXPECT_NEAR(shapes->percentiles[4], 8, 1e-6);
    model.kernel = KERNEL_GAUSSIAN;
    EXPECT_FALSE(learned_shapes(model)) << "it has no shape";
}

TEST(LearnedShapes, Page_hasACurveForEachDataSet) {
    Comparison c;
    c.kernels = {"gaussian", "beta"};
    c.datasets.resize(2);
    for (ComparedDataset& dataset : c.datasets) {
        dataset.name = &dataset == &c.datasets[0] ? "<one>" : "two";
        ComparedRun run;
        run.kernel = "beta";
        run.shapes = LearnedShapes{{1, 4, 16}, {0.25, 0.75}, {1.5, 2.5, 5.5, 6.5, 7.5}};
        dataset.runs.push_back(run);
    }
    const auto page = [&] {
        Report report("", "");
        add_shapes(c, report);
        return report.page();
    };
    const std::string html = page();
    EXPECT_NE(html.find("Learned by beta"), std::string::npos);
    EXPECT_EQ(html.find("Learned by gaussian"), std::string::npos);
    EXPECT_NE(html.find("class='line s1'"), std::string::npos) << "the second data set";
    EXPECT_NE(html.find("<td>&lt;one&gt;</td><td>1.5</td>"), std::string::npos) << html;
    c.datasets.clear();
    EXPECT_EQ(page().find("One kernel"), std::string::npos);
}

}  // namespace
}  // namespace darb
