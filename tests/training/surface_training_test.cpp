// SPDX-License-Identifier: MIT
// Training with the terms that lay splats on surfaces: what they bring, when they begin, and that
// they repeat, alone, in batches and beside measured depths.
#include <algorithm>
#include <array>
#include <cmath>

#include "engine/gpu/device_state.h"
#include "engine/reference/reference_render.h"
#include "tests/support/measured_depths.h"
#include "tests/support/resumed_run.h"
#include "tests/support/scoped_variants.h"
#include "tests/support/test_device_options.h"

namespace darb::test {
namespace {

TinyTraining surface_training(float distortion, float flatness) {
    TinyTraining t = tiny_training();
    t.options.surface = distortion > 0 || flatness > 0;
    t.options.distortion_weight = distortion;
    t.options.flatness_weight = flatness;
    t.options.densify_until = 0;
    return t;
}

/// Mean over pixels that are covered of the standard deviation of depths, over their mean.
double spread(Trainer& trainer, const TinyTraining& t) {
    const auto r = reference::render(trainer.model(), t.dataset.views[0].camera, {});
    double sum = 0, count = 0;
    for (size_t p = 0; p < r.images.depth.data.size(); ++p) {
        const double cover = 1 - r.images.transmittance.data[p];
        if (cover < 0.5) continue;
        const double mean = r.images.depth.data[p] / cover;
        sum += std::sqrt(std::max(0.0, r.images.square.data[p] / cover - mean * mean)) / mean;
        ++count;
    }
    return sum / count;
}

/// Mean of the smallest scales over that of the middle ones.
double thickness(Trainer& trainer) {
    const SplatModel model = trainer.model();
    double least = 0, middle = 0;
    for (size_t i = 0; i < model.size(); ++i) {
        std::array<float, 3> s{model.log_scale[3 * i], model.log_scale[3 * i + 1],
                               model.log_scale[3 * i + 2]};
        std::ranges::sort(s);
        least += std::exp(double(s[0]));
        middle += std::exp(double(s[1]));
    }
    return least / middle;
}

TEST(SurfaceTraining, the_distortion_brings_the_splats_of_a_pixel_together) {
    double before = 0;
    for (const float weight : {0.0f, 0.5f}) {
        const TinyTraining t = surface_training(weight, 0);
        Trainer trainer = t.trainer();
        run_to(trainer, 60);
        const double now = spread(trainer, t);
        if (weight > 0) {
            EXPECT_LT(now, 0.95 * before) << before;
        }
        before = now;
    }
}

TEST(SurfaceTraining, flatness_makes_splats_flat) {
    double before = 0;
    for (const float weight : {0.0f, 20.0f}) {
        const TinyTraining t = surface_training(0, weight);
        Trainer trainer = t.trainer();
        run_to(trainer, 60);
        const double now = thickness(trainer);
        if (weight > 0) {
            EXPECT_LT(now, 0.9 * before) << before;
        }
        before = now;
    }
}

TEST(SurfaceTraining, begins_at_its_share_of_the_run_and_changes_no_bit_before) {
    const TinyTraining with = surface_training(1, 1), without = surface_training(0, 0);
    Trainer a = with.trainer(), b = without.trainer();
    run_to(a, 30);
    run_to(b, 30);
    EXPECT_TRUE(same_state(a, b));
    run_to(a, 31);
    run_to(b, 31);
    EXPECT_FALSE(same_state(a, b));
}

TEST(SurfaceTraining, beside_measured_depths_in_batches_it_repeats_bit_by_bit) {
    TinyTraining t = surface_training(1, 1);
    add_measured_depths(tiny_truth(), t, 1);
    t.options.depth = true;
    t.options.batch = 4;
    t.options.surface_from = 0.1f;
    Trainer a = t.trainer(), b = t.trainer();
    run_to(a, 16);
    run_to(b, 16);
    EXPECT_TRUE(same_state(a, b));
    for (const auto& change :
         std::vector<void (*)(TrainOptions&)>{[](TrainOptions& o) { o.depth_weight = 0.5f; },
                                              [](TrainOptions& o) { o.distortion_weight = 2; },
                                              [](TrainOptions& o) { o.flatness_weight = 2; }}) {
        TinyTraining other = t;
        change(other.options);
        Trainer c = other.trainer();
        run_to(c, 16);
        EXPECT_FALSE(same_state(a, c));
    }
}

TEST(SurfaceTraining, takes_the_memory_that_is_planned_by_every_way_back) {
    for (const char* way : {"subgroup", "buckets", "team"}) {
        SCOPED_TRACE(way);
        const TinyTraining t = surface_training(1, 1);
        Device device{device_options()};
        const ScopedVariants variants(device, fmt::format("backward={}", way));
        Trainer trainer(device, t.dataset, t.photos, t.start(), t.options);
        run_to(trainer, 40);
        trainer.drain();
        EXPECT_EQ(device.peak_bytes(), trainer.planned_bytes());
    }
}

}  // namespace
}  // namespace darb::test
