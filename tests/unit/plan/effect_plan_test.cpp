// SPDX-License-Identifier: MIT
// The effect plan: scenes and data sets made to need exactly one effect get exactly that one.
#include "engine/plan/effect_plan.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/core/error.h"
#include "shaders/shared/render_args.h"
#include "tests/support/test_scene.h"

namespace darb::test {
namespace {

using On = std::vector<int>;

On effects_on(const EffectPlan& plan) {
    On on;
    for (int e = 0; e < EFFECT_COUNT; ++e) {
        EXPECT_FALSE(plan.row(e).reason.empty()) << effect_name(e);
        if (plan.on(e)) on.push_back(e);
    }
    return on;
}

/// A matte scene before one centred pinhole.
struct Scene {
    SplatModel model;
    std::vector<View> views{1};
    Scene() {
        const TestScene s =
            random_scene({.count = 20, .sh_degree = 3, .min_log_scale = -4, .max_log_scale = -2.5});
        model = s.model;
        for (float& p : model.position) p *= 0.4f;  // in the middle of the picture
        model.sh_rest.assign(model.sh_rest.size(), 0.0f);
        Camera& c = views[0].camera;
        c = s.camera;
        c.cx = 0.5 * c.width;
        c.cy = 0.5 * c.height;
        views[0].lens.parameters = {c.fx, c.fy, c.cx, c.cy};
    }
    On on(const RenderOutputs& outputs = {}) const {
        return effects_on(plan_rendering(model, views, outputs));
    }
};

TEST(EffectPlanOfScene, one_need_switches_on_one_effect_and_none_none) {
    EXPECT_EQ(Scene().on(), On{});
    using Change = void (*)(Scene&);
    const std::pair<int, Change> cases[] = {
        {EFFECT_VIEW_COLOUR, [](Scene& s) { s.model.sh_rest[2] = 0.1f; }},
        {EFFECT_ANTIALIAS, [](Scene& s) { s.model.antialias = true; }},
        {EFFECT_OFF_CENTRE, [](Scene& s) { s.views[0].camera.cx += 0.0002; }},
        {EFFECT_LENS,
         [](Scene& s) {
             LensTerms& lens = s.views[0].camera.lens;
             lens.active = true;
             lens.ray_min = glm::dvec2(-2);
             lens.ray_max = glm::dvec2(2);
         }},
        {EFFECT_SHUTTER,
         [](Scene& s) {
             s.views[0].camera.shutter = {true, {0, 0.01, 0}, {}};
         }},
        {EFFECT_NEAR,
         [](Scene& s) {  // half a unit beside the camera and as wide as that
             const Camera& c = s.views[0].camera;
             const glm::dvec3 at =
                 glm::transpose(c.rotation) * (glm::dvec3(0.5, 0, 0.25) - c.translation);
             for (int k = 0; k < 3; ++k) {
                 s.model.position[3 + k] = static_cast<float>(at[k]);
                 s.model.log_scale[3 + k] = -1;
             }
         }},
    };
    for (const auto& [effect, change] : cases) {
        Scene s;
        change(s);
        EXPECT_EQ(s.on(), On{effect}) << effect_name(effect);
    }
    EXPECT_EQ(Scene().on({.depth = true}), On{EFFECT_DEPTH});
    EXPECT_EQ(effects_on(plan_rendering(SplatModel{}, {}, {})), On{});
}

TEST(EffectPlanOfScene, counters_of_frames_call_for_cooperation) {
    const Scene s;
    EffectPlan plan = plan_rendering(s.model, s.views, {});
    plan.note_frame(0, 100);
    EXPECT_EQ(effects_on(plan), On{});
    plan.note_frame(0, LIST_SEGMENT + 1);
    plan.note_frame(0, 10);
    EXPECT_EQ(effects_on(plan), On{EFFECT_HUGE});
    EXPECT_EQ(plan.huge_splat_path(), HugeSplatPath::by_counters);
    plan = plan_rendering(s.model, s.views, {});
    plan.note_frame(2, 10);
    EXPECT_EQ(effects_on(plan), On{EFFECT_HUGE});
    EXPECT_EQ(plan.row(EFFECT_HUGE).measured, 2);
    plan = plan_rendering(s.model, s.views, {}, parse_effects("-huge"));
    plan.note_frame(2, 10);
    EXPECT_EQ(effects_on(plan), On{});
    EXPECT_EQ(plan.huge_splat_path(), HugeSplatPath::never);
    EXPECT_EQ(plan_rendering(s.model, s.views, {}, parse_effects("+huge")).huge_splat_path(),
              HugeSplatPath::always);
}

TEST(EffectPlanOfScene, near_plane_care_counts_what_lies_beside_a_camera) {
    Scene s;
    EXPECT_EQ(plan_rendering(s.model, s.views, {}).row(EFFECT_NEAR).measured, 0);
    EXPECT_TRUE(plan_rendering(s.model, {}, {}).on(EFFECT_NEAR)) << "cameras are not known";
    const Camera& c = s.views[0].camera;
    const auto put = [&](glm::dvec3 camera_space, float log_scale) {
        const glm::dvec3 at = glm::transpose(c.rotation) * (camera_space - c.translation);
        for (int k = 0; k < 3; ++k) {
            s.model.position[k] = static_cast<float>(at[k]);
            s.model.log_scale[k] = log_scale;
        }
        s.model.opacity_logit[0] = 3;
        return plan_rendering(s.model, s.views, {}).row(EFFECT_NEAR).measured;
    };
    EXPECT_EQ(put({1, 0, 0.25}, -1), 1);
    EXPECT_EQ(put({1, 0, 0.25}, -6), 0) << "too small to reach the picture";
    EXPECT_EQ(put({1, 0, 0.15}, -1), 0) << "before the near plane: no part of the frame";
    EXPECT_EQ(plan_rendering(s.model, s.views, {.near_plane = 0.1f}).row(EFFECT_NEAR).measured, 1);
    EXPECT_EQ(put({0, 0, 0.25}, -1), 0) << "in the picture";
    EXPECT_EQ(put({1, 0, -0.25}, 2), 0) << "behind";
}

// The clamped Jacobian is that of the picture's edge, and there steeper than at the splat: its
// footprint is twice as wide as the splat's own.
TEST(EffectPlanOfScene, near_plane_care_counts_what_the_clamp_itself_widens) {
    Scene s;
    Camera& c = s.views[0].camera;
    c.width = c.height = 1000;
    c.fx = c.fy = 1000;
    c.cx = -2000;  // the picture lies at x/z of 2 to 3
    c.cy = 500;
    const auto count = [&](float log_scale) {
        const glm::dvec3 at = glm::transpose(c.rotation) * (glm::dvec3(0, 0, 1) - c.translation);
        for (int k = 0; k < 3; ++k) {
            s.model.position[k] = static_cast<float>(at[k]);
            s.model.log_scale[k] = log_scale;
        }
        s.model.opacity_logit[0] = 3;
        return plan_rendering(s.model, s.views, {}).row(EFFECT_NEAR).measured;
    };
    EXPECT_EQ(count(-4), 0);
    EXPECT_EQ(count(-0.9f), 1) << "reaches 1,500 px by its own Jacobian, 3,100 px by the clamped";
}

TEST(EffectPlanOfScene, what_changes_less_than_the_limit_is_off) {
    Scene s;
    s.views[0].camera.cy += 0.00005;
    s.model.sh_rest[0] = 0.003f;  // times sqrt(3 / 4 pi) = 0.0015, under 1/512
    EXPECT_EQ(s.on(), On{});
    s.model.sh_rest[0] = 0.0042f;  // 0.00205
    EXPECT_EQ(s.on(), On{EFFECT_VIEW_COLOUR});
}

TEST(EffectPlanOfScene, degree_is_the_highest_band_that_shows) {
    for (int band = 1; band <= 3; ++band) {
        Scene s;
        const auto first = static_cast<size_t>(band * band - 1);
        s.model.sh_rest[45 * 7 + first * 3 + 1] = -0.2f;
        const EffectPlan plan = plan_rendering(s.model, s.views, {});
        EXPECT_EQ(plan.row(EFFECT_VIEW_COLOUR).degree, band);
        apply_plan(plan, s.model);
        EXPECT_EQ(s.model.sh_degree, band);
        const auto rest = static_cast<size_t>(s.model.rest_count());
        ASSERT_EQ(s.model.sh_rest.size(), s.model.size() * rest);
        EXPECT_EQ(s.model.sh_rest[rest * 7 + first * 3 + 1], -0.2f);
    }
}

/// A ring of cameras around points in a cube; grey photos; every photo sees every point.
struct Capture {
    Dataset dataset;
    std::vector<ImageU8> photos;
    explicit Capture(double far_factor = 1) {
        constexpr int kViews = 12, kPoints = 60;
        const TestScene points = random_scene({.count = kPoints, .seed = 3});
        for (const float p : points.model.position) dataset.points.position.push_back(0.5 * p);
        dataset.points.colour.assign(kPoints * 3, 120);
        for (int v = 0; v < kViews; ++v) {
            View view;
            Camera& c = view.camera;
            c.width = c.height = 64;
            c.fx = c.fy = 60;
            c.cx = c.cy = 32;
            const double angle = 3.14159265358979 * v / kViews;
            c.rotation = rotation_of(std::cos(angle), 0, std::sin(angle), 0);
            c.translation = {0, 0, v % 2 == 0 ? 3.0 : 3.0 * far_factor};
            view.lens.parameters = {c.fx, c.fy, c.cx, c.cy};
            dataset.views.push_back(view);
            photos.emplace_back(64, 64, 4);
            photos.back().data.assign(64 * 64 * 4, 120);
            for (size_t i = 3; i < photos.back().data.size(); i += 4) photos.back().data[i] = 255;
        }
        dataset.points.seen_begin.push_back(0);
        for (int p = 0; p < kPoints; ++p) {
            for (std::uint32_t v = 0; v < kViews; ++v) dataset.points.seen_by.push_back(v);
            dataset.points.seen_begin.push_back(dataset.points.seen_by.size());
        }
    }
    void forget_tracks() {
        dataset.points.seen_begin.clear();
        dataset.points.seen_by.clear();
    }
    EffectPlan plan() const { return plan_training(dataset, photos, 0); }
    /// Besides near-plane care, which training always has, and anti-aliasing, which points call
    /// for.
    On on() const {
        On on = effects_on(plan());
        std::erase(on, EFFECT_NEAR);
        std::erase(on, EFFECT_ANTIALIAS);
        return on;
    }
};

TEST(EffectPlanOfDataset, points_call_for_antialiasing) {
    EXPECT_EQ(effects_on(Capture().plan()), (On{EFFECT_ANTIALIAS, EFFECT_NEAR}))
        << "splats that move need the care";
    Capture wide(4.0);
    EXPECT_TRUE(wide.plan().on(EFFECT_ANTIALIAS));
    EXPECT_NE(wide.plan().row(EFFECT_ANTIALIAS).reason.find("% of the points"), std::string::npos);
    wide.forget_tracks();
    EXPECT_GT(wide.plan().row(EFFECT_ANTIALIAS).measured, 0.05);
    EXPECT_LT(Capture(1.6).plan().row(EFFECT_ANTIALIAS).measured, 0.05);
    Capture without;
    without.dataset.points = {};
    EXPECT_FALSE(without.plan().on(EFFECT_ANTIALIAS));
    EXPECT_FALSE(plan_training(wide.dataset, wide.photos, 0, parse_effects("-antialias"))
                     .on(EFFECT_ANTIALIAS));
}

TEST(EffectPlanOfDataset, surfaces_are_asked_for_by_name_alone) {
    const Capture c;
    for (const char* words : {"auto", "all", "none", "all,-surface"})
        EXPECT_FALSE(plan_training(c.dataset, c.photos, 0, parse_effects(words)).on(EFFECT_SURFACE))
            << words;
    for (const char* words : {"+surface", "none,+surface"}) {
        const EffectPlan plan = plan_training(c.dataset, c.photos, 0, parse_effects(words));
        EXPECT_TRUE(plan.on(EFFECT_SURFACE) && plan.row(EFFECT_SURFACE).overridden) << words;
    }
    for (const EffectUse use : {EffectUse::pictures, EffectUse::measuring}) {
        DatasetOptions data;
        EXPECT_THROW(choose_effects("+surface", use, data), Error);
    }
}

TEST(EffectPlanOfDataset, shutters_are_tried_where_cameras_are_refined_and_nobody_decided) {
    const Capture c;
    const auto row = [&](const char* words) {
        return plan_training(c.dataset, c.photos, 0, parse_effects(words)).row(EFFECT_SHUTTER);
    };
    EXPECT_FALSE(row("auto").tried) << "cameras stay as they are";
    EXPECT_TRUE(row("+cameras").tried);
    EXPECT_FALSE(row("+cameras").on);
    EXPECT_TRUE(row("all,+cameras").tried);
    EXPECT_FALSE(row("none,+cameras").tried);
    EXPECT_FALSE(row("+cameras,-shutter").tried);
    EXPECT_FALSE(row("+cameras,+shutter").tried);
    EXPECT_TRUE(row("+cameras,+shutter").on);
    Capture known;
    known.dataset.views[0].camera.shutter = {true, {0, 0.01, 0}, {}};
    const EffectPlan plan =
        plan_training(known.dataset, known.photos, 0, parse_effects("+cameras"));
    EXPECT_TRUE(plan.on(EFFECT_SHUTTER));
    EXPECT_FALSE(plan.row(EFFECT_SHUTTER).tried) << "the file has the motion";
    Capture panoramas;
    for (View& view : panoramas.dataset.views) view.face = 0;
    EXPECT_FALSE(plan_training(panoramas.dataset, panoramas.photos, 0, parse_effects("+cameras"))
                     .row(EFFECT_SHUTTER)
                     .tried);
}

AntialiasProbe probe_of(std::vector<ProbedSize> sizes) {
    return {400, {}, {}, std::move(sizes)};
}

TEST(AntialiasProbe, every_size_counts_and_the_trained_one_may_not_lose_much) {
    const AntialiasProbe gains =
        probe_of({{0.5, 50, 50, 26, 31}, {1, 100, 100, 32.5, 32.1}, {2, 200, 200, 28, 30}});
    EXPECT_NEAR(gains.gain_db(), (5 - 0.4 + 2) / 3, 1e-9);
    EXPECT_TRUE(gains.pays());
    const AntialiasProbe too_dear = probe_of({{0.5, 50, 50, 22, 28}, {1, 100, 100, 31.4, 30}});
    EXPECT_GT(too_dear.gain_db(), 0);
    EXPECT_FALSE(too_dear.pays());
    EXPECT_FALSE(probe_of({{0.5, 50, 50, 30, 29}, {1, 100, 100, 30, 30.1}}).pays());
}

TEST(AntialiasProbe, the_plan_follows_but_for_the_command_line) {
    const AntialiasProbe loses = probe_of({{0.5, 50, 50, 30, 29}, {1, 100, 100, 30, 30.1}});
    const AntialiasProbe gains = probe_of({{1, 100, 100, 30, 30.1}, {4, 400, 400, 26, 29}});
    EffectPlan plan = Capture().plan();
    take_probe(loses, plan);
    EXPECT_FALSE(plan.on(EFFECT_ANTIALIAS));
    EXPECT_NE(plan.row(EFFECT_ANTIALIAS).reason.find("-1.00 dB at 0.5x"), std::string::npos);
    EXPECT_NE(plan.row(EFFECT_ANTIALIAS).reason.find("no larger"), std::string::npos);
    take_probe(gains, plan);
    EXPECT_TRUE(plan.on(EFFECT_ANTIALIAS));
    EXPECT_EQ(plan.row(EFFECT_ANTIALIAS).reason.find("no larger"), std::string::npos);
    const Capture c;
    plan = plan_training(c.dataset, c.photos, 0, parse_effects("-antialias"));
    take_probe(gains, plan);
    EXPECT_FALSE(plan.on(EFFECT_ANTIALIAS));
    EXPECT_TRUE(plan.row(EFFECT_ANTIALIAS).reason.starts_with("--effects; a probe"));
}

TEST(EffectPlanOfDataset, gains_that_differ_call_for_exposure_where_tracks_say_so) {
    Capture c;
    for (size_t v = 0; v < c.photos.size(); ++v)
        for (std::uint8_t& value : c.photos[v].data) value = static_cast<std::uint8_t>(120 + 3 * v);
    EXPECT_EQ(c.on(), On{EFFECT_EXPOSURE});
    EXPECT_GT(plan_training(c.dataset, c.photos, 0).row(EFFECT_EXPOSURE).measured, 0.05);
    c.forget_tracks();
    EXPECT_EQ(c.on(), On{});
    Capture odd;  // one photo alone says little about the others
    for (std::uint8_t& value : odd.photos[4].data) value = 200;
    EXPECT_EQ(odd.on(), On{});
}

TEST(EffectPlanOfDataset, alpha_centre_and_degree_each_alone) {
    Capture alpha;
    alpha.dataset.has_alpha = true;
    EXPECT_EQ(alpha.on(), On{}) << "a channel that is opaque everywhere";
    alpha.photos[5].data[7] = 254;
    EXPECT_EQ(alpha.on(), On{EFFECT_ALPHA});
    alpha.photos.clear();
    EXPECT_EQ(alpha.on(), On{EFFECT_ALPHA}) << "nobody looked";
    Capture off;
    off.dataset.views[3].camera.cy += 0.7;
    EXPECT_EQ(off.on(), On{EFFECT_OFF_CENTRE});
    const Capture plain;
    EXPECT_EQ(effects_on(plan_training(plain.dataset, plain.photos, 2)),
              (On{EFFECT_VIEW_COLOUR, EFFECT_ANTIALIAS, EFFECT_NEAR}));
}

TEST(EffectChoice, words_override_the_rules) {
    const Scene s;
    const auto plan = [&](const char* text) {
        return plan_rendering(s.model, s.views, {}, parse_effects(text));
    };
    EXPECT_EQ(effects_on(plan("all")),
              (On{EFFECT_VIEW_COLOUR, EFFECT_OFF_CENTRE, EFFECT_LENS, EFFECT_HUGE, EFFECT_NEAR}));
    EXPECT_EQ(effects_on(plan("all,-lens,-sh")), (On{EFFECT_OFF_CENTRE, EFFECT_HUGE, EFFECT_NEAR}));
    EXPECT_EQ(effects_on(plan("none,+near")), On{EFFECT_NEAR});
    EXPECT_EQ(effects_on(plan("auto,-sh,+off_centre")), On{EFFECT_OFF_CENTRE});
    EXPECT_EQ(effects_on(plan("auto")), On{});
    EXPECT_EQ(plan("all").row(EFFECT_VIEW_COLOUR).degree, 3);
    EXPECT_EQ(effects_on(plan("none")), On{});
    EXPECT_EQ(effects_on(plan("+off_centre,-sh")), On{EFFECT_OFF_CENTRE});
    EXPECT_TRUE(plan("+off_centre").row(EFFECT_OFF_CENTRE).overridden);
    EXPECT_FALSE(plan("+off_centre").row(EFFECT_LENS).overridden);
    Scene mip;
    mip.model.antialias = true;
    EXPECT_EQ(effects_on(plan_rendering(mip.model, mip.views, {}, parse_effects("none"))), On{});
}

TEST(EffectChoice, what_is_no_effect_is_an_error_that_names_them) {
    for (const char* text :
         {"", "sh", "+nothing", "+sh,auto", "all,none", "+sh,", "auto,", "+sh -lens"}) {
        try {
            parse_effects(text);
            ADD_FAILURE() << text;
        } catch (const Error& e) {
            EXPECT_NE(std::string(e.what()).find("exposure"), std::string::npos) << e.what();
        }
    }
}

}  // namespace
}  // namespace darb::test
