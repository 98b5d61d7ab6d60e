// SPDX-License-Identifier: MIT
// darb bench: the native loops against the shaders and against plain loops, and the command.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "engine/core/rng.h"
#include "tests/support/run_command.h"
#include "tests/support/shared_device.h"
#include "tools/bench/cases.h"
#include "tools/bench/growth.h"
#include "tools/bench/measure.h"
#include "tools/bench/native_blend.h"
#include "tools/bench/yardstick.h"

namespace darb::test {
namespace {

// Larger splats than the benchmark's, so that few of them cover the picture and end pixels.
SplatModel dense_scene(std::size_t splats) {
    SplatModel model = random_scene(splats, 1);
    for (float& scale : model.log_scale) scale += 1.5f;
    for (float& logit : model.opacity_logit) logit += 2.0f;
    return model;
}

TEST(NativeBlend, Picture_andGradientsAreThoseOfTheShaders) {
    // 4 % of a tile's pixels lie outside of a picture whose sides are no multiples of 16.
    const Camera camera = bench_camera({0, 0, 4}, true, 150, 107);
    for (const int threads : {1, 3}) {
        const auto yardsticks = compare_blend(shared_device(), dense_scene(3'000), camera, threads);
        ASSERT_EQ(yardsticks.size(), 2u);
        // A sample at the cut-off may fall on either side of it, which changes a pixel by 1/255.
        EXPECT_GT(yardsticks[0].agreement, 75) << "dB, " << threads << " threads";
        EXPECT_LT(yardsticks[1].agreement, 2e-3) << "relative, " << threads << " threads";
        EXPECT_GT(yardsticks[1].agreement, 0) << "nothing was compared";
    }
}

TEST(NativeBlend, Other_kernelsAreRefusedByTheMeasurement) {
    SplatModel model = random_scene(50, 0);
    model.kernel = KERNEL_RAISED_COSINE;
    const Camera camera = bench_camera({0, 0, 4}, true, 32, 32);
    const BlendFigures figures = measure_blend(shared_device(), model, {camera}, {}, {0, 1, 1, 1});
    EXPECT_TRUE(figures.yardsticks.empty());
    EXPECT_EQ(figures.counts.evaluated, 0);
    EXPECT_GT(figures.counts.intersections, 0);
}

// One tile; splats of radius about 2 px on the centre of the top left block.
BlendFrame frame_of(std::uint32_t splats, float opacity) {
    BlendFrame f;
    f.width = f.height = 16;
    f.tiles_x = f.tiles_y = 1;
    f.tile_range = {{0, splats}};
    for (std::uint32_t i = 0; i < splats; ++i) {
        f.intersection_from_sorted.push_back(i);
        f.splat_from_intersection.push_back(i | 1u << INTERSECTION_BLOCK_SHIFT);
        f.shape.emplace_back(4.0f, 4.0f, 0.5f, 0.1f);
        f.light.emplace_back(1.0f, 0.5f, 0.25f, opacity);
        f.bound.emplace_back(0.6f, 9.0f, 1.0f, 0.0f);
    }
    f.polynomial = {1, 0.693147004f, 0.240222424f, 0.0555073395f, 0.00967151299f, 0.00132647017f};
    f.alpha_cutoff = 1 / 255.0f;
    f.least_transmittance = least_transmittance(1e-4f);
    return f;
}

// The rules of blending, a pixel and a splat at a time.
std::uint64_t contributions(const BlendFrame& f) {
    std::uint64_t count = 0;
    for (int p = 0; p < 64; ++p) {
        double transmittance = 1;
        for (std::size_t i = 0; i < f.intersection_from_sorted.size(); ++i) {
            const glm::dvec4 s(f.shape[i]);
            const double dx = s.x - (p % 8 + 0.5), dy = s.y - (p / 8 + 0.5);
            const double x = s.z * dx + s.w * dy, y = double{f.bound[i].x} * dy;
            const double alpha =
                std::min(double{f.light[i].w} * std::exp(-0.5 * (x * x + y * y)), 0.99);
            if (alpha < double{f.alpha_cutoff}) continue;
            if (transmittance * (1 - alpha) < double{f.least_transmittance}) break;
            transmittance *= 1 - alpha;
            ++count;
        }
    }
    return count;
}

TEST(NativeBlend, Counts_areThoseOfThePlainRules) {
    const BlendFrame few = frame_of(5, 0.2f);        // corners fall below the cut-off
    EXPECT_EQ(count_blend(few).evaluated, 5u * 64);  // the other three blocks are not touched
    EXPECT_EQ(count_blend(few).contributing, contributions(few));
    EXPECT_LT(count_blend(few).contributing, 5u * 64);
}

TEST(NativeBlend, Block_whosePixelsHaveEndedIsLeft) {
    BlendFrame many = frame_of(400, 0.98f);
    for (glm::vec4& shape : many.shape) shape.z = shape.w = 0.01f;
    for (glm::vec4& bound : many.bound) bound.x = 0.01f;  // every pixel sees alpha of 0.98
    const BlendCounts counts = count_blend(many);
    EXPECT_EQ(counts.contributing, contributions(many));
    EXPECT_EQ(counts.contributing, 2u * 64);
    EXPECT_EQ(counts.evaluated, 8u * 64);  // looked at after each batch of 8
}

TEST(NativeSort, Result_isTheStableOrder) {
    Pcg32 random(5, 6);
    std::vector<std::uint32_t> keys(10'000), values(keys.size()), order(keys.size());
    for (std::uint32_t& key : keys) key = random.next() & 0xFF0000FFu;  // many equal ones
    std::iota(values.begin(), values.end(), 0u);
    order = values;
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
    std::vector<std::uint32_t> sorted = keys;
    NativeSort sort;
    sort.sort(sorted, values);
    EXPECT_EQ(values, order);
    EXPECT_TRUE(std::is_sorted(sorted.begin(), sorted.end()));
}

TEST(Measure, Samples_leaveWarmUpAndPreparationOut) {
    BenchResult result;
    int runs = 0, prepared = 0;
    take_samples(
        {0, 4, 9, 3}, 2,
        [&] {
            ++runs;
            return std::vector<PassTime>{{"a", 2.0 * runs}, {"b", 6.0}};
        },
        result, [&] { ++prepared; });
    EXPECT_EQ(runs, 7);
    EXPECT_EQ(prepared, 7);
    ASSERT_EQ(result.samples.size(), 4u);
    ASSERT_EQ(result.passes.size(), 2u);
    EXPECT_DOUBLE_EQ(result.passes[0].ms.median, 5.5);  // runs 4 to 7, two frames each
    EXPECT_DOUBLE_EQ(result.passes[1].ms.median, 3);
}

TEST(Measure, Share_isThatOfAllPasses) {
    const DeviceRates rates{1e9, 1e9};
    BenchResult result;
    result.counts = {1000, 500, 2000, 4096, 0, 100'000};
    result.passes = {{"blend", {4, 4, 4}}, {"unknown", {4, 4, 4}}};
    rate_passes(rates, result);
    const PassWork work = *pass_work("blend", result.counts);
    EXPECT_EQ(total_work(result).fma, work.fma);
    EXPECT_NEAR(roofline_share(result, rates), roofline_share(work, rates, 8), 1e-12);
    result.counts.evaluated *= 2;  // counted, not estimated from the intersections
    EXPECT_DOUBLE_EQ(pass_work("blend", result.counts)->fma, 2 * work.fma);
}

TEST(Growth, Exponent_isFittedOverTheLargestDecade) {
    std::vector<GrowthPoint> points;
    for (const double x : {1e3, 1e4, 3e4, 1e5}) {
        GrowthPoint p;
        p.splats = x;
        p.intersections = 100 * std::sqrt(x);
        p.ms.median = x < 5e3 ? 50 : 2e-3 * std::pow(x, 0.8);  // fixed costs first
        points.push_back(p);
    }
    EXPECT_NEAR(growth_exponent(points, "splats"), 0.8, 1e-9);
    EXPECT_TRUE(std::isnan(growth_exponent({points[0]}, "splats")));
    points.erase(points.begin());
    EXPECT_NEAR(growth_exponent(points, "intersections"), 1.6, 1e-9);
}

TEST(Growth, Page_saysWhatIsHeld) {
    const auto curve = [](const char* name, const char* by, double splats, double pixels) {
        GrowthCurve c{name, by, {GrowthPoint{}}};
        c.points[0].splats = splats;
        c.points[0].pixels = pixels;
        return c;
    };
    nlohmann::json context;
    for (const char* key : {"device", "driver", "processor", "date", "commit"}) context[key] = key;
    context["num_cpus"] = 2;
    const std::string html =
        growth_report(
            {curve("frame", "splats", 7, 1111), curve("frame", "pixels", 2222, 7),
             curve("iteration", "splats", 7, 3333), curve("iteration", "pixels", 4444, 7)},
            context)
            .page();
    for (const char* text :
         {"A frame has 1,111 pixels where splats vary and 2,222 splats where pixels vary;",
          "Adam) has 3,333 pixels where splats vary and 4,444 splats where pixels vary."})
        EXPECT_NE(html.find(text), std::string::npos) << text;
}

TEST(BenchCommand, BadUse_isRefused) {
    expect_refused({{"bench '('", "no regular expression"},
                    {"bench no_such_case", "fits no case"},
                    {"bench --data " + (scratch() / "none").string(), "is no folder"},
                    {"bench --growth sort", "measures no cases"},
                    {"bench --html a.html", "Add --growth"},
                    {"bench --samples 0", "--samples"}});
}

TEST(BenchCommand, MissingData_leavesCasesOutByName) {
    const Outcome o = darb("bench 'biker|castle_800' --data " + scratch().string());
    ASSERT_EQ(o.code, 0) << o.err;
    for (const char* name :
         {"render/biker/1280x720", "train/sceaux_castle_800", "start/biker/cold"})
        EXPECT_NE(o.err.find(std::string(name) + " is left out"), std::string::npos) << o.err;
}

TEST(BenchCommand, Result_saysWhereAndHowItWasMeasured) {
    const fs::path json = scratch() / "bench.json";
    const Outcome o =
        darb("bench scan/1M --samples 3 --seconds 0 --note quiet --json " + json.string());
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.out.find("scan/1M"), std::string::npos) << o.out;
    EXPECT_NE(o.out.find("times native"), std::string::npos) << o.out;
    const auto result = nlohmann::json::parse(read_text_file(json));
    for (const char* key : {"date", "device", "driver", "commit", "load_avg", "scheduling",
                            "processor", "num_cpus", "copy_bytes_per_s", "fma_per_s"})
        EXPECT_TRUE(result["context"].contains(key)) << key;
    EXPECT_EQ(result["context"]["note"], "quiet");
    ASSERT_EQ(result["benchmarks"].size(), 1u);
    const auto& one = result["benchmarks"][0];
    EXPECT_EQ(one["name"], "scan/1M");
    EXPECT_EQ(one["time_unit"], "ms");
    EXPECT_EQ(one["samples"].size(), 3u);
    EXPECT_EQ(one["bytes"].get<double>(), 12e6);
    EXPECT_GT(one["real_time"].get<double>(), 0);
    EXPECT_GT(one["passes"]["scan"]["roofline"].get<double>(), 0);
    EXPECT_EQ(one["yardsticks"]["scan"]["same_result"], 1.0);
}

TEST(BenchCommand, Tuning_hasARowForEveryWayOfThisDevice) {
    const fs::path json = scratch() / "ways.json";
    const Outcome o =
        darb("bench tuning/scatter --samples 1 --seconds 0 --tune scatter=ballot --json " +
             json.string());
    ASSERT_EQ(o.code, 0) << o.err;
    const auto result = nlohmann::json::parse(read_text_file(json));
    EXPECT_NE(result["context"]["tuning"].get<std::string>().find("scatter=ballot"),
              std::string::npos);
    const auto& passes = result["benchmarks"][0]["passes"];
    EXPECT_EQ(passes.size(), 2u);
    for (const char* way : {"scatter=ballot", "scatter=columns"})
        EXPECT_GT(passes[way]["median"].get<double>(), 0) << way;
}

TEST(BenchCommand, Growth_isATableFilesAndAPage_long) {
    const fs::path json = scratch() / "growth.json", html = scratch() / "growth.html";
    const Outcome o = darb("bench --growth --most-splats 1000 --samples 1 --seconds 0 --json " +
                           json.string() + " --html " + html.string());
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.out.find("iteration by pixels"), std::string::npos) << o.out;
    const auto growth = nlohmann::json::parse(read_text_file(json))["growth"];
    ASSERT_EQ(growth.size(), 4u);
    EXPECT_EQ(growth[0]["points"].size(), 1u);
    EXPECT_EQ(growth[1]["points"].size(), 7u);
    for (const auto& curve : growth)
        for (const auto& point : curve["points"]) EXPECT_GT(point["ms"].get<double>(), 0);
    const std::string page = read_text_file(html);
    EXPECT_NE(page.find("exponent"), std::string::npos);
    EXPECT_EQ(page.find("http"), page.find("http://www.w3.org"));  // nothing from outside
}

TEST(BenchCommand, Frame_hasPassesCountsAndYardsticks_slow) {
    const fs::path json = scratch() / "frame.json";
    const Outcome o =
        darb("bench random_100k/1280 --samples 1 --seconds 0 --json " + json.string());
    ASSERT_EQ(o.code, 0) << o.err;
    const auto one = nlohmann::json::parse(read_text_file(json))["benchmarks"][0];
    EXPECT_EQ(one["splats"], 100'000);
    EXPECT_GT(one["pairs"].get<double>(), 300'000);
    EXPECT_GT(one["evaluated_splat_pixels"].get<double>(),
              one["contributing_splat_pixels"].get<double>());
    EXPECT_GT(one["contributing_splat_pixels"].get<double>(), 1e6);
    for (const char* pass : {"project", "depth sort", "tile sort", "blend"})
        EXPECT_GT(one["passes"][pass]["roofline"].get<double>(), 0) << pass;
    EXPECT_GT(one["yardsticks"]["blend"]["psnr_db"].get<double>(), 60);
    EXPECT_LT(one["yardsticks"]["blend backward"]["relative_error"].get<double>(), 0.01);
}

}  // namespace
}  // namespace darb::test
