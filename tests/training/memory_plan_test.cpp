// trainer/memory_plan: the plan against what a device counted.
#include "trainer/memory_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "tests/support/scoped_variants.h"
#include "trainer/initial_model.h"
#include "trainer/trainer.h"

namespace darb {
namespace {

constexpr double kTolerance = 0.1;

Dataset small_scene() {
    DatasetOptions options;
    options.resolution = 2;  // 100 x 75 px: splats and photos weigh about the same
    return load_dataset(std::filesystem::path(DARB_SOURCE_DIR) / "assets" / "scene", options);
}

// Trains, and plans with the counts that the run ended at.
void compare_with_run(const TrainOptions& options, const std::string& ways = "") {
    const Dataset dataset = small_scene();
    MemoryDemand demand;
    add_photos(dataset.views, options, demand);
    Device device;
    const test::ScopedVariants variants(device, ways);
    if (tuning_of(device).backward == BackwardBlend::buckets) demand.bucket = bucket_pairs(device);
    Trainer trainer(device, dataset, load_photos(dataset.views), initial_model(dataset, options),
                    options);
    trainer.on_result = [&](const IterationResult& r) {
        demand.pairs = std::max<std::uint64_t>(demand.pairs, r.pairs);
    };
    while (trainer.iteration() < options.iterations) trainer.step();
    trainer.drain();
    demand.splats = trainer.splat_count();
    demand.pairs = std::max(demand.pairs, demand.splats * 4);  // what the trainer reserves
    demand.densifies = options.densify_end() > options.densify_from;
    const auto peak = static_cast<double>(device.peak_bytes());
    const auto planned = static_cast<double>(plan_memory(demand).total());
    EXPECT_NEAR(planned, peak, kTolerance * peak) << demand.splats << " splats";
}

TEST(MemoryPlan, run_without_density_control_is_met) {
    TrainOptions options;
    options.iterations = 3;
    options.densify_until = 0;
    compare_with_run(options);
}

TEST(MemoryPlan, run_with_checkpoints_is_met) {
    TrainOptions options;
    options.iterations = 3;
    options.densify_until = 0;
    options.sh_degree = 0;
    compare_with_run(options, "backward=buckets");
}

TEST(MemoryPlan, run_of_degree_0_is_met) {
    TrainOptions options;
    options.iterations = 3;
    options.densify_until = 0;
    options.sh_degree = 0;
    compare_with_run(options);
}

TEST(MemoryPlan, run_with_exposure_and_antialiasing_is_met) {
    TrainOptions options;
    options.iterations = 3;
    options.densify_until = 0;
    options.sh_degree = 0;  // few other bytes: the effects' are a larger share
    options.exposure = options.antialias = true;
    compare_with_run(options);
    MemoryDemand with, without;
    const Dataset dataset = small_scene();
    add_photos(dataset.views, options, with);
    add_photos(dataset.views, {}, without);
    with.splats = without.splats = 4'000;
    EXPECT_GT(plan_memory(with).effects, 100U * 75U * 12U + 4'000U * 4U);
    EXPECT_EQ(plan_memory(without).effects, 0U);
}

TEST(MemoryPlan, run_with_density_control_is_met) {
    TrainOptions options;
    options.iterations = 20;
    options.densify_from = 1;
    options.densify_interval = 4;
    options.densify_until = 19;
    options.densify_grad_threshold = 1e-5f;
    options.prune_opacity = 0.1f;  // some go in every round, so that buffers are made anew
    options.max_splats = 9'000;
    compare_with_run(options);
}

TEST(MemoryPlan, photos_count_only_where_they_are_trained_on) {
    Dataset dataset = small_scene();
    MemoryDemand all, some;
    add_photos(dataset.views, {}, all);
    dataset.views[0].is_test = true;
    add_photos(dataset.views, {}, some);
    EXPECT_EQ(all.photo_pixels - some.photo_pixels, 100U * 75U);
    EXPECT_EQ(some.image_pixels, 100U * 75U);
}

TEST(MemoryPlan, splats_within_a_budget_meet_it) {
    MemoryDemand demand{1'000'000, 6'000'000, 3, 50'000'000, 1'000'000, true, 50, 50};
    const std::uint64_t budget = std::uint64_t{900} << 20;
    const std::uint64_t splats = splats_within(demand, budget);
    ASSERT_GT(splats, 0U);
    ASSERT_LT(splats, demand.splats);
    demand.pairs = demand.pairs * splats / demand.splats;
    demand.splats = splats;
    EXPECT_NEAR(static_cast<double>(plan_memory(demand).total()), static_cast<double>(budget), 1e4);
    EXPECT_EQ(splats_within(demand, 1'000), 0U);
}

}  // namespace
}  // namespace darb
