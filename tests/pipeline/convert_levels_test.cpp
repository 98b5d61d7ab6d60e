// SPDX-License-Identifier: MIT
// darb convert --splats, --share, --levels and --refine; and what merging is worth against
// dropping.
#include <algorithm>
#include <filesystem>
#include <numeric>
#include <sstream>

#include "engine/data/metrics.h"
#include "engine/render/renderer.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/merge_splats.h"
#include "engine/scene/sog.h"
#include "engine/scene/splat_file.h"
#include "tests/support/run_command.h"
#include "tests/support/shared_device.h"
#include "tests/support/splat_files.h"
#include "tests/support/test_data.h"
#include "tools/cost/plan_subject.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;

// Small splats: the renders that the command compares take most of the time.
std::string scene_file(const std::string& name, std::size_t count) {
    SplatModel scene = sample_model(0, count);
    for (float& log_scale : scene.log_scale) log_scale = std::min(log_scale, -2.0f);
    save_splats(scratch_file(name), *format_to_write(name), scene);
    return scratch_file(name);
}

/// The numbers of the table's rows, in order.
std::vector<std::vector<double>> rows_of(const std::string& said) {
    std::vector<std::vector<double>> rows;
    std::istringstream lines(said);
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        std::vector<double> row;
        for (double value; words >> value;) row.push_back(value);
        if (row.size() >= 4) rows.push_back(row);
    }
    return rows;
}

TEST(ConvertLevels, one_file_of_a_count_or_a_share) {
    const std::string scene = scene_file("scene.ply", 80);
    const Outcome counted =
        darb("convert " + scene + " " + scratch_file("few.ply") + " --splats 37");
    ASSERT_EQ(counted.code, 0) << counted.err;
    EXPECT_EQ(load_splats(scratch_file("few.ply")).size(), 37u);
    const auto rows = rows_of(counted.out);
    ASSERT_EQ(rows.size(), 1u) << counted.out;
    EXPECT_EQ(rows[0][0], 37);
    EXPECT_EQ(rows[0][1], static_cast<double>(fs::file_size(scratch_file("few.ply"))));
    EXPECT_GT(rows[0][2], 15);  // dB
    EXPECT_LE(rows[0][3], rows[0][2]);
    ASSERT_EQ(darb("convert " + scene + " " + scratch_file("part.spz") + " --share 0.25").code, 0);
    EXPECT_EQ(load_splats(scratch_file("part.spz")).size(), 20u);
}

TEST(ConvertLevels, levels_fall_by_half_in_files_of_their_own) {
    const std::string scene = scene_file("whole.ply", 80);
    const Outcome o =
        darb("convert " + scene + " " + scratch_file("lod.compressed.ply") + " --levels 2");
    ASSERT_EQ(o.code, 0) << o.err;
    const auto rows = rows_of(o.out);
    ASSERT_EQ(rows.size(), 2u) << o.out;
    std::size_t count = 80;
    for (std::size_t n = 1; n <= 2; ++n) {
        const std::string file = scratch_file("lod." + std::to_string(n) + ".compressed.ply");
        EXPECT_EQ(load_splats(file).size(), count /= 2);
        EXPECT_EQ(rows[n - 1][0], static_cast<double>(count));
        if (n > 1) {
            EXPECT_LT(rows[n - 1][2], rows[n - 2][2]);
        }
    }
    EXPECT_FALSE(fs::exists(scratch_file("lod.compressed.ply")));
    const Outcome shares = darb("convert " + scene + " " + scratch_file("s.ply") +
                                " --levels 2 --splats 40 --share 0.1");
    ASSERT_EQ(shares.code, 0) << shares.err;
    EXPECT_EQ(load_splats(scratch_file("s.2.ply")).size(), 4u);
}

TEST(ConvertLevels, streamed_sog_holds_them_below_the_scene) {
    const std::string scene = scene_file("streamed.ply", 80);
    const Outcome o = darb("convert " + scene + " " + scratch_file("lod/lod-meta.json") +
                           " --levels 2 --share 0.25");
    ASSERT_EQ(o.code, 0) << o.err;
    const auto rows = rows_of(o.out);
    ASSERT_EQ(rows.size(), 3u) << o.out;
    const double counts[] = {80, 20, 5};
    for (std::size_t level = 0; level < 3; ++level) {
        EXPECT_EQ(rows[level][0], counts[level]);
        EXPECT_GT(rows[level][1], 100);  // bytes
        EXPECT_EQ(load_streamed_level(scratch_file("lod/lod-meta.json"), level).size(),
                  counts[level]);
        if (level > 0) {
            EXPECT_LT(rows[level][2], rows[level - 1][2]);
        }
    }
    EXPECT_GT(rows[0][2], 30);  // dB
    EXPECT_EQ(load_splats(scratch_file("lod")).size(), 80u);
    EXPECT_EQ(load_streamed_level(scratch_file("lod/lod-meta.json"), 3).size(), 0u);
}

