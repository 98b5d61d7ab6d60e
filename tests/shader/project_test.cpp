// SPDX-License-Identifier: MIT
// project.comp against the projection of the reference: every output, every reason to cull a splat,
// and hard parameters.
#include <limits>

#include "engine/core/rng.h"
#include "engine/reference/reference_render.h"
#include "tests/support/compare_arrays.h"
#include "tests/support/every_kernel.h"
#include "tests/support/projected_frame.h"
#include "tests/support/test_scene.h"

namespace darb::test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// The reference's result for each splat, including its tiles.
std::vector<reference::ProjectedSplat<double>> project_in_double(const SplatModel& model,
                                                                 const Camera& camera,
                                                                 int sh_degree = 3) {
    reference::RenderSettings settings;
    settings.sh_degree = sh_degree;
    const auto splats = reference::make_splats<double>(model);
    const auto& kernel = reference::kernel_table(model.kernel, model.footprint);
    std::vector<reference::ProjectedSplat<double>> all;
    for (size_t i = 0; i < model.size(); ++i)
        all.push_back(reference::project(splats, i, camera, settings, kernel));
    reference::make_tile_lists(camera.width, camera.height, all);
    return all;
}

/// Tests the factor by its purpose: q at points on the ellipse, where it is 1 in the reference. The
/// error of q there bounds that at every pixel, relative to its q.
double worst_q_error(const reference::ProjectedSplat<double>& truth, const glm::vec4& shape,
                     const glm::vec4& bound) {
    double worst = 0;
    for (int k = 0; k < 16; ++k) {
        const double angle = k * 3.14159265358979 / 8;
        const double dy = std::sin(angle) / truth.l22;
        const double dx = (std::cos(angle) - truth.l21 * dy) / truth.l11;
        const double x = shape.z * dx + shape.w * dy, y = bound.x * dy;
        worst = std::max(worst, std::abs(x * x + y * y - 1));
    }
    return worst;
}

struct Allowed {
    double q = 2e-5;         // relative
    double position = 2e-6;  // error of the mean, relative to its size in px and to the image
};

/// Compares all outputs of splats that both see; returns how many.
size_t expect_outputs_match(const SplatModel& model, const Camera& camera, int sh_degree = 3,
                            const Allowed& allowed = {}) {
    const ProjectedFrame frame = project_on_device(model, camera, sh_degree);
    const auto truth = project_in_double(model, camera, sh_degree);
    std::vector<double> light, got_light, depth, got_depth;
    size_t visible = 0;
    for (size_t i = 0; i < model.size(); ++i) {
        const auto& t = truth[i];
        EXPECT_EQ(frame.visible[i], frame.intersection_count[i] > 0 ? 1U : 0U) << "splat " << i;
        if (t.cull != reference::Cull::none) continue;
        EXPECT_EQ(frame.visible[i], 1U) << "splat " << i;
        if (frame.visible[i] != 1) continue;
        ++visible;
        for (int c = 0; c < 2; ++c)
            EXPECT_NEAR(frame.shape[i][c], t.mean_px[c],
                        allowed.position * (std::abs(t.mean_px[c]) + camera.width))
                << "splat " << i << " mean " << c;
        EXPECT_LE(worst_q_error(t, frame.shape[i], frame.bound[i]), allowed.q) << "splat " << i;
        EXPECT_GE(frame.bound[i].y, t.reach * (1 - 1e-6)) << "splat " << i;
        EXPECT_LE(frame.bound[i].y, t.reach * (1 + 1e-3) + 1e-3) << "splat " << i;
        for (int c = 0; c < 3; ++c) light.push_back(t.colour[c]);
        light.push_back(t.opacity);
        for (int c = 0; c < 4; ++c) got_light.push_back(frame.light[i][c]);
        depth.push_back(t.depth);
        got_depth.push_back(frame.bound[i].z);
    }
    EXPECT_TRUE(compare("light", light, got_light, tolerance("projection_float32"), 4));
    EXPECT_TRUE(compare("depth", depth, got_depth, tolerance("projection_float32")));
    return visible;
}

TEST(Project, every_kernel_and_footprint_matches_double) {
    for (const int kernel : every_kernel())
        for (const Footprint footprint : {Footprint::psi, Footprint::exact}) {
            if (footprint == Footprint::exact && !has_exact_footprint(kernel)) continue;
            SCOPED_TRACE(std::string(kernel_name(kernel)) + " " +
                         std::string(footprint_name(footprint)));
            const TestScene s = random_scene({.count = 200,
                                              .width = 150,
                                              .height = 90,
                                              .kernel = kernel,
                                              .footprint = footprint,
                                              .min_log_scale = -6,
                                              .max_log_scale = 0,
                                              .min_logit = -6,
                                              .max_logit = 8,
                                              .seed = 5});
            EXPECT_GT(expect_outputs_match(s.model, s.camera), 120U);
        }
}

