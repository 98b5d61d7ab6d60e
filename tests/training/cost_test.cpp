// SPDX-License-Identifier: MIT
// darb cost: errors, fronts and predictions on known numbers; the whole measurement on small
// scenes; and its pages in a browser.
#include "tools/cost/accuracy_cost.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "engine/gpu/faults.h"
#include "tests/support/chromium.h"
#include "tests/support/shared_device.h"
#include "tests/support/test_device_options.h"
#include "tests/support/test_scene.h"
#include "tools/cost/cost_report.h"
#include "tools/cost/train_cost.h"
#include "trainer/growth/initial_model.h"
#include "trainer/step/trainer.h"

namespace darb::test {
namespace {

const CostPlan kShortest{1, 1, 0, 2};

TEST(PictureError, is_that_of_planted_errors) {
    ImageF truth(50, 20, 3), picture(50, 20, 3);
    for (float& v : truth.data) v = 0.5f;
    picture.data = truth.data;
    EXPECT_EQ(picture_error({picture}, {truth}).psnr_db, 200);
    picture.data[7] = 1.7f;  // a screen shows 1
    const PictureError e = picture_error({picture}, {truth});
    EXPECT_NEAR(e.mse, 0.25 / 3000, 1e-9);
    EXPECT_FLOAT_EQ(static_cast<float>(e.largest), 0.5f);
    EXPECT_EQ(e.percentile, 0) << "one value in 3,000 is less than 0.1 %";
    for (int i = 0; i < 9; ++i) picture.data[100 + i] = 0.25f;
    EXPECT_FLOAT_EQ(static_cast<float>(picture_error({picture}, {truth}).percentile), 0.25f);
}

TEST(Spread, is_median_and_quartiles) {
    const Spread s = spread_of({5, 1, 2, 4, 3});
    EXPECT_EQ(s.median, 3);
    EXPECT_EQ(s.low, 2);
    EXPECT_EQ(s.high, 4);
}

CostRow row(int setting, int choice, double ms, double mse) {
    CostRow r;
    if (setting >= 0) r.accuracy.choice[setting] = choice;
    r.setting = setting;
    r.name = accuracy_text(r.accuracy);
    r.ms.median = ms;
    r.error.mse = mse;
    r.error.psnr_db = -10 * std::log10(mse);
    return r;
}

TEST(Front, holds_what_nothing_beats) {
    std::vector<CostRow> rows = {row(-1, 0, 10, 1e-6), row(kStorage, 1, 9, 1e-6),
                                 row(kAlphaCutoff, 2, 6, 1e-4), row(kRenderScale, 1, 7, 1e-3),
                                 row(kAlphaCutoff, 1, 12, 1e-9)};
    mark_fronts(rows);
    const bool expected[] = {false, true, true, false, true};
    for (size_t i = 0; i < rows.size(); ++i) EXPECT_EQ(rows[i].on_front, expected[i]) << i;
}

TEST(Front, leaves_out_what_is_faster_by_less_than_the_spread) {
    std::vector<CostRow> rows = {row(-1, 0, 10, 1e-6), row(kStorage, 1, 9, 1e-5),
                                 row(kAlphaCutoff, 2, 5, 1e-4)};
    for (CostRow& r : rows) {
        r.ms.low = r.ms.median - 0.8;
        r.ms.high = r.ms.median + 0.8;
    }
    mark_fronts(rows);
    EXPECT_TRUE(rows[0].on_front);
    EXPECT_FALSE(rows[1].on_front);
    EXPECT_TRUE(rows[2].on_front);
}

TEST(Combinations, join_what_is_fast_and_leave_out_what_is_slow_and_wrong) {
    const std::vector<CostRow> rows = {row(-1, 0, 10, 1e-8), row(kStorage, 1, 8, 2e-8),
                                       row(kAlphaCutoff, 2, 5, 5e-8),
                                       row(kEvaluation, 5, 13, 1e-3)};
    const std::vector<Accuracy> all = promising_combinations(rows, 10);
    Accuracy both;
    both.choice[kStorage] = 1;
    both.choice[kAlphaCutoff] = 2;
    EXPECT_NE(std::find(all.begin(), all.end(), both), all.end());
    for (const Accuracy& a : all) EXPECT_EQ(a.choice[kEvaluation], 0);
    EXPECT_LE(promising_combinations(rows, 1).size(), 1U);
}

TEST(Orbit, frames_the_splats) {
    TestScene scene = random_scene({.count = 300, .sh_degree = 0, .seed = 3});
    for (size_t i = 0; i < scene.model.size(); ++i) scene.model.position[i * 3] += 40;
    scene.model.origin = {1000, 0, 0};
    const CostViews views = orbit_views(scene.model, 8, 120, 80);
    ASSERT_EQ(views.cameras.size(), 8U);
    for (const Camera& camera : views.cameras) {
        size_t inside = 0;
        for (size_t i = 0; i < scene.model.size(); ++i) {
            const float* p = &scene.model.position[i * 3];
            const glm::dvec3 at =
                camera.rotation * (glm::dvec3(p[0], p[1], p[2]) + scene.model.origin) +
                camera.translation;
            const double x = camera.fx * at.x / at.z + camera.cx;
            const double y = camera.fy * at.y / at.z + camera.cy;
            inside += at.z > 0 && x > 0 && x < 120 && y > 0 && y < 80 ? 1 : 0;
        }
        EXPECT_GT(inside, scene.model.size() * 8 / 10);
        EXPECT_NEAR(glm::determinant(camera.rotation), 1, 1e-9);
    }
}

SplatModel crowded_model() {
    return random_scene({.count = 3000,
                         .kernel = KERNEL_RAISED_COSINE,
                         .min_log_scale = -4,
                         .max_log_scale = -1,
                         .min_logit = -3,
                         .max_logit = 6,
                         .seed = 12})
        .model;
}

void expect_all_drawn(const std::string& html, int plots) {
    if (chromium().empty()) GTEST_SKIP() << "no Chromium to open the page with";
    const OpenedPage page = open_page(html, testing::TempDir());
    EXPECT_EQ(page.console, "");
    EXPECT_EQ(page.plots, plots);
    EXPECT_EQ(page.drawn, plots);
    EXPECT_EQ(page.cut, 0) << page.touching;
    EXPECT_EQ(page.overlaps, 0) << page.touching;
}

TEST(Cost, small_scene_is_measured_whole) {
    const SplatModel model = crowded_model();
    const CostViews views = orbit_views(model, 2, 96, 64);
    const CostResult result = measure_cost(shared_device(), model, views, glm::vec3(0), kShortest,
                                           [](const std::string&) {});
    EXPECT_EQ(result.rows[0].name, "balanced");
    EXPECT_GT(result.rows[0].error.psnr_db, 40);
    std::set<int> changed;
    for (const CostRow& r : result.rows) {
        EXPECT_GT(r.ms.median, 0) << r.name;
        EXPECT_FALSE(r.passes.empty()) << r.name;
        if (r.setting >= 0 && !r.same_as_balanced) changed.insert(r.setting);
        if (r.name == "exact") {
            EXPECT_GT(r.error.psnr_db, 85) << "float32 at the truth's own settings";
        }
    }
    EXPECT_FALSE(changed.contains(kArithmetic)) << "this kernel has no form in half precision";
    EXPECT_EQ(changed.size(), size_t{kAccuracyCount - 1}) << "a setting changes no picture";
    const std::string usual = shared_device().tuning().exp_builtin ? "builtin" : "polynomial";
    EXPECT_TRUE(std::ranges::none_of(result.rows, [&](const CostRow& r) {
        return r.name == "evaluation " + usual;
    })) << "the default once more";
    EXPECT_NE(cost_table(result).find("Fastest"), std::string::npos);
    const nlohmann::json json = cost_json(result);
    EXPECT_EQ(json["rows"].size(), result.rows.size());
    EXPECT_EQ(json["rows"][0]["accuracy"]["alpha_cutoff"], "1/255");
    expect_all_drawn(cost_report(result, "a <scene>").page(), 3);
}

TEST(Cost, half_precision_has_a_row_where_kernel_and_device_have_it) {
    const auto has_row = [](const Device& device, int kernel) {
        Schedule schedule;
        schedule.options.kernel = kernel;
        return std::ranges::any_of(training_rows(device, schedule), [](const TrainCostRow& row) {
            return row.name == "arithmetic fast16";
        });
    };
    DeviceOptions without = device_options();
    without.faults = parse_faults("no_half");
    const Device plain(without);
    const bool half = shared_device().info().half_arithmetic;
    EXPECT_EQ(has_row(shared_device(), KERNEL_GAUSSIAN), half);
    EXPECT_FALSE(has_row(shared_device(), KERNEL_RAISED_COSINE));
    EXPECT_FALSE(has_row(plain, KERNEL_GAUSSIAN));
}

// Every setting changes some picture of the scene that ships with the sources.
TEST(Cost, every_setting_changes_the_shipped_scene) {
    const Dataset dataset = load_dataset(std::filesystem::path(DARB_SOURCE_DIR) / "assets/scene",
                                         {.resolution = 8, .hold_out = true});
    TrainOptions options;
    options.iterations = 300;
    options.sh_interval = 60;
    options.kernel = KERNEL_RAISED_COSINE;
    options.densify_grad_threshold = 5e-5f;
    options.densify_from = 100;
    Trainer trainer(shared_device(), dataset, load_photos(dataset.views),
                    initial_model(dataset, options), options);
    while (trainer.iteration() < options.iterations) trainer.step();
    const CostResult result =
        measure_cost(shared_device(), trainer.model(), dataset_views(dataset, 3), glm::vec3(0),
                     {1, 1, 0, 0}, [](const std::string&) {});
    std::set<int> changed;
    for (const CostRow& r : result.rows) {
        if (r.setting >= 0 && !r.same_as_balanced) changed.insert(r.setting);
        ASSERT_TRUE(r.photo_psnr_db.has_value());
        EXPECT_GT(*r.photo_psnr_db, 5) << r.name;
    }
    for (int s = 0; s < kAccuracyCount; ++s)
        EXPECT_TRUE(changed.contains(s) || s == kArithmetic) << accuracy_settings()[s].name;
}

TEST(TrainCost, prices_every_setting_of_training_long) {
    const Dataset dataset = load_dataset(std::filesystem::path(DARB_SOURCE_DIR) / "assets/scene",
                                         {.resolution = 8, .hold_out = true});
    TrainOptions options;
    options.iterations = 8;
    options.opacity_reset_interval = 3;  // one late reset
    options.kernel = KERNEL_RAISED_COSINE;
    const TrainCostResult result =
        measure_train_cost(shared_device(), dataset, options, {1, 2}, [](const std::string&) {});
    EXPECT_EQ(result.rows[0].name, "balanced");
    std::set<std::string> names;
    for (const TrainCostRow& r : result.rows) {
        EXPECT_GT(r.ms.median, 0) << r.name;
        // The reset of 3DGS, to 0.01, has four iterations to come back from.
        EXPECT_GT(r.psnr_db.median, r.name == "schedule of 3DGS" ? 3 : 5) << r.name;
        names.insert(r.name);
        EXPECT_EQ(r.gradient_error.has_value(), !r.change) << r.name;
        if (!r.gradient_error) continue;
        EXPECT_GT(r.gradient_error->low, 0) << r.name;
        if (r.name == "exact") {
            EXPECT_LT(r.gradient_error->high, 0.01) << "the gradient of the truth";
        }
        if (r.name == "alpha_cutoff 1/64") {
            EXPECT_GT(r.gradient_error->median, result.rows[0].gradient_error->median);
        }
    }
    EXPECT_EQ(names.size(), result.rows.size());
    EXPECT_TRUE(names.contains("without resolution ramp"));
    EXPECT_TRUE(names.contains("late opacity resets"));
    EXPECT_TRUE(names.contains("splats beside photos"));
    EXPECT_TRUE(names.contains("rates and rounds of a long run"));
    EXPECT_TRUE(names.contains("sh degree 2 by the iteration"));
    EXPECT_EQ(train_cost_json(result)["rows"].size(), result.rows.size());
    expect_all_drawn(train_cost_report(result).page(), 3);
}

TEST(TrainCost, has_the_exact_footprint_where_the_kernel_has_it) {
    const auto has_row = [](int kernel) {
        TrainOptions options;
        options.kernel = kernel;
        return std::ranges::any_of(
            training_rows(shared_device(), options),
            [](const TrainCostRow& r) { return r.name == "footprint exact"; });
    };
    EXPECT_TRUE(has_row(KERNEL_GAUSSIAN));
    EXPECT_FALSE(has_row(KERNEL_GES_PUBLISHED));
    EXPECT_FALSE(has_row(KERNEL_RAISED_COSINE_2_PULSES));
}

}  // namespace
}  // namespace darb::test
