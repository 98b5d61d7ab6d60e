// SPDX-License-Identifier: MIT
// Gradients of the projection's effects (lens, rolling shutter, 3D smoothing filter, anti-aliasing)
// and of sigma points against central differences of a random linear function of the projection's
// results.
#include <gtest/gtest.h>

#include "engine/core/rng.h"
#include "engine/reference/reference_lens.h"
#include "engine/reference/reference_render.h"
#include "engine/reference/reference_sigma_points.h"
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
size_t expect_gradients(const std::string& name, Splats<double> splats, const Camera& camera,
                        const RenderSettings& settings = {}) {
    const KernelTable& kernel = kernel_table(splats.kernel, splats.footprint);
    SplatGradients<double> out;
    out.resize_like(splats);
    size_t seen = 0;
    std::vector<double> expected, got;
    for (size_t i = 0; i < splats.size(); ++i) {
        const Weights w(i);
        const auto now = project(splats, i, camera, settings, kernel);
        if (now.cull != Cull::none) continue;
        ++seen;
        project_backward(splats, i, camera, settings, kernel, {now, w.d}, out);
        const auto check = [&](std::vector<double>& values, const std::vector<double>& d,
                               size_t stride) {
            for (size_t k = i * stride; k < (i + 1) * stride; ++k) {
                const double kept = values[k];
                values[k] = kept + kEffectStep;
                const double above = w.of(project(splats, i, camera, settings, kernel));
                values[k] = kept - kEffectStep;
                const double below = w.of(project(splats, i, camera, settings, kernel));
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

size_t points_used(const Splats<double>& splats, const Camera& camera, int projection) {
    size_t used = 0;
    for (size_t i = 0; i < splats.size(); ++i) {
        const RowCamera<double> row = row_camera(&splats.position[i * 3], camera);
        RenderSettings settings;
        settings.projection = projection;
        const auto mean = mean_in_camera(&splats.position[i * 3], row.camera);
        const auto rotation = rotation_terms(&splats.rotation[i * 4]);
        used += covariance_terms(mean, rotation, &splats.log_scale[i * 3], 0.0, row, settings, 1.0)
                    .sigma.used;
    }
    return used;
}

TEST(ReferenceSigmaPoints, gradients_match_differences) {
    RenderSettings settings;
    for (const int projection : {PROJECTION_UNSCENTED, PROJECTION_AUTO})
        for (const bool shutter : {false, true})
            for (const bool antialias : {false, true})
                for (const auto& [name, lens] : test::test_lenses()) {
                    if (projection == PROJECTION_AUTO && name != "OPENCV_FISHEYE") continue;
                    test::TestScene s = scene_of(0.8);
                    if (name != "FOV") s.camera.lens = lens;  // a pinhole in its place
                    if (shutter) s.camera.shutter = kShutters[0];
                    for (float& scale : s.model.log_scale)
                        if (projection == PROJECTION_AUTO) scale += 1;
                    auto splats = make_splats<double>(s.model);
                    splats.antialias = antialias;
                    settings.projection = projection;
                    EXPECT_GT(points_used(splats, s.camera, projection), 10U) << name;
                    EXPECT_GT(expect_gradients(name, splats, s.camera, settings), 15U);
                }
}

TEST(ReferenceSigmaPoints, gradients_of_the_camera_match_differences) {
    test::TestScene s = scene_of(0.8);
    s.camera.lens = test::test_lenses()[4].second;
    const auto splats = make_splats<double>(s.model);
    const KernelTable& kernel = kernel_table(splats.kernel, splats.footprint);
    RenderSettings settings;
    settings.projection = PROJECTION_UNSCENTED;
    const auto value = [&](const Camera& camera) {
        double sum = 0;
        for (size_t i = 0; i < splats.size(); ++i) {
            const auto p = project(splats, i, camera, settings, kernel);
            if (p.cull == Cull::none) sum += Weights(i).of(p);
        }
        return sum;
    };
    CameraGradients<double> d;
    SplatGradients<double> out;
    out.resize_like(splats);
    for (size_t i = 0; i < splats.size(); ++i) {
        const auto p = project(splats, i, s.camera, settings, kernel);
        CameraGradients<double> one;
        const Weights w(i);
        project_backward(splats, i, s.camera, settings, kernel, {p, w.d}, out, &one);
        if (p.cull == Cull::none) d += one;
    }
    const auto slope = [&](double& number) {
        const double kept = number;
        number = kept + kEffectStep;
        const double above = value(s.camera);
        number = kept - kEffectStep;
        const double below = value(s.camera);
        number = kept;
        return (above - below) / (2 * kEffectStep);
    };
    EXPECT_NEAR(d.d_focal.x, slope(s.camera.fx), 1e-6 + 1e-5 * std::abs(d.d_focal.x));
    EXPECT_NEAR(d.d_focal.y, slope(s.camera.fy), 1e-6 + 1e-5 * std::abs(d.d_focal.y));
    EXPECT_NEAR(d.d_translation.x, slope(s.camera.translation.x), 1e-4);
    EXPECT_NEAR(d.d_translation.z, slope(s.camera.translation.z), 1e-4);
    // Turns keep the matrix a rotation: dL/d(turn) = sum over columns of column x d_column.
    glm::dvec3 twist = glm::cross(s.camera.translation, d.d_translation);
    for (int c = 0; c < 3; ++c) twist += glm::cross(s.camera.rotation[c], d.d_rotation[c]);
    for (int axis = 0; axis < 3; ++axis) {
        const auto turned = [&](double angle) {
            glm::dvec3 turn(0.0);
            turn[axis] = angle;
            Camera camera = s.camera;
            camera.rotation = exp_rotation(turn) * camera.rotation;
            camera.translation = exp_rotation(turn) * camera.translation;
            return value(camera);
        };
        const double by = (turned(kEffectStep) - turned(-kEffectStep)) / (2 * kEffectStep);
        EXPECT_NEAR(twist[axis], by, 1e-4 * (1 + std::abs(by))) << axis;
    }
}

TEST(ReferenceSigmaPoints, small_splats_are_those_of_the_jacobian) {
    test::TestScene s = scene_of(0.8);
    for (float& scale : s.model.log_scale) scale -= 6;
    const auto splats = make_splats<double>(s.model);
    const KernelTable& kernel = kernel_table(splats.kernel, splats.footprint);
    RenderSettings unscented, by_auto, sharp;
    unscented.projection = PROJECTION_UNSCENTED;
    by_auto.projection = PROJECTION_AUTO;
    sharp.low_pass = unscented.low_pass = by_auto.low_pass = 1e-12;
    EXPECT_EQ(points_used(splats, s.camera, PROJECTION_AUTO), 0U);
    size_t seen = 0;
    for (size_t i = 0; i < splats.size(); ++i) {
        const auto a = project(splats, i, s.camera, sharp, kernel);
        const auto b = project(splats, i, s.camera, unscented, kernel);
        const auto c = project(splats, i, s.camera, by_auto, kernel);
        if (a.cull != Cull::none) continue;
        ++seen;
        EXPECT_NEAR(a.mean_px.x, b.mean_px.x, 1e-4);
        EXPECT_NEAR(a.l11 / b.l11, 1, 1e-4);
        EXPECT_NEAR(a.l22 / b.l22, 1, 1e-4);
        EXPECT_NEAR(a.depth_deviation / b.depth_deviation, 1, 1e-3);
        EXPECT_EQ(a.l21, c.l21);
        EXPECT_EQ(a.mean_px, c.mean_px);
    }
    EXPECT_GT(seen, 15U);
}

/// Sum of |footprint - integrated| over the integrated one's sum, on a grid of pixels that reaches
/// four standard deviations.
double footprint_error(const Splats<double>& splats, const Camera& camera, int projection) {
    RenderSettings settings;
    settings.projection = projection;
    settings.low_pass = 1e-9;
    const auto p =
        project(splats, 0, camera, settings, kernel_table(splats.kernel, Footprint::psi));
    EXPECT_EQ(p.cull, Cull::none);
    settings.projection = PROJECTION_JACOBIAN;
    const auto centre =
        project(splats, 0, camera, settings, kernel_table(splats.kernel, Footprint::psi));
    double off = 0, all = 0;
    constexpr int kSide = 21;
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
            const glm::dvec2 share(2.0 * x / (kSide - 1) - 1, 2.0 * y / (kSide - 1) - 1);
            const glm::dvec2 pixel =
                centre.mean_px +
                4.0 * share * glm::dvec2(std::sqrt(centre.cov_xx), std::sqrt(centre.cov_yy));
            const double truth = integrated_footprint(splats, 0, camera, pixel);
            const glm::dvec2 d = p.mean_px - pixel;
            const double u = p.l11 * d.x + p.l21 * d.y, v = p.l22 * d.y;
            off += std::abs(std::exp(-0.5 * (u * u + v * v)) - truth);
            all += truth;
        }
    return off / all;
}

struct SplatAt {
    double angle, size;  // degrees off the axis; standard deviation over the distance
};
std::pair<double, double> errors_at(const SplatAt& at, const LensTerms& lens) {
    Camera camera;
    camera.width = camera.height = 1000;
    camera.fx = camera.fy = 300;
    camera.cx = camera.cy = 500;
    camera.lens = lens;
    const double angle = at.angle * 3.14159265358979 / 180;
    Splats<double> splats = make_splats<double>(scene_of(1).model);
    for (int a = 0; a < kAttributeCount; ++a) {
        auto& values = attribute_values(splats, a);
        values.resize(values.size() / 40);
    }
    splats.position = {std::sin(angle), 0, std::cos(angle)};
    splats.log_scale.assign(3, std::log(at.size));
    splats.rotation = {std::cos(angle / 2), 0, std::sin(angle / 2), 0};
    splats.opacity_logit = {3};
    return {footprint_error(splats, camera, PROJECTION_JACOBIAN),
            footprint_error(splats, camera, PROJECTION_UNSCENTED)};
}

// The figures of docs/experiments/wide_lens.md.
TEST(ReferenceSigmaPoints, errors_against_the_integrated_footprint) {
    LensTerms fisheye, barrel;
    fisheye.active = barrel.active = true;
    fisheye.front_tan = fisheye.front_scale = 1;
    fisheye.fold = 3;
    fisheye.ray_min = glm::dvec2(-9);
    fisheye.ray_max = glm::dvec2(9);
    barrel.k = {-0.2, 0.06, 0, 0, 0, 0};
    barrel.fold = 1.5;
    barrel.ray_min = glm::dvec2(-2);
    barrel.ray_max = glm::dvec2(2);
    struct Row {
        double angle;
        std::array<double, 6> percent;  // of Jacobian and sigma points at sizes 0.03, 0.1 and 0.2
    };
    const auto check = [](const char* name, const LensTerms& lens, const std::vector<Row>& rows) {
        constexpr std::array kSizes = {0.03, 0.1, 0.2};
        for (const Row& row : rows)
            for (std::size_t i = 0; i < kSizes.size(); ++i) {
                const auto [jacobian, unscented] = errors_at({row.angle, kSizes[i]}, lens);
                EXPECT_NEAR(100 * jacobian, row.percent[2 * i], 0.06) << name << row.angle;
                EXPECT_NEAR(100 * unscented, row.percent[2 * i + 1], 0.06) << name << row.angle;
            }
    };
    check("pinhole", {},
          {{0, {0.4, 0.4, 4.1, 4.1, 17.0, 17.0}},
           {30, {4.2, 3.0, 14.5, 10.9, 31.6, 25.9}},
           {45, {7.2, 5.2, 24.5, 18.5, 47.9, 38.5}}});
    check("barrel", barrel,
          {{0, {0.2, 0.3, 2.4, 3.6, 10.1, 14.3}},
           {30, {1.5, 1.3, 5.8, 5.4, 17.0, 17.1}},
           {45, {6.2, 4.5, 21.5, 17.0, 27.7, 27.7}}});
    check("fisheye", fisheye,
          {{0, {0.1, 0.3, 1.4, 3.3, 5.8, 12.7}},
           {30, {0.1, 0.5, 1.4, 3.4, 5.8, 12.8}},
           {45, {0.1, 0.7, 1.4, 3.8, 5.9, 13.1}},
           {70, {0.2, 1.1, 1.5, 4.9, 10.1, 10.1}}});
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