TEST(ConvertLevels, contradictions_are_named) {
    const std::string scene = scene_file("named.ply", 50);
    const std::string to = "convert " + scene + " " + scratch_file("x.ply");
    for (const auto& [options, what] : std::vector<std::pair<std::string, std::string>>{
             {" --splats 10 --share 0.5", "--share"},
             {" --share 0", "--share"},
             {" --refine .", "--refine"},
             {" --splats 5 --refine " + scratch_file("nothing"), "nothing"}}) {
        const Outcome o = darb(to + options);
        EXPECT_EQ(o.code, 2) << options;
        EXPECT_NE(o.err.find(what), std::string::npos) << o.err;
    }
    const std::string source = scene_file("one.1.ply", 50);
    const auto before = read_file(source);
    const Outcome over = darb("convert " + source + " " + scratch_file("one.ply") + " --levels 1");
    EXPECT_EQ(over.code, 2) << over.out;
    EXPECT_EQ(read_file(source), before);
}

TEST(ConvertLevels, refining_gains_on_photos) {
    const std::string data = (fs::path(DARB_SOURCE_DIR) / "assets/scene").string();
    const std::string run = scratch_file("run");
    ASSERT_EQ(
        darb("train " + data + " -o " + run + " -r 8 --iterations 100 --effects=-antialias").code,
        0);
    const Outcome o =
        darb("convert " + run + " " + scratch_file("refined.ply") + " --share 0.2 --refine " +
             data + " --refine-resolution 8 --refine-iterations 40");
    ASSERT_EQ(o.code, 0) << o.err;
    const auto rows = rows_of(o.out);
    ASSERT_EQ(rows.size(), 1u) << o.out;
    ASSERT_EQ(rows[0].size(), 6u) << o.out;
    EXPECT_GT(rows[0][5], rows[0][4] + 0.3) << o.out;
}

double psnr_against(const std::vector<ImageF>& truth, const CostViews& views,
                    const SplatModel& model) {
    Renderer renderer(shared_device(), model);
    double sum = 0;
    for (std::size_t i = 0; i < truth.size(); ++i)
        sum += psnr(renderer.render(views.cameras[i]), truth[i]);
    return sum / static_cast<double>(truth.size());
}

// A quarter of a public scene: as Gaussians, and as if it had another kernel.
TEST(MergeSplats, is_far_nearer_to_the_scene_than_dropping) {
    const auto data = test_data_folder();
    const fs::path file = data ? *data / "splats/toy-cat.compressed.ply" : fs::path();
    if (!data || !fs::exists(file)) GTEST_SKIP() << kNoTestData;
    for (const int kernel : {KERNEL_GAUSSIAN, KERNEL_RAISED_COSINE}) {
        SplatModel scene = load_splats(file);
        scene.kernel = kernel;
        std::vector<std::uint32_t> order(scene.size());
        std::iota(order.begin(), order.end(), 0u);
        std::vector<double> value(scene.size());
        for (std::size_t i = 0; i < scene.size(); ++i) {
            const float* s = &scene.log_scale[3 * i];
            value[i] = std::log(sigmoid(scene.opacity_logit[i])) + s[0] + s[1] + s[2] -
                       std::min({s[0], s[1], s[2]});
        }
        std::ranges::stable_sort(order, [&](auto a, auto b) { return value[a] > value[b]; });
        order.resize(scene.size() / 4);
        const CostViews views = orbit_views(scene, 1, 240, 180);
        std::vector<ImageF> truth;
        Renderer renderer(shared_device(), scene);
        for (const Camera& camera : views.cameras) truth.push_back(renderer.render(camera));
        const double merged = psnr_against(truth, views, merge_splats(scene, order.size()));
        const double dropped = psnr_against(truth, views, pick_splats(scene, order));
        EXPECT_GT(merged, dropped + 6) << kernel_name(kernel);
        EXPECT_GT(merged, 30) << kernel_name(kernel);
    }
}

}  // namespace
}  // namespace darb::test