TEST(Project, every_sh_degree_stored_and_used_matches_double) {
    for (int stored = 0; stored <= 3; ++stored)
        for (int used = 0; used <= stored; ++used) {
            SCOPED_TRACE(fmt::format("stored {}, used {}", stored, used));
            TestScene s = random_scene({.count = 100, .sh_degree = stored, .seed = 9});
            for (float& value : s.model.sh_rest) value *= 5;  // some colours clamp at 0
            EXPECT_GT(expect_outputs_match(s.model, s.camera, used), 70U);
        }
}

TEST(Project, wide_splats_outside_the_view_match_through_the_jacobian_clamp) {
    TestScene s = random_scene({.count = 400, .min_log_scale = -1, .max_log_scale = 1, .seed = 4});
    s.camera.cx = 3;  // far off the centre
    s.camera.cy = 30;
    for (size_t i = 0; i < s.model.size(); ++i)
        for (int c = 0; c < 3; ++c) s.model.position[i * 3 + c] *= 4;
    const auto splats = reference::make_splats<double>(s.model);
    size_t clamped = 0;
    const auto truth = project_in_double(s.model, s.camera);
    for (const auto& t : truth)
        if (t.cull == reference::Cull::none)
            clamped += t.mean_px.x < -0.15 * 32 || t.mean_px.x > 1.15 * 32 ||
                       t.mean_px.y < -0.15 * 24 || t.mean_px.y > 1.15 * 24;
    ASSERT_GT(clamped, 50U);
    // Far outside the view the footprint is that of the clamped direction, and x/z is large.
    EXPECT_GT(expect_outputs_match(s.model, s.camera, 3, {.q = 1e-4}), 100U);
}

TEST(Project, needles_and_discs_to_a_million_match_double) {
    for (const double ratio : {1e3, 1e4, 1e5, 1e6})
        for (const bool disc : {false, true}) {
            SCOPED_TRACE(fmt::format("ratio {} {}", ratio, disc ? "disc" : "needle"));
            TestScene s = random_scene({.count = 100, .width = 200, .height = 150, .seed = 6});
            const auto thin = static_cast<float>(-std::log(ratio));
            for (size_t i = 0; i < s.model.size(); ++i)
                for (int c = 0; c < 3; ++c)
                    s.model.log_scale[i * 3 + c] = (c == 0) == disc ? thin : 0.0f;
            EXPECT_GT(expect_outputs_match(s.model, s.camera, 3, {.q = 2e-3}), 90U);
        }
}

TEST(Project, quaternions_of_any_norm_match_double) {
    for (const double norm : {2e-6, 1e-3, 1.0, 1e5, 1e18, 1e25}) {
        SCOPED_TRACE(fmt::format("norm {}", norm));
        TestScene s = random_scene({.count = 60, .seed = 8});
        for (size_t i = 0; i < s.model.size(); ++i) {
            double square = 0;
            for (int c = 0; c < 4; ++c) square += std::pow(s.model.rotation[i * 4 + c], 2);
            for (int c = 0; c < 4; ++c)
                s.model.rotation[i * 4 + c] =
                    static_cast<float>(s.model.rotation[i * 4 + c] * norm / std::sqrt(square));
        }
        EXPECT_GT(expect_outputs_match(s.model, s.camera), 50U);
    }
}

TEST(Project, parameters_beyond_their_limits_act_as_at_the_limit) {
    TestScene s = random_scene({.count = 4, .seed = 2});
    for (size_t i = 0; i < 4; ++i) {
        for (int c = 0; c < 3; ++c) s.model.position[i * 3 + c] = 0.1f * static_cast<float>(i);
        const float side = i % 2 == 0 ? -1.0f : 1.0f;
        s.model.opacity_logit[i] = i < 2 ? 1e4f : kInfinity;
        for (int c = 0; c < 3; ++c) s.model.log_scale[i * 3 + c] = c == 0 && side < 0 ? -50.0f : -2;
    }
    EXPECT_EQ(expect_outputs_match(s.model, s.camera), 4U);
}

/// One ordinary splat in the middle of the view.
TestScene one_splat() {
    TestScene s = random_scene({.count = 1, .sh_degree = 1, .seed = 3});
    for (int c = 0; c < 3; ++c) {
        s.model.position[c] = 0;
        s.model.log_scale[c] = -2;
    }
    s.model.opacity_logit[0] = 1;
    return s;
}

/// The reason of a single splat; -1: visible.
int cull_reason(const TestScene& s, double low_pass = LOW_PASS_DEFAULT) {
    const ProjectedFrame frame =
        project_on_device(s.model, s.camera, 3, EVALUATION_POLYNOMIAL, {}, {0.0f}, low_pass);
    std::uint32_t sum = 0;
    int reason = -1;
    for (int r = 0; r < CULL_REASONS; ++r) {
        sum += frame.status.culled[r];
        if (frame.status.culled[r] > 0) reason = r;
    }
    EXPECT_EQ(sum + frame.visible[0], 1U);
    EXPECT_EQ(frame.intersection_count[0] > 0, reason < 0);
    return reason;
}

