// SPDX-License-Identifier: MIT
// trainer/photos, forecast: photos that wait on the host give equal bits in training, and are used
// where memory requires it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "engine/gpu/device_state.h"
#include "tests/support/resumed_run.h"
#include "tests/support/scoped_variants.h"
#include "tests/support/test_device_options.h"
#include "tests/support/tiny_training.h"
#include "trainer/run/forecast.h"
#include "trainer/step/memory_plan.h"

namespace darb::test {
namespace {

Trainer made(const TinyTraining& t, const char* place) {
    const ScopedVariants variants(shared_device(), fmt::format("photos={}", place));
    return t.trainer();
}

testing::AssertionResult same_training(const TinyTraining& t, int iterations, Trainer& resident,
                                       Trainer& streamed) {
    EXPECT_FALSE(resident.memory_demand().streams);
    EXPECT_TRUE(streamed.memory_demand().streams);
    run_to(resident, iterations);
    run_to(streamed, iterations);
    EXPECT_EQ(evaluate_held_out(streamed, t.dataset, t.photos).psnr_db,
              evaluate_held_out(resident, t.dataset, t.photos).psnr_db);
    return same_state(resident, streamed);
}

testing::AssertionResult same_training(const TinyTraining& t, int iterations) {
    Trainer resident = made(t, "resident"), streamed = made(t, "streamed");
    return same_training(t, iterations, resident, streamed);
}

// Smaller photos at first, steps that are done again, photos that change their places for it.
TEST(StreamedPhotos, train_to_the_same_bits) {
    TinyTraining t = tiny_training({.width = 800, .height = 64, .splats = 24, .close_up = 3});
    t.dataset.alpha_is_mask = true;
    for (ImageU8& photo : t.photos)
        for (std::size_t p = 0; p < photo.data.size() / 8; ++p) photo.data[4 * p + 3] = 0;
    t.options.alpha = t.options.exposure = t.options.antialias = true;
    Trainer resident = made(t, "resident"), streamed = made(t, "streamed");
    EXPECT_GT(streamed.resolution_divisor(), 1);
    EXPECT_TRUE(same_training(t, 30, resident, streamed));
    EXPECT_EQ(streamed.resolution_divisor(), 1);
    EXPECT_GT(streamed.counters().redone_iterations, 0U);
}

TEST(StreamedPhotos, train_to_the_same_bits_in_batches) {
    TinyTraining t = tiny_training();
    t.options.batch = 4;
    EXPECT_TRUE(same_training(t, 16));
}

TEST(StreamedPhotos, train_to_the_same_bits_with_scores_of_the_error_long) {
    TinyTraining t = tiny_training();
    t.options.strategy = Strategy::budget;
    EXPECT_TRUE(same_training(t, 60));
}

// One photo to train on has no other that comes next.
TEST(StreamedPhotos, train_to_the_same_bits_where_there_is_one_long) {
    EXPECT_TRUE(same_training(tiny_training({.views = 2}), 10));
}

TEST(StreamedPhotos, a_loss_of_the_callers_sees_them_long) {
    TinyTraining t = tiny_training();
    for (const char* place : {"resident", "streamed"}) {
        Trainer trainer = made(t, place);
        int seen = 0;
        trainer.set_picture_gradient([&](const TrainingPicture& picture) {
            for (std::size_t v = 0; v < t.photos.size(); ++v)
                seen += t.dataset.views[v].name == picture.name &&
                        t.photos[v].data == picture.photo.data;
            return ImageF(picture.image.width, picture.image.height, 3);
        });
        run_to(trainer, 10);
        EXPECT_EQ(seen, trainer.resolution_divisor() == 1 ? 10 : 0) << place;
    }
}

// The budget holds everything but the photos. A device with its own memory asks how much the run
// needs in all: see below.
TEST(StreamedPhotos, stream_where_a_budget_does_not_hold_them) {
    if (!shared_device().info().unified_memory) GTEST_SKIP() << "the device shares no memory";
    TinyTraining t = tiny_training({.views = 20});
    t.options.densify_until = 0;
    Device device{test::device_options()};
    MemoryDemand start;
    add_photos(t.dataset.views, t.options, start);
    start.splats = 60;
    start.intersections = 1'024;
    start.densifies = false;
    const std::uint64_t all = plan_memory(device, start).total();
    t.options.max_memory_bytes = all;
    EXPECT_FALSE(photos_stream(device, t.dataset, t.options, start, 60));
    t.options.max_memory_bytes = all - 40'000;
    Trainer trainer(device, t.dataset, t.photos, t.start(), t.options);
    EXPECT_TRUE(trainer.memory_demand().streams);
    run_to(trainer, 10);
    trainer.drain();
    EXPECT_LE(device.peak_bytes(), *t.options.max_memory_bytes);
}

// The decisions for a device with its own memory, of a size close to what a run needs.
TEST(StreamedPhotos, stream_where_the_device_does_not_hold_what_the_run_comes_to) {
    TinyTraining t = tiny_training({.views = 20});
    Device device{test::device_options()};
    device.state().info.unified_memory = false;
    MemoryDemand photos;
    add_photos(t.dataset.views, t.options, photos);
    const auto stream_in = [&](std::uint64_t heap) {
        device.state().info.heap_bytes = heap;
        return photos_stream(device, t.dataset, t.options, photos, 60);
    };
    EXPECT_FALSE(stream_in(std::uint64_t{1} << 30));
    EXPECT_TRUE(stream_in(1'000));
    std::uint64_t least = 1'000;  // the largest heap that does not hold all
    for (std::uint64_t step = std::uint64_t{1} << 29; step > 0; step /= 2)
        if (stream_in(least + step)) least += step;
    device.state().info.heap_bytes = least;
    const Forecast f = forecast_training(device, t.dataset, t.options, false);
    EXPECT_TRUE(f.peak.streams);
    MemoryDemand resident = f.peak;
    resident.streams = false;
    const MemoryPlan with = plan_memory(device, f.peak), without = plan_memory(device, resident);
    EXPECT_NEAR(0.85 * static_cast<double>(least), static_cast<double>(without.total()),
                0.2 * static_cast<double>(without.total()));
    EXPECT_EQ(with.photos, 2 * 4 * photos.image_pixels);
    EXPECT_EQ(with.waiting_photos, without.photos + 4 * f.peak.small_pixels);
    // The start is refused by what it takes with photos that stream.
    MemoryDemand start = photos;
    start.splats = start.intersections = 60;
    start.densifies = false;
    start.streams = true;
    device.state().info.heap_bytes = plan_memory(device, start).total();
    EXPECT_NO_THROW(check_start_memory(device, t.dataset, t.options));
    device.state().info.heap_bytes -= 1'000;
    EXPECT_THROW(check_start_memory(device, t.dataset, t.options), Error);
    device.state().info.heap_bytes = std::uint64_t{1} << 30;
    EXPECT_THROW(check_start_memory(device, t.dataset, t.options, 1'000), Error);
}

}  // namespace
}  // namespace darb::test
