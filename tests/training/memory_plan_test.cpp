// SPDX-License-Identifier: MIT
// trainer/memory_plan: the plan against what a device counted.
#include "trainer/step/memory_plan.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "engine/core/files.h"
#include "tests/support/resident_bytes.h"
#include "tests/support/scoped_variants.h"
#include "tests/support/test_device_options.h"
#include "trainer/growth/initial_model.h"
#include "trainer/options/strategy.h"
#include "trainer/run/forecast.h"
#include "trainer/run/run.h"
#include "trainer/step/trainer.h"

namespace darb {
namespace {

// Share of a run's peak that may exist for a moment without being planned for, such as one
// picture's camera.
constexpr double kTolerance = 0.01;

Dataset shipped_scene(int resolution = 2) {
    DatasetOptions options;
    options.resolution = resolution;  // 2: 100 x 75 px, splats and photos weigh about the same
    return load_dataset(std::filesystem::path(DARB_SOURCE_DIR) / "assets" / "scene", options);
}

TrainOptions options_of(int sh_degree, bool effects = false) {
    TrainOptions options;
    options.iterations = 3;
    options.densify_until = 0;
    options.sh_degree = sh_degree;
    options.exposure = options.antialias = effects;
    return options;
}

// What exists after an iteration with `splats` splats, by the plan for them and by the device.
void compare_to_the_byte(const TrainOptions& options, std::uint32_t splats,
                         const std::string& ways = "", int resolution = 2) {
    const Dataset dataset = shipped_scene(resolution);
    Device device{test::device_options()};
    const test::ScopedVariants variants(device, ways);
    SplatModel start = split_model(initial_model(dataset, options), splats, 1);
    start.resize(std::min<std::size_t>(start.size(), splats));
    Trainer trainer(device, dataset, load_photos(dataset.views), start, options);
    trainer.step();
    trainer.drain();
    MemoryDemand demand;
    add_photos(dataset.views, options, demand);
    demand.splats = splats;
    demand.intersections = trainer.memory_demand().intersections;
    demand.densifies = false;
    demand.streams = ways.find("photos=streamed") != std::string::npos;
    ASSERT_GE(demand.intersections, 4U * splats);
    EXPECT_EQ(plan_memory(device, demand).resident(), device.allocated_bytes())
        << splats << " splats, degree " << options.sh_degree << ", effects " << options.exposure
        << ", " << ways << strategy_name(options.strategy);
    const auto peak = static_cast<double>(device.peak_bytes());
    EXPECT_NEAR(static_cast<double>(plan_memory(device, demand).total()), peak, kTolerance * peak);
}

TEST(MemoryPlan, what_a_trainer_holds_is_met_to_the_byte) {
    for (const int sh_degree : {0, 1, 3}) compare_to_the_byte(options_of(sh_degree), 4'000);
    for (const std::uint32_t splats : {1U, 700U, 12'000U})
        compare_to_the_byte(options_of(0), splats);
}

TEST(MemoryPlan, exposure_and_antialiasing_are_met_to_the_byte) {
    compare_to_the_byte(options_of(0, true), 4'000);
    compare_to_the_byte(options_of(3, true), 8'000);
    TrainOptions tones = options_of(0, true);
    tones.exposure_grid = true;
    compare_to_the_byte(tones, 4'000);
    MemoryDemand with, without;
    const Dataset dataset = shipped_scene();
    add_photos(dataset.views, options_of(0, true), with);
    add_photos(dataset.views, {}, without);
    const Device device{test::device_options()};
    with.splats = without.splats = 4'000;
    EXPECT_GT(plan_memory(device, with).effects, 100U * 75U * 12U + 4'000U * 4U);
    EXPECT_LE(plan_memory(device, without).effects, 16U);
}

TEST(MemoryPlan, checkpoints_of_buckets_are_met_to_the_byte) {
    compare_to_the_byte(options_of(0), 4'000, "backward=buckets");
}

TEST(MemoryPlan, photos_that_stream_are_met_to_the_byte) {
    TrainOptions options = options_of(1);
    options.iterations = 10;
    options.resolution_ramp = true;
    compare_to_the_byte(options, 4'000, "photos=streamed", 1);
}

TEST(MemoryPlan, strategies_are_met_to_the_byte) {
    for (const Strategy strategy : {Strategy::mcmc, Strategy::budget}) {
        TrainOptions options = options_of(2);
        options.strategy = strategy;
        options.densify_until = 0;
        options.iterations = 10;
        options.resolution_ramp = strategy == Strategy::budget;
        MemoryDemand demand;
        add_photos(shipped_scene(1).views, options, demand);
        EXPECT_EQ(demand.small_pixels > 0, options.resolution_ramp);
        compare_to_the_byte(options, 4'000, "", 1);
        options.batch = 4;
        compare_to_the_byte(options, 4'000, "", 1);
    }
}

TEST(MemoryPlan, the_mean_of_the_last_iterations_is_met_to_the_byte) {
    TrainOptions options = options_of(2);
    options.iterations = 10;
    options.average_from = 0.5;
    const Dataset dataset = shipped_scene();
    Device device{test::device_options()};
    Trainer trainer(device, dataset, load_photos(dataset.views), initial_model(dataset, options),
                    options);
    for (int i = 1; i <= 10; ++i) {
        trainer.step();
        trainer.drain();
        const MemoryPlan plan = plan_memory(device, trainer.memory_demand());
        EXPECT_EQ(plan.average > 0, i > 5 && i < 10) << i;
        EXPECT_EQ(plan.resident() + plan.average, device.allocated_bytes()) << i;
    }
    EXPECT_EQ(trainer.planned_bytes(), device.peak_bytes());
    MemoryDemand grows = trainer.memory_demand();
    grows.averages = true;
    const MemoryPlan later = plan_memory(device, grows);
    EXPECT_EQ(later.total(), later.resident() + std::max(later.densify, later.average));
}

TEST(MemoryPlan, refined_cameras_are_met_to_the_byte) {
    TrainOptions options = options_of(1);
    options.refine_cameras = true;
    compare_to_the_byte(options, 4'000);
}

TEST(MemoryPlan, learned_kernels_are_met_to_the_byte) {
    TrainOptions options = options_of(1);
    options.learn_kernel = 2;
    compare_to_the_byte(options, 4'000);
}

TEST(MemoryPlan, no_splats_are_met_to_the_byte) {
    compare_to_the_byte(options_of(1), 0);
}

// The peak of a whole run, by the plans for all that the trainer went through.
void compare_with_run(const Dataset& dataset, const TrainOptions& options, int degree) {
    Device device{test::device_options()};
    Trainer trainer(device, dataset, load_photos(dataset.views), initial_model(dataset, options),
                    options);
    const std::uint32_t start = trainer.splat_count();
    while (trainer.iteration() < options.iterations) trainer.step();
    trainer.drain();
    const auto peak = static_cast<double>(device.peak_bytes());
    EXPECT_NEAR(static_cast<double>(trainer.planned_bytes()), peak, kTolerance * peak)
        << trainer.splat_count() << " splats";
    EXPECT_EQ(trainer.memory_demand().sh_degree, degree);
    if (Schedule(options).rounds.end > 0) {
        EXPECT_GT(trainer.splat_count(), start);
    }
}

TEST(MemoryPlan, the_peak_of_density_control_is_met) {
    TrainOptions options;
    options.iterations = 20;
    options.densify_from = 1;
    options.densify_interval = 4;
    options.densify_until = 19;
    options.densify_grad_threshold = 1e-5f;
    options.prune_opacity = 0.1f;  // some go in every round, so that buffers are made anew
    options.max_splats = 9'000;
    for (const int every : {1, 4}) {
        options.sh_rest_every = every;
        compare_with_run(shipped_scene(), options, 3);
    }
}

TEST(MemoryPlan, the_peak_of_a_degree_added_on_the_way_is_met) {
    TrainOptions options;
    options.iterations = 8;
    options.densify_until = 0;
    options.probe_sh = true;
    options.sh_interval = 3;
    Dataset few = shipped_scene();
    few.views.resize(6);  // too few photos for a trial: each degree is admitted
    few.points.seen_begin.clear();
    few.points.seen_by.clear();
    for (const int every : {1, 2}) {
        options.sh_rest_every = every;
        compare_with_run(few, options, 2);
    }
}

// Measuring the device at the start is neither part of the peak nor of the budget.
TEST(MemoryPlan, the_log_of_a_run_holds_plan_and_peak) {
    TrainOptions options = options_of(1);
    options.max_memory_bytes = std::uint64_t{32} << 20;
    RunOptions run;
    run.output = std::filesystem::temp_directory_path() / fmt::format("darb_plan_{}", ::getpid());
    run.quiet = true;
    run.report = false;
    Device device{test::device_options()};
    run_training(device, shipped_scene(), options, run);
    const auto metrics = nlohmann::json::parse(read_text_file(run.output / "metrics.json"));
    const auto peak = metrics["peak_device_bytes"].get<double>();
    EXPECT_NEAR(metrics["planned_device_bytes"].get<double>(), peak, kTolerance * peak);
    EXPECT_LT(peak, 32e6);
    std::filesystem::remove_all(run.output);
}

// Time for which a view paused the run is not training time; here it is far more than the run took.
TEST(RunTime, a_pause_is_left_out) {
    TrainOptions options = options_of(1);
    RunOptions run;
    run.output = std::filesystem::temp_directory_path() / fmt::format("darb_pause_{}", ::getpid());
    run.quiet = true;
    run.report = false;
    int steps = 0;
    run.on_step = [&](const LiveStep&) { return ++steps == 1 ? 1e6 : 0.0; };
    Device device{test::device_options()};
    const TrainResult summary = run_training(device, shipped_scene(), options, run);
    EXPECT_GT(steps, 0);
    EXPECT_LT(summary.seconds, 0);
    EXPECT_GT(summary.seconds, -1e6);
    std::filesystem::remove_all(run.output);
}

// How much the process grows while it trains on photos of `scale` times 200x150 px, and the
// bytes of these. Each view is there twice, so that photos outweigh everything else.
std::pair<std::uint64_t, std::uint64_t> growth_with_photos(Device& device, int scale) {
    Dataset dataset = shipped_scene(1);
    const std::vector<View> once = dataset.views;
    for (View view : once) {
        view.name = "again_" + view.name;
        dataset.views.push_back(view);
    }
    const std::uint64_t before = test::resident_bytes();
    std::vector<ImageU8> photos;
    std::uint64_t bytes = 0;
    for (View& view : dataset.views) {
        Camera& c = view.camera;
        for (double* value : {&c.fx, &c.fy, &c.cx, &c.cy}) *value *= scale;
        c.width *= scale;
        c.height *= scale;
        std::vector<std::uint8_t>& data = photos.emplace_back(c.width, c.height, 4).data;
        std::fill(data.begin(), data.end(), std::uint8_t{255});  // opaque, else nothing to train on
        bytes += data.size();
    }
    RunOptions run;
    run.output = std::filesystem::temp_directory_path() / fmt::format("darb_once_{}", ::getpid());
    run.quiet = true;
    run.report = false;
    std::uint64_t during = before;
    run.on_step = [&](const LiveStep&) { return during = test::resident_bytes(), 0.0; };
    TrainOptions options = options_of(0);
    options.resolution_ramp = false;
    options.iterations = 1;
    run_training(device, dataset, options, run, nullptr, std::move(photos));
    std::filesystem::remove_all(run.output);
    return {during - std::min(before, during), bytes};
}

// Once where steps read them: on a CPU's driver that is this process, too.
TEST(RunMemory, training_photos_are_held_once) {
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "AddressSanitizer keeps what is freed";
#endif
    Device device{test::device_options()};
    growth_with_photos(device, 1);  // the driver keeps what it took for its compiler
    const auto [growth, photos] = growth_with_photos(device, 4);
    EXPECT_LT(growth, photos + photos * 7 / 10);
}

TEST(MemoryPlan, photos_count_only_where_they_are_trained_on) {
    Dataset dataset = shipped_scene();
    MemoryDemand all, some;
    add_photos(dataset.views, {}, all);
    dataset.views[0].is_test = true;
    add_photos(dataset.views, {}, some);
    EXPECT_EQ(all.photo_pixels - some.photo_pixels, 100U * 75U);
    EXPECT_EQ(some.image_pixels, 100U * 75U);
    EXPECT_EQ(some.views, all.views);
}

TEST(MemoryPlan, splats_within_a_budget_meet_it) {
    const Device device{test::device_options()};
    MemoryDemand demand;
    demand.splats = 1'000'000;
    demand.intersections = 3'000'000;
    demand.photo_pixels = 50'000'000;
    demand.width = 1'000;
    demand.height = 800;
    const std::uint64_t budget = std::uint64_t{900} << 20;
    const std::uint64_t splats = splats_within(device, demand, budget);
    ASSERT_GT(splats, 0U);
    ASSERT_LT(splats, demand.splats);
    demand.intersections = 3 * splats;
    demand.splats = splats;
    EXPECT_LE(plan_memory(device, demand).total(), budget);
    EXPECT_NEAR(static_cast<double>(plan_memory(device, demand).total()),
                static_cast<double>(budget), 1e-3 * static_cast<double>(budget));
    EXPECT_EQ(splats_within(device, demand, 1'000), 0U);
}

}  // namespace
}  // namespace darb