// Clamped to e^20, a splat has a determinant of 1e49 px^4, which float32 does not hold.
TEST(Project, the_largest_scales_are_clamped_and_cover_the_image) {
    for (const auto& scale :
         std::vector<std::vector<float>>{{50, 50, 50}, {50, 50, -3}, {14, 13, 15}, {50, 18, 2}}) {
        SCOPED_TRACE(fmt::format("log scale {} {} {}", scale[0], scale[1], scale[2]));
        TestScene s = one_splat();
        s.model.log_scale = scale;
        EXPECT_EQ(expect_outputs_match(s.model, s.camera), 1U);
        const auto tiles = static_cast<std::uint32_t>(image_tiles(s.camera.width, s.camera.height));
        EXPECT_EQ(project_on_device(s.model, s.camera).intersection_count[0], tiles);
    }
}

TEST(Project, each_cull_reason_is_counted) {
    EXPECT_EQ(cull_reason(one_splat()), -1);
    const auto expect = [](int reason, const char* what, const auto& change) {
        TestScene s = one_splat();
        change(s);
        EXPECT_EQ(cull_reason(s), reason) << what;
        const auto truth = project_in_double(s.model, s.camera)[0].cull;
        EXPECT_EQ(static_cast<int>(truth), reason + 1) << what << ", reference";
    };
    const auto at_depth = [](double z) {
        return [z](TestScene& s) { s.camera.translation = {0, 0, z}; };
    };
    expect(CULL_NEAR, "behind", at_depth(-1));
    expect(CULL_NEAR, "in the camera centre", at_depth(0));
    expect(CULL_NEAR, "just before the near plane", at_depth(0.1999));
    expect(-1, "just behind the near plane", at_depth(0.2001));
    const auto rotate = [](float value) {
        return [value](TestScene& s) { s.model.rotation.assign(4, value); };
    };
    expect(CULL_ROTATION, "zero quaternion", rotate(0));
    expect(CULL_ROTATION, "quaternion of norm 4e-7", rotate(2e-7f));
    expect(CULL_OPACITY, "faint", [](TestScene& s) { s.model.opacity_logit[0] = -5.6f; });
    expect(-1, "just visible", [](TestScene& s) { s.model.opacity_logit[0] = -5.5f; });
    expect(CULL_OPACITY, "-1e4", [](TestScene& s) { s.model.opacity_logit[0] = -1e4f; });
    expect(-1, "scale exp(50)", [](TestScene& s) { s.model.log_scale.assign(3, 50.0f); });
    TestScene point = one_splat();
    point.model.log_scale.assign(3, -20.0f);
    EXPECT_EQ(cull_reason(point), -1) << "a point, with the low-pass";
    EXPECT_EQ(cull_reason(point, 0), CULL_COVARIANCE) << "a point without area";
    expect(CULL_OUTSIDE, "beside the image", [](TestScene& s) { s.camera.cx += 200; });
    expect(CULL_OUTSIDE, "above the image", [](TestScene& s) { s.camera.cy -= 200; });
}

TEST(Project, values_that_are_not_finite_are_culled_with_their_reason) {
    const auto set = [](std::vector<float> SplatModel::*array, size_t index, float value) {
        TestScene s = one_splat();
        (s.model.*array)[index] = value;
        return cull_reason(s);
    };
    for (const float bad : {kNan, kInfinity, -kInfinity}) {
        SCOPED_TRACE(fmt::format("{}", bad));
        for (size_t c = 0; c < 3; ++c) {
            EXPECT_EQ(set(&SplatModel::position, c, bad), CULL_NEAR) << "position " << c;
            const int scale = set(&SplatModel::log_scale, c, bad);  // infinite: as at the limit
            EXPECT_EQ(scale, std::isnan(bad) ? CULL_COVARIANCE : -1) << "log_scale " << c;
            const int dc = set(&SplatModel::sh_dc, c, bad);
            EXPECT_EQ(dc, bad == -kInfinity ? -1 : CULL_COLOUR) << "sh_dc " << c;
        }
        for (size_t c = 0; c < 4; ++c)
            EXPECT_EQ(set(&SplatModel::rotation, c, bad), CULL_ROTATION) << "rotation " << c;
        EXPECT_EQ(set(&SplatModel::sh_rest, 0, kNan), CULL_COLOUR);
    }
    EXPECT_EQ(set(&SplatModel::opacity_logit, 0, kNan), CULL_OPACITY);
    EXPECT_EQ(set(&SplatModel::opacity_logit, 0, -kInfinity), CULL_OPACITY);
    EXPECT_EQ(set(&SplatModel::opacity_logit, 0, kInfinity), -1);
}

TEST(Project, zero_splats_write_nothing) {
    SplatModel empty;
    const TestScene s = one_splat();
    const ProjectedFrame frame = project_on_device(empty, s.camera);
    for (const std::uint32_t count : frame.status.culled) EXPECT_EQ(count, 0U);
}

}  // namespace
}  // namespace darb::test
