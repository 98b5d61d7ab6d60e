// SPDX-License-Identifier: MIT
// project.comp and project_backward.comp with effects compiled in, against the reference.
#include "engine/reference/reference_render.h"
#include "tests/support/backward_pass.h"
#include "tests/support/compare_arrays.h"
#include "tests/support/projected_frame.h"
#include "tests/support/test_lenses.h"
#include "tests/support/test_scene.h"

namespace darb::test {
namespace {

std::vector<float> filters_for(const SplatModel& model, bool on) {
    std::vector<float> filters;
    for (size_t i = 0; on && i < model.size(); ++i)
        filters.push_back(0.01f + 0.0007f * static_cast<float>(i));
    return filters;
}

/// Both directions of one scene; returns the splats that both walks see.
size_t expect_walks_match(const TestScene& s, ProjectionEffects effects,
                          int projection = PROJECTION_JACOBIAN) {
    reference::RenderSettings settings;
    settings.sh_degree = 1;
    settings.projection = projection;
    const std::vector<float> filters = filters_for(s.model, effects.smoothing);
    const std::vector<float> bound = filters.empty() ? std::vector<float>{0.0f} : filters;
    auto splats = reference::make_splats<double>(s.model);
    splats.smoothing.assign(filters.begin(), filters.end());
    const auto& kernel = reference::kernel_table(s.model.kernel, s.model.footprint);
    const ProjectedFrame frame = project_on_device(s.model, s.camera, 1, EVALUATION_POLYNOMIAL,
                                                   effects, bound, LOW_PASS_DEFAULT, projection);
    std::vector<reference::ProjectedSplat<double>> truth;
    for (size_t i = 0; i < s.model.size(); ++i)
        truth.push_back(reference::project(splats, i, s.camera, settings, kernel));
    reference::make_tile_lists(s.camera.width, s.camera.height, truth);
    std::vector<double> expected, got;
    SplatModel seen = s.model;
    std::vector<float> seen_filters;
    seen.resize(0);
    for (size_t i = 0; i < s.model.size(); ++i) {
        const auto& t = truth[i];
        if (t.cull != reference::Cull::none) continue;
        EXPECT_EQ(frame.visible[i], 1u) << "splat " << i;
        if (frame.visible[i] != 1) continue;
        for (const double v : {t.mean_px.x, t.mean_px.y}) expected.push_back(v / s.camera.width);
        for (const double v : {t.l11, t.l21, t.l22, t.opacity, t.depth}) expected.push_back(v);
        for (const float v : {frame.shape[i].x, frame.shape[i].y})
            got.push_back(v / static_cast<float>(s.camera.width));
        for (const float v : {frame.shape[i].z, frame.shape[i].w, frame.bound[i].x,
                              frame.light[i].w, frame.bound[i].z})
            got.push_back(v);
        EXPECT_GE(frame.bound[i].y, t.reach * (1 - 1e-6)) << "splat " << i;
        for (int a = 0; a < kAttributeCount; ++a) {
            const auto& from = attribute_values(s.model, a);
            auto& to = attribute_values(seen, a);
            const size_t stride = from.size() / s.model.size();
            to.insert(to.end(), from.begin() + static_cast<std::ptrdiff_t>(i * stride),
                      from.begin() + static_cast<std::ptrdiff_t>((i + 1) * stride));
        }
        if (!filters.empty()) seen_filters.push_back(filters[i]);
    }
    const char* allowed = effects.lens ? "lens_float32" : "projection_float32";
    EXPECT_TRUE(compare("projection", expected, got, tolerance(allowed), 7));

    const Partials partials = Partials::random(seen.size(), 5);
    const DoubleGradients d =
        gradients_in_double(seen, s.camera, 1, partials, seen_filters, projection);
    if (seen_filters.empty()) seen_filters = {0.0f};
    const PassState after =
        run_backward_pass(seen, s.camera, 1, UPDATE_STORE, start_state(seen), partials, {}, effects,
                          seen_filters, false, projection);
    EXPECT_EQ(after.status.bad_gradients, 0u);
    const auto stored = after.d;
    for (int a = 0; a < kAttributeCount; ++a) {
        const size_t stride = stored[a].size() / std::max<size_t>(seen.size(), 1);
        std::vector<double> want, have;  // in units of the splat's own largest entry
        for (size_t i = 0; i < seen.size(); ++i) {
            double unit = 1e-30;
            for (size_t c = i * stride; c < (i + 1) * stride; ++c)
                unit = std::max(unit, std::abs(d.d[a][c]));
            for (size_t c = i * stride; c < (i + 1) * stride; ++c) {
                want.push_back(d.d[a][c] / unit);
                have.push_back(stored[a][c] / unit);
            }
        }
        if (stride == 0) continue;
        EXPECT_TRUE(
            compare_scaled(attribute_name(a), want, have, tolerance("project_gradient_float32")));
    }
    return seen.size();
}

TestScene scene_for(int kernel, Footprint footprint, double spread = 1) {
    TestScene s = random_scene({.count = 120,
                                .width = 60,
                                .height = 40,
                                .kernel = kernel,
                                .footprint = footprint,
                                .sh_degree = 1,
                                .min_log_scale = -4.5,
                                .max_log_scale = -1,
                                .seed = 21});
    for (float& p : s.model.position) p *= static_cast<float>(spread);
    return s;
}

TEST(ProjectionEffects, antialias_matches_double) {
    for (const int kernel : {KERNEL_GAUSSIAN, KERNEL_RAISED_COSINE, KERNEL_INVERSE_QUADRATIC,
                             KERNEL_BETA, KERNEL_GENERALIZED_EXPONENTIAL, KERNEL_GES_PUBLISHED})
        for (const Footprint footprint : {Footprint::psi, Footprint::exact}) {
            if (footprint == Footprint::exact && !has_exact_footprint(kernel)) continue;
            SCOPED_TRACE(kernel_name(kernel));
            TestScene s = scene_for(kernel, footprint);
            s.model.antialias = true;
            EXPECT_GT(expect_walks_match(s, {.antialias = true}), 60u);
        }
}

TEST(ProjectionEffects, splats_that_antialias_leaves_below_the_cutoff_are_culled) {
    TestScene s = random_scene({.count = 200,
                                .width = 60,
                                .height = 40,
                                .sh_degree = 1,
                                .min_log_scale = -6,
                                .max_log_scale = -4,
                                .min_logit = -4,
                                .max_logit = 0,
                                .seed = 22});
    s.model.antialias = true;
    const auto splats = reference::make_splats<double>(s.model);
    const auto& kernel = reference::kernel_table(s.model.kernel, s.model.footprint);
    const ProjectedFrame frame =
        project_on_device(s.model, s.camera, 1, EVALUATION_POLYNOMIAL, {.antialias = true});
    size_t faint = 0;
    for (size_t i = 0; i < s.model.size(); ++i) {
        const auto truth = reference::project(splats, i, s.camera, {.sh_degree = 1}, kernel);
        if (truth.cull != reference::Cull::opacity) continue;
        ++faint;
        EXPECT_EQ(frame.visible[i], 0u) << "splat " << i;
    }
    EXPECT_GT(faint, 20u);
    EXPECT_GE(frame.status.culled[CULL_OPACITY], faint);
}

TEST(ProjectionEffects, smoothing_filter_matches_double) {
    for (const int kernel : {KERNEL_RAISED_COSINE, KERNEL_BETA, KERNEL_GENERALIZED_EXPONENTIAL})
        for (const bool antialias : {false, true}) {
            TestScene s = scene_for(kernel, Footprint::psi);
            s.model.antialias = antialias;
            EXPECT_GT(expect_walks_match(s, {.antialias = antialias, .smoothing = true}), 60u);
        }
}

TEST(ProjectionEffects, every_lens_matches_double) {
    for (const auto& [name, lens] : test_lenses())
        for (const double spread : {1.0, 2.0}) {
            SCOPED_TRACE(name);
            TestScene s = scene_for(KERNEL_GAUSSIAN, Footprint::psi, spread);
            s.camera.lens = lens;
            EXPECT_GT(expect_walks_match(s, {.lens = true}), 30u);
        }
}

TEST(ProjectionEffects, shutter_matches_double) {
    for (const double fast : {1.0, 8.0}) {
        TestScene s = scene_for(KERNEL_GAUSSIAN, Footprint::psi, 0.8);
        s.camera.shutter = {true, fast * glm::dvec3(0.01, -0.02, 0.015),
                            fast * glm::dvec3(0.02, -0.01, 0.03)};
        EXPECT_GT(expect_walks_match(s, {.shutter = true}), 60u);
    }
}

TEST(ProjectionEffects, all_at_once_match_double) {
    TestScene s = scene_for(KERNEL_HALF_COSINE_SQUARED, Footprint::exact);
    s.model.antialias = true;
    s.camera.lens = test_lenses()[4].second;
    s.camera.shutter = {true, {0.01, -0.02, 0.015}, {0.02, -0.01, 0.03}};
    EXPECT_GT(expect_walks_match(
                  s, {.antialias = true, .smoothing = true, .lens = true, .shutter = true}),
              60u);
}

TEST(ProjectionEffects, sigma_points_match_double) {
    for (const int projection : {PROJECTION_UNSCENTED, PROJECTION_AUTO})
        for (const auto& [name, lens] : test_lenses()) {
            SCOPED_TRACE(name);
            TestScene s = scene_for(KERNEL_GAUSSIAN, Footprint::psi, 0.8);
            const bool pinhole = name == "FOV";
            if (!pinhole) s.camera.lens = lens;
            EXPECT_GT(expect_walks_match(s, {.lens = !pinhole}, projection), 50u);
        }
}

TEST(ProjectionEffects, sigma_points_with_everything_else_match_double) {
    TestScene s = scene_for(KERNEL_BETA, Footprint::psi, 0.8);
    s.model.antialias = true;
    s.camera.lens = test_lenses()[4].second;
    s.camera.shutter = {true, {0.01, -0.02, 0.015}, {0.02, -0.01, 0.03}};
    EXPECT_GT(
        expect_walks_match(s, {.antialias = true, .smoothing = true, .lens = true, .shutter = true},
                           PROJECTION_UNSCENTED),
        60u);
}

TEST(ProjectionEffects, antialias_of_needles_and_discs_matches_double) {
    for (const bool disc : {false, true}) {
        TestScene s = scene_for(KERNEL_GAUSSIAN, Footprint::psi);
        for (size_t i = 0; i < s.model.size(); ++i)
            for (int c = 0; c < 3; ++c) s.model.log_scale[i * 3 + c] = (c == 0) == disc ? -7 : -1;
        s.model.antialias = true;
        for (float& logit : s.model.opacity_logit) logit = 8;
        for (const int projection : {PROJECTION_JACOBIAN, PROJECTION_UNSCENTED})
            EXPECT_GT(expect_walks_match(s, {.antialias = true}, projection), 60u);
    }
}

TEST(ProjectionEffects, a_centred_camera_needs_no_principal_point_bit_by_bit) {
    TestScene s = scene_for(KERNEL_GAUSSIAN, Footprint::psi, 2);
    s.camera.cx = 0.5 * s.camera.width;
    s.camera.cy = 0.5 * s.camera.height;
    const ProjectedFrame on = project_on_device(s.model, s.camera);
    const ProjectedFrame off =
        project_on_device(s.model, s.camera, 3, EVALUATION_POLYNOMIAL, {.off_centre = false});
    EXPECT_EQ(on.shape, off.shape);
    EXPECT_EQ(on.bound, off.bound);
    EXPECT_EQ(on.light, off.light);
    const Partials partials = Partials::random(s.model.size(), 5);
    const PassState a =
        run_backward_pass(s.model, s.camera, 1, UPDATE_STORE, start_state(s.model), partials);
    const PassState b = run_backward_pass(s.model, s.camera, 1, UPDATE_STORE, start_state(s.model),
                                          partials, {}, {.off_centre = false});
    EXPECT_EQ(a.d, b.d);
}

}  // namespace
}  // namespace darb::test
