// SPDX-License-Identifier: MIT
// Measured depths in training: they bring depths closer, wait and shrink with their photos, and
// change no bit where they are off.
#include <fmt/format.h>

#include "engine/data/depths.h"
#include "engine/gpu/device_state.h"
#include "tests/support/measured_depths.h"
#include "tests/support/resumed_run.h"
#include "tests/support/scoped_variants.h"
#include "tests/support/test_device_options.h"
#include "trainer/step/memory_plan.h"

namespace darb::test {
namespace {

TinyTraining measured_training(const TinyOptions& tiny = {}) {
    TinyTraining t = tiny_training(tiny);
    add_measured_depths(tiny_truth(tiny), t, 1);
    t.options.depth = true;
    return t;
}

/// Mean error of depths over the held-out view, world units.
double depth_error(Trainer& trainer, const TinyTraining& t) {
    Renderer renderer(shared_device(), trainer.model());
    const View& view = t.dataset.views[0];
    renderer.render(view.camera);
    return compare_depth(renderer.render_depth(), load_depth(view), 1).value().mean_m;
}

TEST(DepthTraining, brings_the_depths_of_views_held_out_nearer) {
    TinyTraining t = measured_training();
    t.options.densify_until = 0;
    t.options.iterations = 100;
    double error[2];
    for (const bool on : {false, true}) {
        t.options.depth = on;
        t.options.depth_weight = 5;
        Trainer trainer = t.trainer();
        run_to(trainer, 100);
        error[on ? 1 : 0] = depth_error(trainer, t);
    }
    EXPECT_LT(error[1], 0.95 * error[0]) << error[0];
}

TEST(DepthTraining, off_it_changes_no_bit) {
    TinyTraining t = measured_training();
    t.options.depth = false;
    Trainer with = t.trainer();
    for (View& view : t.dataset.views) view.depth.clear();
    Trainer without = t.trainer();
    run_to(with, 30);
    run_to(without, 30);
    EXPECT_TRUE(same_state(with, without));
}

// Smaller photos at first, exposure in the same plane of the gradient, steps that are done again.
TEST(DepthTraining, waits_on_the_host_to_the_same_bits_and_takes_the_memory_that_is_planned) {
    TinyTraining t = measured_training({.width = 400, .height = 64, .splats = 24, .close_up = 3});
    t.options.exposure = true;
    std::vector<std::unique_ptr<Trainer>> trainers;
    for (const char* place : {"resident", "streamed"}) {
        const ScopedVariants variants(shared_device(), fmt::format("photos={}", place));
        trainers.push_back(
            std::make_unique<Trainer>(shared_device(), t.dataset, t.photos, t.start(), t.options));
        run_to(*trainers.back(), 30);
    }
    EXPECT_TRUE(trainers[1]->memory_demand().streams);
    EXPECT_TRUE(same_state(*trainers[0], *trainers[1]));
    t.options.depth = false;
    Trainer without = t.trainer();
    run_to(without, 30);
    EXPECT_FALSE(same_state(without, *trainers[0]));
}

TEST(DepthTraining, the_memory_is_what_the_plan_says_long) {
    const TinyTraining t = measured_training();
    Device device{device_options()};
    Trainer trainer(device, t.dataset, t.photos, t.start(), t.options);
    run_to(trainer, 30);
    trainer.drain();
    EXPECT_EQ(device.peak_bytes(), trainer.planned_bytes());
}

TEST(DepthTraining, in_batches_repeats_bit_by_bit_long) {
    TinyTraining t = measured_training();
    t.options.batch = 4;
    Trainer a = t.trainer(), b = t.trainer();
    run_to(a, 16);
    run_to(b, 16);
    EXPECT_TRUE(same_state(a, b));
    t.options.depth_weight = 0.5f;
    Trainer other = t.trainer();
    run_to(other, 16);
    EXPECT_FALSE(same_state(a, other));
}

}  // namespace
}  // namespace darb::test
