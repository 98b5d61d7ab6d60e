// SPDX-License-Identifier: MIT
// The two ways of an optimiser step from one view: inside project_backward.comp, and with gradients
// in buffers followed by adam_update.comp. For every kernel, each effect in training, and each rule
// besides Adam.
#include "engine/core/rng.h"
#include "engine/raster/adam.h"
#include "engine/raster/backward.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/loss.h"
#include "tests/support/backward_pass.h"
#include "tests/support/compare_arrays.h"
#include "tests/support/same_rounding.h"
#include "tests/support/test_lenses.h"
#include "tests/support/test_scene.h"
#include "trainer/step/exposure.h"

namespace darb::test {
namespace {

constexpr std::uint32_t kSplats = 60;

AdamStep rates() {
    return {.rate = {2e-3f, 5e-3f, 1e-3f, 0.025f, 2.5e-3f, 1.25e-4f}};
}

/// Gradients into buffers, then the classes that training uses, from and to the same state.
PassState step_from_buffers(const SplatModel& model, const Camera& camera, int degree,
                            const PassState& before, const Partials& partials, AdamStep step,
                            const ProjectionEffects& effects, const std::vector<float>& filters) {
    PassState poisoned = before;  // all of it must be written
    for (auto& values : poisoned.d) values.assign(values.size(), std::nanf(""));
    poisoned.gradient_sum.assign(model.size(), glm::vec2(std::nanf("")));
    const PassState stored = run_backward_pass(model, camera, degree, UPDATE_STORE, poisoned,
                                               partials, {}, effects, filters);
    Device& device = shared_device();
    GpuSplats splats(device, model, true, step.rest_every > 1);
    GradientBuffers gradients(device, splats);
    for (int a = 0; a < kAttributeCount; ++a) {
        if (before.moments[a].empty()) continue;
        splats.upload_moments(a, before.moments[a]);
        gradients.upload(a, stored.d[a]);
    }
    gradients.views().upload(stored.gradient_sum);
    if (step.rest_every > 1 && !before.rest_sum.empty()) splats.upload_rest_sum(before.rest_sum);
    Buffer status(device, "status", sizeof(gpu::FrameStatus)),
        sums(device, "sums", model.size() * 8);
    status.upload(std::vector{stored.status});
    sums.upload(before.gradient_sum);
    FrameView view{camera_data(camera, model.origin)};
    const Buffer cameras = upload_cameras(device, {view.camera});
    view.cameras = &cameras;
    const auto n = static_cast<float>(model.size());
    step.opacity_weight *= n;  // the class takes weights of means
    step.scale_weight *= 3 * n;
    step.flatness_weight *= n;
    AdamUpdate update(device);
    Commands commands(device);
    commands.begin();
    update.record(commands, splats, gradients, status, degree, step);
    update.record_fading(commands, splats, gradients, status, view, step.clearance);
    update.record_sums(commands, gradients, status, sums);
    commands.submit_and_wait();
    PassState after = before;
    const SplatModel moved = splats.download();
    for (int a = 0; a < kAttributeCount; ++a) {
        after.parameters[a] = attribute_values(moved, a);
        if (!after.moments[a].empty()) after.moments[a] = splats.download_moments(a);
    }
    if (step.rest_every > 1 && !after.rest_sum.empty()) after.rest_sum = splats.download_rest_sum();
    after.gradient_sum = sums.download<glm::vec2>(model.size());
    after.status = status.download<gpu::FrameStatus>(1)[0];
    return after;
}

/// Moves in units of the rate; moments and sums to a few roundings.
void expect_same(const PassState& before, const PassState& fused, const PassState& apart,
                 const AdamStep& step) {
    for (int a = 0; a < kAttributeCount; ++a) {
        std::vector<double> first, second;
        for (size_t i = 0; i < fused.parameters[a].size(); ++i) {
            const double x = fused.parameters[a][i], y = apart.parameters[a][i];
            const double rounding = std::abs(before.parameters[a][i]) * 0x1p-23;
            EXPECT_NEAR(x, y, 1e-5 * step.rate[static_cast<size_t>(a)] + rounding)
                << attribute_name(a) << " " << i;
        }
        if (fused.moments[a].empty()) continue;
        first.assign(fused.moments[a].begin(), fused.moments[a].end());
        second.assign(apart.moments[a].begin(), apart.moments[a].end());
        EXPECT_TRUE(compare(fmt::format("moments of {}", attribute_name(a)), first, second,
                            tolerance("adam_float32")));
    }
    EXPECT_TRUE(fused.rest_sum.empty() ||
                compare("sum of sh_rest",
                        std::vector<double>(fused.rest_sum.begin(), fused.rest_sum.end()),
                        std::vector<double>(apart.rest_sum.begin(), apart.rest_sum.end()),
                        tolerance("adam_float32")));
    for (size_t i = 0; i < fused.gradient_sum.size(); ++i) {
        EXPECT_FLOAT_EQ(fused.gradient_sum[i].x, apart.gradient_sum[i].x);
        EXPECT_EQ(fused.gradient_sum[i].y, apart.gradient_sum[i].y);
    }
    EXPECT_EQ(fused.status.bad_gradients, apart.status.bad_gradients);
}

/// A few steps, each from the state that the fused way left.
void compare_ways(TestScene scene, int degree, const AdamStep& plain, int steps = 3,
                  const ProjectionEffects& effects = {},
                  const std::vector<float>& filters = {0.0f}) {
    PassState state = start_state(scene.model);
    for (int t = 1; t <= steps; ++t) {
        SCOPED_TRACE(fmt::format("step {}", t));
        const Partials partials =
            Partials::random(scene.model.size(), 300 + static_cast<std::uint64_t>(t));
        for (int a = 0; a < kAttributeCount; ++a)
            attribute_values(scene.model, a) = state.parameters[a];
        const AdamStep step = adam_step(plain, t);
        const PassState fused = run_backward_pass(scene.model, scene.camera, degree, UPDATE_ADAM,
                                                  state, partials, step, effects, filters);
        const PassState apart = step_from_buffers(scene.model, scene.camera, degree, state,
                                                  partials, step, effects, filters);
        expect_same(state, fused, apart, step);
        EXPECT_NE(fused.parameters, state.parameters);
        state = fused;
    }
}

AdamStep rates_with_all_rules() {
    AdamStep step = rates();
    step.opacity_weight = 3e-4f;
    step.scale_weight = 2e-4f;
    step.largest_log_scale = -1.5f;
    step.clearance = 3;
    return step;
}

TEST(GradientStep, both_ways_shorten_the_same_axis) {
    AdamStep step = rates_with_all_rules();
    step.flatness_weight = 5e-3f;
    compare_ways(random_scene({.count = kSplats, .sh_degree = 1, .seed = 72}), 1, step);
}

// Footprints differ in the projection alone, which both ways share: exact for one kernel.
TEST(GradientStep, both_ways_agree_for_every_kernel) {
    const auto agree = [](int kernel, Footprint footprint) {
        SCOPED_TRACE(kernel_name(kernel));
        compare_ways(random_scene({.count = kSplats,
                                   .kernel = kernel,
                                   .footprint = footprint,
                                   .sh_degree = 1,
                                   .seed = 71}),
                     1, rates_with_all_rules(), 1);
    };
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel) agree(kernel, Footprint::psi);
    agree(KERNEL_RAISED_COSINE, Footprint::exact);
    agree(KERNEL_BETA, Footprint::psi);
}

TEST(GradientStep, both_ways_agree_with_each_effect) {
    const TestScene scene = random_scene({.count = kSplats, .sh_degree = 1, .seed = 72});
    std::vector<float> filters;
    for (std::uint32_t i = 0; i < kSplats; ++i)
        filters.push_back(0.01f * static_cast<float>(i % 7));
    for (const ProjectionEffects& effects :
         {ProjectionEffects{.off_centre = false}, ProjectionEffects{.antialias = true},
          ProjectionEffects{.antialias = true, .smoothing = true},
          ProjectionEffects{.near_care = false}}) {
        SCOPED_TRACE(fmt::format("off centre {}, antialias {}, smoothing {}, near {}",
                                 effects.off_centre, effects.antialias, effects.smoothing,
                                 effects.near_care));
        compare_ways(scene, 1, rates_with_all_rules(), 2, effects, filters);
    }
}

TEST(GradientStep, both_ways_agree_with_every_lens) {
    for (const auto& [name, lens] : test_lenses()) {
        SCOPED_TRACE(name);
        TestScene scene = random_scene({.count = kSplats, .sh_degree = 1, .seed = 79});
        scene.camera.lens = lens;
        compare_ways(scene, 1, rates_with_all_rules(), 1, {.lens = true});
    }
}

/// Splats, their step in either way and a map of colours for their one photo, on the device.
struct ExposedStep {
    ExposedStep(const TestScene& scene, const ForwardOptions& options, bool apart_)
        : apart(apart_),
          camera(scene.camera),
          buffers(shared_device(), options),
          forward(shared_device(), options),
          backward(shared_device(), options),
          loss(shared_device(), camera.width, camera.height),
          exposure(shared_device(), {1}, pixels()),
          update(shared_device()),
          splats(shared_device(), scene.model, true),
          gradients(shared_device(), splats),
          cameras(upload_cameras(shared_device(), {camera_data(camera, scene.model.origin)})),
          photo(shared_device(), "photo", pixels() * 4),
          d_image(shared_device(), "d_image", pixels() * 16),
          result(shared_device(), "loss", sizeof(gpu::LossResult)),
          view{camera_data(camera, scene.model.origin), &cameras, 0, 1,
               glm::vec3(0.1f, 0.5f, 0.9f)} {
        Pcg32 random(5, 6);
        std::vector<std::uint32_t> values(pixels());
        for (std::uint32_t& value : values) value = random.next() | 0xFF000000u;
        photo.upload(values);
        buffers.reserve(splats.count(), 20'000, camera.width, camera.height);
        backward.reserve(splats.count(), buffers.size().intersections,
                         buffers.frame().checkpoint_records());
    }
    std::uint32_t pixels() const {
        return static_cast<std::uint32_t>(camera.width) * static_cast<std::uint32_t>(camera.height);
    }

    void run(int t) {
        const AdamStep step = adam_step(rates_with_all_rules(), t);
        Frame& frame = buffers.frame();
        const Buffer& status = frame.counters.status;
        Commands commands(shared_device());
        commands.begin();
        forward.record(commands, splats, view, frame);
        const ExposedPicture picture{frame.images.image, frame.images.final_transmittance,
                                     view.background};
        exposure.record(commands, picture, 0, pixels());
        loss.record(commands, {exposure.mapped(), photo, d_image, result}, camera.width,
                    camera.height, view.background);
        const ExposureStep exposed{0, pixels(), 0.01f, t};
        exposure.record_backward(commands, picture, d_image, exposed);
        exposure.record_step(commands, status, exposed);
        if (apart) {
            backward.record_gradients(commands, view, frame, splats, d_image, {gradients});
            update.record(commands, splats, gradients, status, 1, step);
            update.record_fading(commands, splats, gradients, status, view, step.clearance);
            update.record_sums(commands, gradients, status, backward.gradient_sum());
        } else {
            backward.record(commands, view, frame, splats, d_image, step);
        }
        commands.submit_and_wait();
        ASSERT_EQ(frame.read_status().overflow, 0U);
    }
    PassState state() {
        PassState s;
        const SplatModel model = splats.download();
        for (int a = 0; a < kAttributeCount; ++a) {
            s.parameters[a] = attribute_values(model, a);
            s.moments[a] = splats.download_moments(a);
        }
        s.gradient_sum = backward.gradient_sum().download<glm::vec2>(splats.count());
        s.status = buffers.frame().read_status();
        return s;
    }
    void copy_from(ExposedStep& other) {
        const PassState s = other.state();
        for (int a = 0; a < kAttributeCount; ++a) {
            upload_rows(splats.parameters(a), splats.rows(a), s.parameters[a]);
            splats.upload_moments(a, s.moments[a]);
        }
        backward.gradient_sum().upload(s.gradient_sum);
        exposure.restore(other.exposure.state());
    }

    bool apart;
    Camera camera;
    FrameBuffers buffers;
    Forward forward;
    Backward backward;
    Loss loss;
    Exposure exposure;
    AdamUpdate update;
    GpuSplats splats;
    GradientBuffers gradients;
    Buffer cameras, photo, d_image, result;
    FrameView view;
};

// The map's own step comes between the loss and the gradients of splats, before either way.
TEST(GradientStep, both_ways_agree_with_exposure_and_a_lens) {
    TestScene scene = random_scene({.count = kSplats, .sh_degree = 1, .seed = 80});
    scene.camera.lens = test_lenses().front().second;
    ForwardOptions options;
    options.store_for_backward = options.alpha_gradient = true;
    options.effects.lens = true;
    ExposedStep fused(scene, options, false), apart(scene, options, true);
    const std::vector<float> untouched = fused.exposure.state();
    for (int t = 1; t <= 3; ++t) {
        SCOPED_TRACE(fmt::format("step {}", t));
        const PassState before = fused.state();
        apart.copy_from(fused);
        fused.run(t);
        apart.run(t);
        expect_same(before, fused.state(), apart.state(), adam_step(rates_with_all_rules(), t));
        EXPECT_NE(fused.state().parameters, before.parameters);
        EXPECT_EQ(fused.exposure.state(), apart.exposure.state());
        EXPECT_NE(fused.exposure.state(), untouched);
    }
}

TEST(GradientStep, both_ways_agree_when_harmonics_step_every_third_time) {
    AdamStep step = rates_with_all_rules();
    step.rest_every = 3;
    compare_ways(random_scene({.count = kSplats, .seed = 73}), 3, step, 6);
}

TEST(GradientStep, both_ways_agree_at_every_degree_stored_and_used) {
    for (int stored = 0; stored <= 3; ++stored)
        for (int used = 0; used <= stored; used += 2) {
            SCOPED_TRACE(fmt::format("stored {}, used {}", stored, used));
            compare_ways(random_scene({.count = kSplats, .sh_degree = stored, .seed = 74}), used,
                         rates(), 1);
        }
}

TEST(GradientStep, both_ways_regularise_what_no_view_shows) {
    AdamStep step = rates_with_all_rules();
    step.regularise_unseen = true;
    compare_ways(random_scene({.count = kSplats, .sh_degree = 0, .seed = 75}), 0, step, 2);
}

TEST(GradientStep, both_ways_leave_a_splat_whose_gradient_is_not_finite) {
    const TestScene scene = random_scene({.count = kSplats, .sh_degree = 1, .seed = 76});
    Partials partials = Partials::random(kSplats, 9);
    ASSERT_GT(partials.count[3], 0U);
    partials.intersections[partials.begin[3]][5] = std::nanf("");
    const PassState start = start_state(scene.model);
    const AdamStep step = adam_step(rates_with_all_rules(), 1);
    const PassState fused =
        run_backward_pass(scene.model, scene.camera, 1, UPDATE_ADAM, start, partials, step);
    const PassState apart =
        step_from_buffers(scene.model, scene.camera, 1, start, partials, step, {}, {0.0f});
    EXPECT_EQ(apart.status.bad_gradients, 1U);
    expect_same(start, fused, apart, step);
    for (size_t c = 9; c < 12; ++c)
        EXPECT_EQ(apart.parameters[kPosition][c], start.parameters[kPosition][c]);
}

std::vector<float> added(std::vector<float> a, const std::vector<float>& b) {
    for (size_t i = 0; i < a.size(); ++i) a[i] += b[i];
    return a;
}

TEST(GradientStep, views_add_up_and_a_bad_one_stays_bad) {
    const TestScene scene = random_scene({.count = kSplats, .sh_degree = 1, .seed = 77});
    const Partials first = Partials::random(kSplats, 10);
    Partials second = Partials::random(kSplats, 11), bad = second;
    bad.intersections[bad.begin[3]][5] = std::nanf("");
    const auto pass = [&](int update, const PassState& before, const Partials& partials) {
        return run_backward_pass(scene.model, scene.camera, 1, update, before, partials);
    };
    const PassState start = start_state(scene.model);
    const PassState one = pass(UPDATE_STORE, start, first), two = pass(UPDATE_STORE, start, second);
    const PassState sum = pass(UPDATE_ADD, one, second);
    for (int a = 0; a < kAttributeCount; ++a)
        EXPECT_TRUE(same_but_for_fusing(sum.d[a], added(one.d[a], two.d[a]), 1e-6))
            << attribute_name(a);
    for (size_t i = 0; i < kSplats; ++i)
        EXPECT_EQ(sum.gradient_sum[i], one.gradient_sum[i] + two.gradient_sum[i]) << i;
    const PassState spoilt = pass(UPDATE_ADD, pass(UPDATE_ADD, one, bad), second);
    EXPECT_LT(spoilt.gradient_sum[3].y, 0);
    EXPECT_EQ(spoilt.status.bad_gradients, 1U);
    for (size_t i = 0; i < kSplats; ++i) EXPECT_EQ(spoilt.gradient_sum[i].y < 0, i == 3) << i;
}

TEST(GradientStep, an_overflowed_frame_changes_nothing) {
    const TestScene scene = random_scene({.count = 10, .sh_degree = 1, .seed = 78});
    PassState start = start_state(scene.model);
    start.status.overflow = 1;
    start.gradient_sum.assign(10, glm::vec2(3, 2));
    for (auto& d : start.d) d.assign(d.size(), 0.5f);
    const Partials partials = Partials::random(10, 12);
    for (const int update : {UPDATE_STORE, UPDATE_ADD})
        EXPECT_EQ(run_backward_pass(scene.model, scene.camera, 1, update, start, partials), start);
    Device& device = shared_device();
    GpuSplats splats(device, scene.model, true);
    GradientBuffers gradients(device, splats);
    for (int a = 0; a < kAttributeCount; ++a) gradients.upload(a, start.d[a]);
    gradients.views().upload(start.gradient_sum);
    Buffer status(device, "status", sizeof(gpu::FrameStatus)), sums(device, "sums", 80);
    status.upload(std::vector{start.status});
    sums.upload(start.gradient_sum);
    FrameView view{camera_data(scene.camera, {})};
    const Buffer cameras = upload_cameras(device, {view.camera});
    view.cameras = &cameras;
    AdamUpdate update(device);
    Commands commands(device);
    commands.begin();
    update.record(commands, splats, gradients, status, 1, adam_step(rates(), 1));
    update.record_fading(commands, splats, gradients, status, view, 100);
    update.record_sums(commands, gradients, status, sums);
    commands.submit_and_wait();
    const SplatModel after = splats.download();
    for (int a = 0; a < kAttributeCount; ++a)
        EXPECT_EQ(attribute_values(after, a), attribute_values(scene.model, a));
    EXPECT_EQ(sums.download<glm::vec2>(10), start.gradient_sum);
}

}  // namespace
}  // namespace darb::test
