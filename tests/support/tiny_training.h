// SPDX-License-Identifier: MIT
// A data set of a few small photos, rendered from random splats on the device, and options under
// which a few dozen iterations go through every part of training.
#pragma once

#include <cmath>

#include "engine/core/rng.h"
#include "engine/render/renderer.h"
#include "tests/support/shared_device.h"
#include "tests/support/test_scene.h"
#include "trainer/growth/initial_model.h"
#include "trainer/run/run_report.h"
#include "trainer/step/trainer.h"

namespace darb::test {

struct TinyTraining {
    Dataset dataset;
    std::vector<ImageU8> photos;
    TrainOptions options;

    SplatModel start() const { return initial_model(dataset, options); }
    Trainer trainer() const { return Trainer(shared_device(), dataset, photos, start(), options); }
};

struct TinyOptions {
    int views = 6, width = 64, height = 48;
    size_t splats = 60;
    double close_up = 1;  // focal length of the third view, as a multiple of that of the others
};

inline ImageU8 with_alpha(const ImageU8& rgb) {
    ImageU8 rgba(rgb.width, rgb.height, 4);
    for (size_t p = 0; p < rgb.data.size() / 3; ++p) {
        for (size_t c = 0; c < 3; ++c) rgba.data[p * 4 + c] = rgb.data[p * 3 + c];
        rgba.data[p * 4 + 3] = 255;
    }
    return rgba;
}

/// Cameras on a ring around random splats, whose centres are the point cloud.
inline TinyTraining tiny_training(const TinyOptions& tiny = {}) {
    const TestScene truth = random_scene({.count = tiny.splats,
                                          .width = tiny.width,
                                          .height = tiny.height,
                                          .sh_degree = 0,
                                          .min_log_scale = -2.5,
                                          .max_log_scale = -1.5,
                                          .seed = 91});
    TinyTraining t;
    t.dataset.root = "tiny";
    Renderer renderer(shared_device(), truth.model);
    for (int v = 0; v < tiny.views; ++v) {
        const double half_turn = 3.14159265358979 * v / tiny.views;  // half the angle on the ring
        View view;
        view.name = fmt::format("view_{}", v);
        view.camera = truth.camera;
        view.camera.width += v % 3 * 5;  // photos of different sizes
        view.camera.height += v % 2 * 9;
        view.camera.rotation = rotation_of(std::cos(half_turn), 0, std::sin(half_turn), 0);
        view.camera.translation = {0, 0, 3.2};
        if (v == 2) view.camera.fx *= tiny.close_up, view.camera.fy *= tiny.close_up;
        view.lens.parameters = {view.camera.fx, view.camera.fy, view.camera.cx, view.camera.cy};
        view.is_test = v == 0;
        t.photos.push_back(with_alpha(to_8bit(renderer.render(view.camera))));
        t.dataset.views.push_back(view);
    }
    Pcg32 rng(92);
    for (size_t i = 0; i < truth.model.size() * 3; ++i) {
        t.dataset.points.position.push_back(truth.model.position[i] + 0.05 * rng.normal());
        t.dataset.points.colour.push_back(static_cast<std::uint8_t>(rng.below(256)));
    }
    TrainOptions& o = t.options;
    o.iterations = 60;
    o.speed_up_short_runs = false;
    o.seed = 5;
    o.kernel = KERNEL_RAISED_COSINE;
    o.sh_degree = 2;
    o.sh_interval = 20;
    o.densify_from = 10;
    o.densify_until = 50;
    o.densify_interval = 10;
    o.densify_grad_threshold = 2e-5f;
    o.opacity_reset_interval = 25;
    o.random_background = false;  // the photos show it
    o.initial_opacity = o.prune_opacity = 0.3f;
    return t;
}

/// Everything that training changes, for comparison bit by bit.
inline testing::AssertionResult same_state(Trainer& a, Trainer& b) {
    const Trainer::State one = a.state(), two = b.state();
    if (one.iteration != two.iteration || one.model.size() != two.model.size())
        return testing::AssertionFailure()
               << fmt::format("iteration {} with {} splats, iteration {} with {}", one.iteration,
                              one.model.size(), two.iteration, two.model.size());
    for (int attribute = 0; attribute < kAttributeCount; ++attribute) {
        const std::vector<float>& x = attribute_values(one.model, attribute);
        const std::vector<float>& y = attribute_values(two.model, attribute);
        for (size_t i = 0; i < x.size(); ++i)
            if (std::memcmp(&x[i], &y[i], sizeof(float)) != 0)
                return testing::AssertionFailure() << fmt::format(
                           "{}[{}]: {} and {}", attribute_name(attribute), i, x[i], y[i]);
        if (one.moments[attribute] != two.moments[attribute])
            return testing::AssertionFailure() << "moments of " << attribute_name(attribute);
    }
    if (one.rest_sum != two.rest_sum) return testing::AssertionFailure() << "sums of harmonics";
    if (one.averaged != two.averaged || one.mean != two.mean)
        return testing::AssertionFailure() << "means";
    if (one.profile != two.profile || one.model.kernel != two.model.kernel)
        return testing::AssertionFailure() << "profiles";
    if (one.cameras != two.cameras) return testing::AssertionFailure() << "cameras";
    if (one.gradient_sum != two.gradient_sum) return testing::AssertionFailure() << "gradient sums";
    return testing::AssertionSuccess();
}

}  // namespace darb::test
