// SPDX-License-Identifier: MIT
// Gradients of the projection's effects (lens, rolling shutter, 3D smoothing filter and
// anti-aliasing) against central differences of a random linear function of the projection's
// results.
#include <gtest/gtest.h>

#include "engine/core/rng.h"
#include "engine/reference/reference_lens.h"
#include "engine/reference/reference_render.h"
#include "engine/scene/pose_metric.h"
#include "tests/support/compare_arrays.h"
#include "tests/support/test_lenses.h"
#include "tests/support/test_scene.h"
#include "tests/unit/reference/reference_scenes.h"

namespace darb::reference {
namespace {

using test::tolerance;

constexpr double kEffectStep = 1e-6;

struct Weights {
    ProjectedGradient<double> d;
    explicit Weights(std::uint64_t seed) {
        Pcg32 random(seed, 3);
        const auto next = [&] { return random.uniform(-1.0, 1.0); };
        d.d_mean_px = {next(), next()};
        d.d_l11 = 20 * next();
        d.d_l21 = 20 * next();
        d.d_l22 = 20 * next();
        d.d_opacity = 20 * next();
        d.d_colour = {next(), next(), next()};
    }
    double of(const ProjectedSplat<double>& p) const {
        return glm::dot(d.d_mean_px, p.mean_px) + d.d_l11 * p.l11 + d.d_l21 * p.l21 +
               d.d_l22 * p.l22 + d.d_opacity * p.opacity + glm::dot(d.d_colour, p.colour);
    }
};

/// Every parameter of every splat that the camera sees; returns how many splats those are.
size_t expect_gradients(const std::string& name, Splats<double> splats, const Camera& camera) {
    const KernelTable& kernel = kernel_table(splats.kernel, splats.footprint);
    SplatGradients<double> out;
    out.resize_like(splats);
    size_t seen = 0;
    std::vector<double> expected, got;
    for (size_t i = 0; i < splats.size(); ++i) {
        const Weights w(i);
        const auto now = project(splats, i, camera, {}, kernel);
        if (now.cull != Cull::none) continue;
        ++seen;
        project_backward(splats, i, camera, {}, kernel, {now, w.d}, out);
        const auto check = [&](std::vector<double>& values, const std::vector<double>& d,
                               size_t stride) {
            for (size_t k = i * stride; k < (i + 1) * stride; ++k) {
                const double kept = values[k];
                values[k] = kept + kEffectStep;
                const double above = w.of(project(splats, i, camera, {}, kernel));
                values[k] = kept - kEffectStep;
                const double below = w.of(project(splats, i, camera, {}, kernel));
                values[k] = kept;
                expected.push_back((above - below) / (2 * kEffectStep));
                got.push_back(d[k]);
            }
        };
        check(splats.position, out.position, 3);
        check(splats.log_scale, out.log_scale, 3);
        check(splats.rotation, out.rotation, 4);
        check(splats.opacity_logit, out.opacity_logit, 1);
        check(splats.sh_dc, out.sh_dc, 3);
    }
    EXPECT_TRUE(test::compare(name, expected, got, tolerance("difference")));
    return seen;
}

test::TestScene scene_of(double spread) {
    test::TestScene s = test::random_scene(
        {.count = 40, .sh_degree = 1, .min_log_scale = -5, .max_log_scale = -2, .seed = 4});
    for (float& p : s.model.position) p *= static_cast<float>(spread);
    return s;
}

TEST(ReferenceLens, every_form_matches_differences) {
    for (const auto& [name, lens] : test::test_lenses())
        for (const glm::dvec2 ray : {glm::dvec2(0, 0), glm::dvec2(0.1, -0.2), glm::dvec2(0.7, 0.4),
                                     glm::dvec2(-0.3, 0.35), glm::dvec2(0, 0.49)}) {
            const auto at = lens_point<double>(lens, ray);
            const glm::dmat2 weights(0.3, -0.8, 0.6, 0.5);
            const auto weighted = [&](const glm::dmat2& m) {
                return glm::dot(weights[0], m[0]) + glm::dot(weights[1], m[1]);
            };
            const auto d = lens_jacobian_backward<double>(lens, ray, weights);
            for (int c = 0; c < 2; ++c) {
                glm::dvec2 step(0.0);
                step[c] = 1e-5;
                const auto above = lens_point<double>(lens, ray + step);
                const auto below = lens_point<double>(lens, ray - step);
                const glm::dvec2 slope = (above.value - below.value) / 2e-5;
                EXPECT_NEAR(at.jacobian[c].x, slope.x, 1e-9) << name << " " << c;
                EXPECT_NEAR(at.jacobian[c].y, slope.y, 1e-9) << name << " " << c;
                EXPECT_NEAR(d[c], (weighted(above.jacobian) - weighted(below.jacobian)) / 2e-5,
                            1e-8)
                    << name << " " << c;
            }
        }
}

TEST(ReferenceEffects, lens_gradients_match_differences_inside_and_outside_the_clamp) {
    for (const auto& [name, lens] : test::test_lenses())
        for (const double spread : {1.0, 2.5}) {
            test::TestScene s = scene_of(spread);
            s.camera.lens = lens;
            EXPECT_GT(expect_gradients(name, make_splats<double>(s.model), s.camera), 15U);
        }
}

TEST(ReferenceEffects, identity_lens_is_the_pinhole) {
    test::TestScene s = scene_of(1);
    const auto splats = make_splats<double>(s.model);
    const KernelTable& kernel = kernel_table(splats.kernel, splats.footprint);
    Camera lens_camera = s.camera;
    lens_camera.lens.active = true;
    lens_camera.lens.fold = 10;
    const glm::dvec2 focal(s.camera.fx, s.camera.fy), principal(s.camera.cx, s.camera.cy);
    lens_camera.lens.ray_min = -principal / focal;  // the clamp of the pinhole
    lens_camera.lens.ray_max = (glm::dvec2(s.camera.width, s.camera.height) - principal) / focal;
    for (size_t i = 0; i < splats.size(); ++i) {
        const auto a = project(splats, i, s.camera, {}, kernel);
        const auto b = project(splats, i, lens_camera, {}, kernel);
        if (a.cull != Cull::none) continue;
        EXPECT_NEAR(a.mean_px.x, b.mean_px.x, 1e-11);
        EXPECT_NEAR(a.l11, b.l11, 1e-11);
        EXPECT_NEAR(a.l21, b.l21, 1e-11);
    }
}

TEST(ReferenceEffects, beyond_the_fold_nothing_is_seen) {
    test::TestScene s = scene_of(1);
    s.camera.lens = test::test_lenses()[0].second;
    s.camera.lens.fold = 1e-6;
    const auto splats = make_splats<double>(s.model);
    for (size_t i = 0; i < splats.size(); ++i)
        EXPECT_NE(project(splats, i, s.camera, {}, kernel_table(0, Footprint::psi)).cull,
                  Cull::none);
}

const ShutterTerms kShutters[] = {{true, {0.01, -0.02, 0.015}, {0.02, -0.01, 0.03}},
                                  {true, {-0.1, 0.15, 0.2}, {0.3, 0.2, -0.2}}};

TEST(ReferenceEffects, shutter_gradients_match_differences) {
    for (const ShutterTerms& shutter : kShutters)
        for (const bool lens : {false, true})
            for (const bool antialias : {false, true}) {
                test::TestScene s = scene_of(0.8);
                s.camera.shutter = shutter;
                if (lens) s.camera.lens = test::test_lenses()[1].second;
                auto splats = make_splats<double>(s.model);
                splats.antialias = antialias;
                EXPECT_GT(expect_gradients("shutter", splats, s.camera), 15U);
            }
}

TEST(ReferenceEffects, a_splat_is_where_the_camera_of_its_row_sees_it) {
    for (const ShutterTerms& shutter : kShutters) {
        test::TestScene s = scene_of(0.8);
        s.camera.shutter = shutter;
        const auto splats = make_splats<double>(s.model);
        const KernelTable& kernel = kernel_table(splats.kernel, splats.footprint);
        size_t seen = 0;
        for (size_t i = 0; i < splats.size(); ++i) {
            const auto p = project(splats, i, s.camera, {}, kernel);
            if (p.cull != Cull::none) continue;
            ++seen;
            const double time = p.mean_px.y / s.camera.height - 0.5;
            const auto row = project(splats, i, camera_at_row(s.camera, time), {}, kernel);
            EXPECT_NEAR(p.mean_px.x, row.mean_px.x, 1e-9);
            EXPECT_NEAR(p.mean_px.y, row.mean_px.y, 1e-9);
            EXPECT_NEAR(p.depth, row.depth, 1e-12);
        }
        EXPECT_GT(seen, 15U);
    }
}

// The truth: every row from a picture of its own pose.
TEST(ReferenceEffects, a_rolling_picture_is_made_of_the_rows_of_still_ones) {
    test::TestScene s = scene_of(0.8);
    s.camera.shutter = kShutters[1];
    const auto rolling = render(s.model, s.camera, {});
    const auto still = render(s.model, camera_at_row(s.camera, 0), {});
    double error = 0, error_of_still = 0;
    const auto square = [](double x) { return x * x; };
    for (int y = 0; y < s.camera.height; ++y) {
        const auto row =
            render(s.model, camera_at_row(s.camera, (y + 0.5) / s.camera.height - 0.5), {});
        for (int x = 0; x < s.camera.width; ++x)
            for (int c = 0; c < 3; ++c) {
                const double truth = row.images.colour.at(x, y, c);
                error += square(rolling.images.colour.at(x, y, c) - truth);
                error_of_still += square(still.images.colour.at(x, y, c) - truth);
            }
    }
    EXPECT_LT(error, 0.006 * error_of_still);  // 0.0041
}

TEST(ReferenceEffects, smoothing_filter_gradients_match_differences) {
    for (const bool antialias : {false, true}) {
        const test::TestScene s = scene_of(1);
        auto splats = make_splats<double>(s.model);
        splats.antialias = antialias;
        for (size_t i = 0; i < splats.size(); ++i)
            splats.smoothing.push_back(0.01 + 0.002 * static_cast<double>(i));
        EXPECT_GT(expect_gradients(antialias ? "both" : "smoothing", splats, s.camera), 15U);
    }
}

TEST(ReferenceEffects, smoothing_filter_keeps_the_light_of_a_splat) {
    // The filter preserves opacity times volume: o s^3 = o' s'^3 for a round splat.
    auto splats = test::splats_of({{.log_scale = glm::dvec3(-2), .logit = 1}});
    splats.smoothing = {0.2};
    const auto p = project(splats, 0, test::small_camera(), {.low_pass = 0},
                           kernel_table(KERNEL_GAUSSIAN, Footprint::psi));
    const double s = std::exp(-2.0), wide = std::sqrt(s * s + 0.04), o = 1 / (1 + std::exp(-1.0));
    EXPECT_NEAR(p.opacity, o * std::pow(s / wide, 3), 1e-12);
}

}  // namespace
}  // namespace darb::reference
