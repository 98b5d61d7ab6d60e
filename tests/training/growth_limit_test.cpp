// SPDX-License-Identifier: MIT
// Where splats stop growing in number, and how a run uses the memory that there is.
#include "engine/core/error.h"
#include "tests/support/resumed_run.h"
#include "tests/support/scoped_variants.h"
#include "tests/support/test_device_options.h"

namespace darb::test {
namespace {

std::unique_ptr<Device> faulty_device(const std::string& fault) {
    DeviceOptions options = device_options();
    options.faults = parse_faults(fault);
    return std::make_unique<Device>(options);
}

TEST(Limits, splats_stop_growing_at_the_limit) {
    TinyTraining t = tiny_training();
    t.options.max_splats = 70;
    t.options.prune_opacity = 0;
    t.options.prune_extent = 100;
    Trainer trainer = t.trainer();
    run_to(trainer, 60);
    EXPECT_EQ(trainer.splat_count(), 70U);
    EXPECT_GT(trainer.counters().cloned_or_split, 5U);
}

/// Every splat grows in every round, and none is removed.
TinyTraining growing(const TinyOptions& tiny) {
    TinyTraining t = tiny_training(tiny);
    t.options.prune_opacity = 0;
    t.options.prune_extent = 100;
    t.options.densify_grad_threshold = 1e-7f;
    t.options.opacity_reset_interval = 1000;
    return t;
}

/// Half of what an unlimited run of `t` adds after its first round.
std::uint64_t half_of_the_growth(const TinyTraining& t, std::uint32_t& unlimited) {
    Trainer trainer = t.trainer();
    run_to(trainer, 15);
    const std::uint64_t before = shared_device().allocated_bytes();
    run_to(trainer, 60);
    unlimited = trainer.splat_count();
    return before + (shared_device().allocated_bytes() - before) / 2;
}

// The budget is not enforced here, so that what exceeds it is seen rather than refused.
TEST(Limits, growth_stops_before_the_memory_budget) {
    TinyTraining t = growing({.splats = 600});
    Device& device = shared_device();
    std::uint32_t unlimited = 0;
    t.options.max_memory_bytes = half_of_the_growth(t, unlimited);
    ASSERT_GT(unlimited, 2000U);
    Trainer trainer = t.trainer();
    device.set_memory_budget(0);
    device.forget_peak();
    run_to(trainer, 60);
    EXPECT_LT(trainer.splat_count(), unlimited);
    EXPECT_GT(trainer.splat_count(), 600U);
    EXPECT_GE(trainer.stopped_by_memory(), 600U);
    EXPECT_LE(device.peak_bytes(), t.options.max_memory_bytes);
}

/// A budget that holds the ramp's smallest photos beside the whole ones, but not the next, from
/// iteration 7 on.
TEST(Limits, a_run_without_room_for_smaller_photos_trains_on_whole_ones) {
    TinyTraining t = tiny_training({.width = 800, .height = 64, .splats = 8});
    t.options.densify_until = 0;
    t.options.average_from = 1;
    Device roomy_device{device_options()}, narrow_device{device_options()};
    const ScopedVariants roomy_photos(roomy_device, "photos=resident");
    const ScopedVariants narrow_photos(narrow_device, "photos=resident");
    Trainer roomy(roomy_device, t.dataset, t.photos, t.start(), t.options);
    run_to(roomy, 6);
    t.options.max_memory_bytes = roomy_device.allocated_bytes() + 150'000;
    Trainer narrow(narrow_device, t.dataset, t.photos, t.start(), t.options);
    run_to(narrow, 6);
    EXPECT_EQ(narrow.resolution_divisor(), 4);
    run_to(roomy, 7);
    run_to(narrow, 7);
    EXPECT_EQ(roomy.resolution_divisor(), 2);
    EXPECT_EQ(narrow.resolution_divisor(), 1);
    run_to(narrow, 30);
    EXPECT_EQ(narrow.counters().bad_gradients, 0U);
}

/// A budget that holds everything but the mean: the training result is not lost because of it.
TEST(Limits, a_run_without_room_for_its_mean_ends_without) {
    TinyTraining t = tiny_training();
    t.options.densify_until = 0;
    Device roomy_device{device_options()}, narrow_device{device_options()};
    const ScopedVariants roomy_photos(roomy_device, "photos=resident");
    const ScopedVariants narrow_photos(narrow_device, "photos=resident");
    t.options.average_from = 0.5;
    Trainer roomy(roomy_device, t.dataset, t.photos, t.start(), t.options);
    run_to(roomy, 30);
    t.options.max_memory_bytes = roomy_device.allocated_bytes() + 1024;
    Trainer narrow(narrow_device, t.dataset, t.photos, t.start(), t.options);
    run_to(roomy, 59);
    run_to(narrow, 60);
    EXPECT_FALSE(roomy.mean_left_out());
    EXPECT_TRUE(narrow.mean_left_out());
    EXPECT_EQ(narrow.state().averaged, 0U);
    EXPECT_LE(narrow_device.peak_bytes(), t.options.max_memory_bytes);
    roomy.step();
    EXPECT_NE(roomy.model().position, narrow.model().position);
    EXPECT_EQ(roomy.state().moments, narrow.state().moments) << "the same training";
}

// The buffers of one that is resumed grow in other steps.
TEST(Limits, a_run_in_a_memory_budget_is_resumed_to_the_same_bits) {
    TinyTraining t = growing({.splats = 300});
    t.options.initial_scale = 4;  // the fullest frames are the first
    std::uint32_t unlimited = 0;
    t.options.max_memory_bytes = half_of_the_growth(t, unlimited);
    Device own{test::device_options()};
    Trainer whole(own, t.dataset, t.photos, t.start(), t.options);
    run_to(whole, 60);
    ASSERT_LT(whole.splat_count(), unlimited);
    ASSERT_GT(whole.stopped_by_memory(), 0U);
    expect_resumes(t, whole, {20, 35});
    shared_device().set_memory_budget(0);
}

TEST(Limits, growth_stops_before_the_intersections_that_the_bindings_hold) {
    TinyTraining t = growing({.width = 32, .height = 24, .splats = 300});
    t.options.sh_degree = 0;
    // Five windows of 640 intersections; of which one buffer holds 2,560 in the second.
    for (const auto& [fault, most, scale] :
         {std::tuple{"binding:20480", 3200U, 3.0f},
          std::tuple{"binding:20480,allocation:81920", 2560U, 2.0f}}) {
        SCOPED_TRACE(fault);
        t.options.initial_scale = scale;
        const std::unique_ptr<Device> narrow = faulty_device(fault);
        EXPECT_EQ(FrameBuffers::max_intersections(*narrow), most);
        Trainer trainer(*narrow, t.dataset, t.photos, t.start(), t.options);
        run_to(trainer, 60);
        EXPECT_GT(trainer.counters().most_intersections, most * 7 / 10);
        EXPECT_GT(trainer.stopped_by_intersections(), 300U);
        EXPECT_LE(trainer.splat_count(), trainer.stopped_by_intersections());
        EXPECT_GT(trainer.splat_count(), trainer.stopped_by_intersections() * 9 / 10)
            << "only splats that no view draws leave once growth has stopped";
    }
}

// The moments of the harmonics of degree 3 are one buffer, of 384 bytes a splat: 58 blocks of 8.
TEST(Limits, growth_stops_at_the_largest_buffer) {
    TinyTraining t = growing({.width = 32, .height = 24, .splats = 300});
    t.options.sh_degree = 3;
    const std::unique_ptr<Device> narrow = faulty_device("allocation:180000");
    Trainer trainer(*narrow, t.dataset, t.photos, t.start(), t.options);
    run_to(trainer, 60);
    EXPECT_EQ(trainer.splat_count(), 464U);
}

// Half more intersections than wanted exceed the device's memory: it gets only those that are
// wanted.
TEST(Limits, a_device_without_ample_room_for_the_backward_pass_gets_what_it_needs) {
    // One view wants more intersections than the first room of 1,024.
    TinyTraining t = tiny_training({.width = 320, .height = 200, .splats = 24, .close_up = 3});
    t.options.resolution_ramp = false;
    t.options.densify_until = 0;
    std::string backward;
    const auto intersections = [&](const std::string& fault, std::uint64_t& peak) {
        const std::unique_ptr<Device> device = faulty_device(fault);
        const ScopedVariants variants(*device, "backward=" + backward);
        Trainer trainer(*device, t.dataset, t.photos, t.start(), t.options);
        run_to(trainer, 10);
        trainer.drain();
        peak = device->peak_bytes();
        EXPECT_GT(trainer.counters().redone_iterations, 0U);
        return trainer.memory_demand().intersections;
    };
    for (const char* way : {"subgroup", "team", "buckets"}) {
        SCOPED_TRACE(way);
        backward = way;
        std::uint64_t peak = 0, within = 0;
        const std::uint64_t ample = intersections("", peak);
        EXPECT_LT(intersections(fmt::format("memory:{}", peak - 1), within), ample);
        EXPECT_LT(within, peak);
    }
}

TEST(Limits, a_budget_below_the_start_is_an_error_that_names_it) {
    TinyTraining t = tiny_training();
    t.options.max_memory_bytes = 100'000;
    try {
        t.trainer();
        ADD_FAILURE() << "no error";
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("--max-memory"), std::string::npos) << e.what();
    }
    shared_device().set_memory_budget(0);
}

}  // namespace
}  // namespace darb::test
