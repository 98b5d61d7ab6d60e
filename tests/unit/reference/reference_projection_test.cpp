// SPDX-License-Identifier: MIT
// Projection of one splat: culls, clamps and their gradients, needles.
#include "engine/reference/projection.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/test_scene.h"
#include "tests/unit/reference/reference_scenes.h"

namespace darb::reference {
namespace {

using test::OneSplat;
using test::small_camera;
using test::splats_of;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Cull cull_of(const OneSplat& one, const RenderSettings& settings = {}) {
    return render(splats_of({one}), small_camera(), settings).projected[0].cull;
}

TEST(ProjectionCull, EachReason_IsNamedAndCounted) {
    EXPECT_EQ(cull_of({}), Cull::none);
    EXPECT_EQ(cull_of({.position = {0, 0, 0.2}}), Cull::near_plane);
    EXPECT_EQ(cull_of({.position = {0, 0, 0.2000001}}), Cull::none);
    EXPECT_EQ(cull_of({.position = {0, 0, 0}}), Cull::near_plane);
    EXPECT_EQ(cull_of({.position = {0, 0, -2}}), Cull::near_plane);
    EXPECT_EQ(cull_of({.position = {0, 0, kNan}}), Cull::near_plane);
    EXPECT_EQ(cull_of({.position = {kNan, 0, 2}}), Cull::near_plane);
    EXPECT_EQ(cull_of({.rotation = {0, 0, 0, 0}}), Cull::rotation);
    EXPECT_EQ(cull_of({.rotation = {0, 9e-7, 0, 0}}), Cull::rotation);
    EXPECT_EQ(cull_of({.rotation = {0, 1.1e-6, 0, 0}}), Cull::none);
    EXPECT_EQ(cull_of({.rotation = {kNan, 0, 0, 0}}), Cull::rotation);
    EXPECT_EQ(cull_of({.logit = -5.6}), Cull::opacity);
    EXPECT_EQ(cull_of({.logit = -5.5}), Cull::none);
    EXPECT_EQ(cull_of({.log_scale = glm::dvec3(50)}), Cull::none);
    EXPECT_EQ(cull_of({.log_scale = glm::dvec3(-20)}, {.low_pass = 0}), Cull::covariance);
    EXPECT_EQ(cull_of({.logit = kNan}), Cull::opacity);
    EXPECT_EQ(cull_of({.log_scale = {0, kNan, 0}}), Cull::covariance);
    EXPECT_EQ(cull_of({.colour = {0, kNan, 0}}), Cull::colour);
    EXPECT_EQ(cull_of({.position = {9, 0, 2}}), Cull::outside);
    EXPECT_EQ(cull_of({.position = {0, -5, 2}}), Cull::outside);
    const auto result = render(splats_of({{}, {.logit = -9}, {.logit = -9}}), small_camera(), {});
    EXPECT_EQ(result.visible_count(), 1U);
    EXPECT_EQ(result.culled[static_cast<int>(Cull::opacity)], 2U);
    EXPECT_EQ(cull_name(Cull::opacity), "opacity");
    EXPECT_EQ(cull_name(Cull::outside), "outside");
}

TEST(ProjectionLimits, ScaleOfFifty_CoversTheImageWithItsOpacity) {
    const auto splats = splats_of({{.log_scale = glm::dvec3(50), .colour = {1, 0.5, 0}}});
    const auto result = render(splats, small_camera(), {});
    Splats<float> floats;
    const auto copy = [](const auto& from, auto& to) { to.assign(from.begin(), from.end()); };
    copy(splats.position, floats.position);
    copy(splats.log_scale, floats.log_scale);
    copy(splats.rotation, floats.rotation);
    copy(splats.opacity_logit, floats.opacity_logit);
    copy(splats.sh_dc, floats.sh_dc);
    const auto in_float = render(floats, small_camera(), {});
    for (int y = 0; y < small_camera().height; ++y)
        for (int x = 0; x < small_camera().width; ++x) {
            EXPECT_NEAR(result.images.colour.at(x, y, 0), 0.5, 1e-14);
            EXPECT_NEAR(result.images.colour.at(x, y, 1), 0.25, 1e-14);
            EXPECT_NEAR(in_float.images.colour.at(x, y, 1), 0.25f, 1e-6f);
        }
    const auto d =
        backward(splats, small_camera(), {}, result, test::random_weights(small_camera(), 3, 1));
    EXPECT_NE(d.splats.opacity_logit[0], 0);
    for (size_t a = 0; a < 3; ++a) {
        EXPECT_EQ(d.splats.log_scale[a], 0);
        EXPECT_TRUE(std::isfinite(d.splats.position[a]));
        EXPECT_TRUE(std::isfinite(d.splats.rotation[a]));
    }
}

TEST(ProjectionCull, CulledSplats_HaveZeroGradients) {
    const auto splats = splats_of({{}, {.rotation = {0, 0, 0, 0}}, {.position = {0, 0, -1}}});
    const auto result = render(splats, small_camera(), {});
    const auto d =
        backward(splats, small_camera(), {}, result, test::random_weights(small_camera(), 3, 1));
    EXPECT_NE(d.splats.opacity_logit[0], 0);
    for (const size_t i : {1, 2}) {
        EXPECT_EQ(d.splats.opacity_logit[i], 0);
        EXPECT_EQ(d.splats.position[i * 3 + 2], 0);
        EXPECT_EQ(d.splats.rotation[i * 4], 0);
        EXPECT_EQ(d.mean_gradient_ndc[i], 0);
    }
}

TEST(Projection, Factor_IsTheInverseOfTheCovariance) {
    const auto scene = test::random_scene({.count = 40});
    const auto splats = make_splats<double>(scene.model);
    const KernelTable& kernel = kernel_table(KERNEL_GAUSSIAN, Footprint::psi);
    for (size_t i = 0; i < splats.size(); ++i) {
        const auto p = project(splats, i, scene.camera, {}, kernel);
        ASSERT_EQ(p.cull, Cull::none);
        const double det = p.cov_xx * p.cov_yy - p.cov_xy * p.cov_xy;
        EXPECT_NEAR(p.l11 * p.l11, p.cov_yy / det, 1e-10) << "splat " << i;
        EXPECT_NEAR(p.l11 * p.l21, -p.cov_xy / det, 1e-10) << "splat " << i;
        EXPECT_NEAR(p.l21 * p.l21 + p.l22 * p.l22, p.cov_xx / det, 1e-10) << "splat " << i;
    }
}

TEST(Projection, CovarianceOfTheSplat_MatchesSamplesThroughTheCamera) {
    // A tiny splat: its projection is linear over its width. 3 sigma points along its axes.
    const auto scene = test::random_scene({.count = 20, .min_log_scale = -9, .max_log_scale = -7});
    const auto splats = make_splats<double>(scene.model);
    const Camera& camera = scene.camera;
    const KernelTable& kernel = kernel_table(KERNEL_GAUSSIAN, Footprint::psi);
    const auto pixel = [&](const glm::dvec3& world) {
        const glm::dvec3 at = camera.rotation * world + camera.translation;
        return glm::dvec2(camera.fx * at.x / at.z + camera.cx, camera.fy * at.y / at.z + camera.cy);
    };
    for (size_t i = 0; i < splats.size(); ++i) {
        const auto p = project(splats, i, camera, {.low_pass = 0}, kernel);
        const double* q = &splats.rotation[i * 4];
        const glm::dmat3 axes = test::rotation_of(q[0], q[1], q[2], q[3]);
        const glm::dvec3 mean(splats.position[i * 3], splats.position[i * 3 + 1],
                              splats.position[i * 3 + 2]);
        double xx = 0, xy = 0, yy = 0;
        for (int k = 0; k < 3; ++k) {
            const glm::dvec3 step = axes[k] * std::exp(splats.log_scale[i * 3 + k]);
            const glm::dvec2 d = (pixel(mean + step) - pixel(mean - step)) / 2.0;
            xx += d.x * d.x;
            xy += d.x * d.y;
            yy += d.y * d.y;
        }
        EXPECT_NEAR(p.cov_xx, xx, 1e-5 * (xx + yy)) << "splat " << i;
        EXPECT_NEAR(p.cov_xy, xy, 1e-5 * (xx + yy)) << "splat " << i;
        EXPECT_NEAR(p.cov_yy, yy, 1e-5 * (xx + yy)) << "splat " << i;
    }
}

// dL/d(position) of a loss on the projected quantities alone, against differences.
void expect_position_gradient(const OneSplat& one, const Camera& camera) {
    auto splats = splats_of({one});
    const KernelTable& kernel = kernel_table(KERNEL_GAUSSIAN, Footprint::psi);
    const auto loss = [&] {
        const auto p = project(splats, 0, camera, {}, kernel);
        return 0.3 * p.mean_px.x - 0.2 * p.mean_px.y + 5 * p.l11 + 7 * p.l21 - 3 * p.l22;
    };
    ProjectedGradient<double> d;
    d.d_mean_px = {0.3, -0.2};
    d.d_l11 = 5;
    d.d_l21 = 7;
    d.d_l22 = -3;
    SplatGradients<double> out;
    out.resize_like(splats);
    project_backward(splats, 0, camera, {}, kernel, {project(splats, 0, camera, {}, kernel), d},
                     out);
    for (int c = 0; c < 3; ++c) {
        const double kept = splats.position[c];
        splats.position[c] = kept + 1e-6;
        const double above = loss();
        splats.position[c] = kept - 1e-6;
        const double below = loss();
        splats.position[c] = kept;
        EXPECT_NEAR(out.position[c], (above - below) / 2e-6, 1e-7 + 1e-7 * std::abs(above))
            << "axis " << c << " at " << one.position.x << ", " << one.position.y;
    }
}

TEST(ProjectionJacobian, InsideAndOutsideTheClamp_GradientMatchesDifferences) {
    Camera camera = small_camera();
    camera.cx = 2;  // off centre: the clamp is not symmetric
    for (const double x : {-9.0, -1.0, 0.1, 3.0, 9.0}) {
        for (const double y : {-8.0, 0.2, 8.0}) {
            expect_position_gradient({.position = {x, y, 2},
                                      .log_scale = {-1, 0.2, -0.5},
                                      .rotation = {0.9, 0.1, -0.3, 0.4}},
                                     camera);
        }
    }
}

TEST(ProjectionJacobian, BeyondTheClamp_UsesTheRatioAtTheLimit) {
    // W = 9, fx = 4, cx = 2: limits -2/4 - 0.3 * 9/8 = -0.8375 and 7/4 + 0.3375 = 2.0875.
    Camera camera = small_camera();
    camera.cx = 2;
    const KernelTable& kernel = kernel_table(KERNEL_GAUSSIAN, Footprint::psi);
    const auto cov_xx = [&](double ratio) {
        // An isotropic splat of deviation 1 at z = 2: fx^2 / z^2 (1 + ratio^2) + 0.3.
        const auto splats =
            splats_of({{.position = {2 * ratio, 0, 2}, .log_scale = glm::dvec3(0)}});
        return project(splats, 0, camera, {}, kernel).cov_xx;
    };
    EXPECT_NEAR(cov_xx(-0.8), 4 * (1 + 0.64) + 0.3, 1e-12);
    EXPECT_NEAR(cov_xx(-3), 4 * (1 + 0.8375 * 0.8375) + 0.3, 1e-12);
    EXPECT_NEAR(cov_xx(2.0), 4 * (1 + 4.0) + 0.3, 1e-12);
    EXPECT_NEAR(cov_xx(9), 4 * (1 + 2.0875 * 2.0875) + 0.3, 1e-12);
    const auto far = splats_of({{.position = {18, 0, 2}}});
    EXPECT_NEAR(project(far, 0, camera, {}, kernel).mean_px.x, 4 * 9 + 2, 1e-12)
        << "the mean itself is not clamped";
}

TEST(ProjectionClamp, ExtremeScalesAndLogits_StayFiniteWithZeroGradient) {
    const Image<double> weights = test::random_weights(small_camera(), 3, 1);
    const auto gradients = [&](const OneSplat& one) {
        const auto splats = splats_of({one});
        const auto result = render(splats, small_camera(), {});
        for (const double value : result.images.colour.data) {
            EXPECT_TRUE(std::isfinite(value));
        }
        EXPECT_EQ(result.visible_count(), 1U);
        return backward(splats, small_camera(), {}, result, weights).splats;
    };
    const auto flat = gradients({.log_scale = {-50, -1, -1}, .logit = 1e4});
    EXPECT_EQ(flat.log_scale[0], 0);
    EXPECT_NE(flat.log_scale[1], 0);
    EXPECT_EQ(flat.opacity_logit[0], 0);
    EXPECT_EQ(cull_of({.logit = -1e4}), Cull::opacity);
}

TEST(Projection, Needle_KeepsItsDeterminant) {
    // Axis ratio 1e6 in standard deviations at 45 degrees without low-pass: det = (a b)^2.
    const double half = std::acos(-1.0) / 8;
    const auto splats = splats_of({{.log_scale = {std::log(1e3), std::log(1e-3), std::log(1e-3)},
                                    .rotation = {std::cos(half), 0, 0, std::sin(half)}}});
    const auto p = project(splats, 0, small_camera(), {.low_pass = 0},
                           kernel_table(KERNEL_GAUSSIAN, Footprint::psi));
    ASSERT_EQ(p.cull, Cull::none);
    // (fx / z)^2 = 4 on each axis: deviations 2e3 and 2e-3 px. l11 l22 = 1 / sqrt(det) = 1/4.
    EXPECT_NEAR(p.l11 * p.l22, 0.25, 1e-8);
}

}  // namespace
}  // namespace darb::reference
