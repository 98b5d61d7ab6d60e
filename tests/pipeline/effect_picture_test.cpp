// SPDX-License-Identifier: MIT
// Each effect on a scene that needs it and on one that does not: the plan is right for both, the
// picture with auto equals that with all effects, and without the effect the first scene's picture
// changes.
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "engine/plan/effect_plan.h"
#include "engine/render/renderer.h"
#include "tests/support/compare_arrays.h"
#include "tests/support/same_rounding.h"
#include "tests/support/shared_device.h"
#include "tests/support/test_device_options.h"
#include "tests/support/test_lenses.h"
#include "tests/support/test_scene.h"
#include "tests/support/tiny_training.h"

namespace darb::test {
namespace {

/// Small matte splats before a centred pinhole: calls for nothing.
struct Scene {
    SplatModel model;
    std::vector<View> views{1};
    Scene() {
        const TestScene s = random_scene({.count = 300,
                                          .width = 120,
                                          .height = 80,
                                          .sh_degree = 3,
                                          .min_log_scale = -4,
                                          .max_log_scale = -2.5});
        model = s.model;
        model.sh_rest.assign(model.sh_rest.size(), 0.0f);
        for (size_t i = 0; i < model.size() * 3; ++i)  // all in view, none at its border
            model.position[i] *= 0.4f;
        Camera& c = views[0].camera;
        c = s.camera;
        c.cx = 0.5 * c.width;
        c.cy = 0.5 * c.height;
        views[0].lens.parameters = {c.fx, c.fy, c.cx, c.cy};
    }
    Camera& camera() { return views[0].camera; }
};

struct Drawn {
    EffectPlan plan;
    ImageF picture;
    bool cooperates = false;
};

Drawn draw(const Scene& scene, const char* effects) {
    Drawn drawn;
    drawn.plan = plan_rendering(scene.model, scene.views, {}, parse_effects(effects));
    SplatModel model = scene.model;
    std::vector<View> views = scene.views;
    apply_plan(drawn.plan, model);
    apply_plan(drawn.plan, views);
    Renderer renderer(shared_device(), model, Accuracy{}, drawn.plan.projection(),
                      drawn.plan.huge_splat_path());
    for (int frame = 0; frame < 2; ++frame) {  // the counters of the first decide on the second
        drawn.picture = renderer.render(views[0].camera);
        drawn.plan.note_frame(renderer.status().huge_splats, renderer.status().longest_list);
    }
    return drawn;
}

void expect_another_picture(const ImageF& a, const ImageF& b) {
    double largest = 0;
    for (size_t i = 0; i < a.data.size(); ++i)
        largest = std::max(largest, double{std::abs(a.data[i] - b.data[i])});
    EXPECT_GT(largest, 0.01) << "the scene is meant to need the effect";
}

using Change = void (*)(Scene&);

/// needs: makes the plain scene need the effect.
void expect_right_on_both(int effect, Change needs) {
    SCOPED_TRACE(effect_name(effect));
    const std::string without = fmt::format("auto,-{}", effect_name(effect));
    const Scene plain;
    const Drawn off = draw(plain, "auto");
    EXPECT_FALSE(off.plan.on(effect));
    EXPECT_TRUE(same_but_for_fusing(off.picture.data, draw(plain, "all").picture.data, 1e-5));

    Scene scene;
    needs(scene);
    const Drawn on = draw(scene, "auto");
    for (int e = 0; e < EFFECT_COUNT; ++e)
        EXPECT_EQ(on.plan.on(e), e == effect) << effect_name(e) << ": " << on.plan.row(e).reason;
    EXPECT_TRUE(same_but_for_fusing(on.picture.data, draw(scene, "all").picture.data, 1e-5));
    if (effect == EFFECT_HUGE)  // how intersections are written changes no picture
        EXPECT_EQ(on.picture.data, draw(scene, without.c_str()).picture.data);
    else
        expect_another_picture(on.picture, draw(scene, without.c_str()).picture);
}

TEST(EffectPicture, view_dependent_colour) {
    expect_right_on_both(EFFECT_VIEW_COLOUR, [](Scene& s) {
        for (size_t i = 0; i < s.model.sh_rest.size(); ++i)
            s.model.sh_rest[i] = i % 2 == 0 ? 0.2f : -0.2f;
    });
}

TEST(EffectPicture, antialias) {
    expect_right_on_both(EFFECT_ANTIALIAS, [](Scene& s) { s.model.antialias = true; });
}

TEST(EffectPicture, off_centre) {
    expect_right_on_both(EFFECT_OFF_CENTRE, [](Scene& s) { s.camera().cx += 3.5; });
}

TEST(EffectPicture, lens) {
    expect_right_on_both(EFFECT_LENS, [](Scene& s) {
        s.camera().lens = test_lenses()[2].second;
        s.camera().lens.ray_min = glm::dvec2(-2);  // every splat well within the picture
        s.camera().lens.ray_max = glm::dvec2(2);
    });
}

TEST(EffectPicture, shutter) {
    expect_right_on_both(EFFECT_SHUTTER, [](Scene& s) {
        s.camera().shutter = {true, {0.02, -0.03, 0.02}, {0.03, 0.02, -0.03}};
    });
}

TEST(EffectPicture, huge_splats_and_long_lists) {
    expect_right_on_both(EFFECT_HUGE, [](Scene& s) {
        Camera& c = s.camera();  // more tiles, and a few splats over all of them
        c.width = c.width * 4;
        c.height = c.height * 4;
        c.cx *= 4, c.cy *= 4, c.fx *= 4, c.fy *= 4;
        s.views[0].lens.parameters = {c.fx, c.fy, c.cx, c.cy};
        for (size_t i = 0; i < 9; ++i) s.model.log_scale[i] = 1.5f;
    });
}

// A large splat to the left of the camera, hardly before it: its affine picture without the clamp
// is a fan from the left border across the whole picture.
TEST(EffectPicture, near_plane) {
    expect_right_on_both(EFFECT_NEAR, [](Scene& s) {
        const Camera& c = s.camera();
        const glm::dvec3 at =
            glm::transpose(c.rotation) * (glm::dvec3(-1.2, 0, 0.35) - c.translation);
        for (size_t k = 0; k < 3; ++k) {
            s.model.position[k] = static_cast<float>(at[static_cast<int>(k)]);
            s.model.log_scale[k] = -1.2f;
            s.model.sh_dc[k] = 2;
        }
        s.model.opacity_logit[0] = 4;
    });
}

TEST(EffectPicture, a_depth_image_leaves_the_picture_alone) {
    const Scene scene;
    for (const char* effects : {"auto", "all", "none"}) {  // the output asks, nothing else does
        const EffectChoice choice = parse_effects(effects);
        EXPECT_FALSE(plan_rendering(scene.model, scene.views, {}, choice).on(EFFECT_DEPTH));
    }
    EXPECT_TRUE(plan_rendering(scene.model, scene.views, {.depth = true}).on(EFFECT_DEPTH));
    Renderer renderer(shared_device(), scene.model);
    const ImageF before = renderer.render(scene.views[0].camera);
    for (const PassTime& pass : renderer.pass_times())
        EXPECT_NE(pass.name, "depth") << "nobody asked for it";
    const ImageF depth = renderer.render_depth();
    EXPECT_EQ(renderer.pass_times()[0].name, "depth");
    EXPECT_GT(*std::max_element(depth.data.begin(), depth.data.end()), 1) << "the scene's depth";
    EXPECT_EQ(renderer.render(scene.views[0].camera).data, before.data);
}

TEST(EffectMemory, frames_hold_no_buffer_of_an_effect_that_is_off) {
    const Scene scene;
    const auto bytes = [&](const char* effects) {
        Device device{test::device_options()};
        const EffectPlan plan =
            plan_rendering(scene.model, scene.views, {}, parse_effects(effects));
        SplatModel model = scene.model;
        apply_plan(plan, model);
        Renderer renderer(device, model, Accuracy{}, plan.projection(), plan.huge_splat_path());
        renderer.render(scene.views[0].camera);
        return device.peak_bytes();
    };
    const std::uint64_t none = bytes("none"), automatic = bytes("auto");
    EXPECT_EQ(none, automatic) << "the scene calls for nothing";
    const size_t unused = 64;  // at most, that stand in for a buffer that is off
    EXPECT_GE(bytes("+sh") + unused, automatic + scene.model.sh_rest.size() * sizeof(float));
    const size_t pixels = 120 * 80;  // the state of long lists, and the huge splats' list
    EXPECT_GE(bytes("+huge") + unused, automatic + pixels * 4);
}

TrainOptions plain_options() {
    TrainOptions options;
    options.iterations = 400;
    options.densify_until = 0;
    options.sh_degree = 0;
    options.random_background = options.resolution_ramp = false;
    return options;
}

/// bytes, passes: what the run took of the device, and the names of its passes.
std::vector<float> trained(const TinyTraining& t, const TrainOptions& options, int steps,
                           std::uint64_t* bytes = nullptr,
                           std::set<std::string>* passes = nullptr) {
    Device device{test::device_options()};
    Trainer trainer(device, t.dataset, t.photos, t.start(), options);
    for (int i = 0; i < steps; ++i) trainer.step();
    trainer.drain();
    if (bytes) *bytes = device.peak_bytes();
    for (const PassTotal& pass : trainer.pass_totals())
        if (passes) passes->insert(pass.name);
    const SplatModel model = trainer.state().model;
    std::vector<float> values;
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<float>& from = attribute_values(model, a);
        values.insert(values.end(), from.begin(), from.end());
    }
    return values;
}

// A step has the sign of a gradient, however small that is.
testing::AssertionResult same_training(const std::vector<float>& a, const std::vector<float>& b) {
    return same_but_for_fusing(a, b, 0.05);
}

/// Every photo sees every point.
void see_all_points(Dataset& dataset) {
    const auto views = static_cast<std::uint32_t>(dataset.views.size());
    dataset.points.seen_begin.push_back(0);
    for (size_t p = 0; p < dataset.points.size(); ++p) {
        for (std::uint32_t v = 0; v < views; ++v) dataset.points.seen_by.push_back(v);
        dataset.points.seen_begin.push_back(dataset.points.seen_by.size());
    }
}

TEST(EffectTraining, alpha_of_opaque_photos_is_an_identity_and_of_others_is_needed) {
    TinyTraining t = tiny_training();
    TrainOptions on = plain_options(), off = on;
    off.alpha = false;
    EXPECT_TRUE(same_training(trained(t, on, 5), trained(t, off, 5))) << "opaque photos";
    for (ImageU8& photo : t.photos)
        for (size_t i = 3; i < photo.data.size(); i += 8) photo.data[i] = 0;
    EXPECT_NE(trained(t, on, 5), trained(t, off, 5));
    Dataset& d = t.dataset;
    EXPECT_FALSE(plan_training(d, t.photos, 0).on(EFFECT_ALPHA)) << "no channel, no effect";
    d.has_alpha = true;
    EXPECT_TRUE(plan_training(d, t.photos, 0).on(EFFECT_ALPHA));
    for (ImageU8& photo : t.photos)
        for (size_t i = 3; i < photo.data.size(); i += 4) photo.data[i] = 255;
    EXPECT_FALSE(plan_training(d, t.photos, 0).on(EFFECT_ALPHA)) << "opaque everywhere";
}

TEST(EffectTraining, exposure_is_planned_for_gains_and_begins_as_an_identity) {
    TinyTraining t = tiny_training();
    see_all_points(t.dataset);
    EXPECT_FALSE(plan_training(t.dataset, t.photos, 0).on(EFFECT_EXPOSURE))
        << plan_training(t.dataset, t.photos, 0).row(EFFECT_EXPOSURE).reason;
    TinyTraining gains = t;
    for (size_t v = 0; v < gains.photos.size(); ++v)
        for (size_t i = 0; i < gains.photos[v].data.size(); ++i)
            if (i % 4 != 3)
                gains.photos[v].data[i] =
                    static_cast<std::uint8_t>(gains.photos[v].data[i] * (v % 2 == 0 ? 1.0 : 0.6));
    EXPECT_TRUE(plan_training(gains.dataset, gains.photos, 0).on(EFFECT_EXPOSURE))
        << plan_training(gains.dataset, gains.photos, 0).row(EFFECT_EXPOSURE).reason;
    TrainOptions on = plain_options();
    on.exposure = true;
    std::uint64_t with = 0, without = 0;
    std::set<std::string> passes_with, passes_without;
    EXPECT_EQ(trained(t, on, 1, &with, &passes_with),
              trained(t, plain_options(), 1, &without, &passes_without));
    EXPECT_GE(with, without + 64 * 48 * 12) << "the mapped picture";
    EXPECT_TRUE(passes_with.contains("exposure"));
    EXPECT_FALSE(passes_without.contains("exposure"));
}

// Cameras with their principal point in the middle and without lens: five steps, gradients and all.
TEST(EffectTraining, centred_pinholes_train_alike_with_off_centre_and_lens_compiled_in) {
    TinyTraining t = tiny_training();
    for (View& view : t.dataset.views) {
        view.camera.cx = 0.5 * view.camera.width;
        view.camera.cy = 0.5 * view.camera.height;
    }
    EXPECT_FALSE(plan_training(t.dataset, t.photos, 0).projection().off_centre);
    EXPECT_FALSE(plan_training(t.dataset, t.photos, 0).projection().lens);
    TrainOptions plain = plain_options(), both = plain;
    plain.projection.off_centre = false;
    both.projection.lens = true;
    EXPECT_TRUE(same_training(trained(t, both, 5), trained(t, plain, 5)));
    t.dataset.views[2].camera.cx += 3;
    EXPECT_TRUE(plan_training(t.dataset, t.photos, 0).on(EFFECT_OFF_CENTRE));
}

// With the effect off, gradients are rounded differently; what must be identical is the picture.
TEST(EffectTraining, near_plane_care_is_always_on_as_splats_move) {
    TinyTraining t = tiny_training();
    for (View& view : t.dataset.views) {  // wide enough for every splat to be in view
        view.camera.fx *= 0.5;
        view.camera.fy *= 0.5;
    }
    const EffectPlan plan = plan_rendering(t.start(), t.dataset.views, {});
    EXPECT_FALSE(plan.on(EFFECT_NEAR)) << plan.row(EFFECT_NEAR).reason;
    EXPECT_TRUE(plan_training(t.dataset, t.photos, 0).on(EFFECT_NEAR));
}

TEST(EffectTraining, cooperation_and_segments_change_no_bit) {
    const TinyTraining t = tiny_training({.width = 640, .height = 480});
    TrainOptions always = plain_options(), never = always;
    always.huge_splat_path = HugeSplatPath::always;
    never.huge_splat_path = HugeSplatPath::never;
    EXPECT_EQ(trained(t, always, 3), trained(t, never, 3));
    Device device{test::device_options()};
    Trainer trainer(device, t.dataset, t.photos, t.start(), plain_options());
    trainer.step();
    trainer.drain();
    EXPECT_GT(trainer.counters().huge_splats, 0u) << "the scene is meant to have some";
}

TEST(EffectTraining, antialiasing_that_is_off_has_no_filter) {
    const TinyTraining t = tiny_training();
    TrainOptions on = plain_options();
    on.antialias = true;
    std::uint64_t with = 0, without = 0;
    EXPECT_NE(trained(t, on, 3, &with), trained(t, plain_options(), 3, &without));
    EXPECT_GE(with, without + 4 * t.start().size());
}

}  // namespace
}  // namespace darb::test
