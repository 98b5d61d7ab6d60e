// SPDX-License-Identifier: MIT
// median_depth.comp against the reference in double, for every kernel and reading.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/core/error.h"
#include "engine/reference/reference_depth.h"
#include "engine/reference/reference_render.h"
#include "engine/render/renderer.h"
#include "tests/support/every_kernel.h"
#include "tests/support/shared_device.h"
#include "tests/support/test_lenses.h"
#include "tests/support/test_scene.h"

namespace darb::test {
namespace {

using reference::Reading;

struct Agreement {
    size_t surfaces = 0, wrong = 0;
    double worst = 0;  // light beyond the level, of those that are wrong
};

/// A depth is right where the light left passes the level within `reach` of it, up to `light`.
Agreement compare_depths(const TestScene& s, const ImageF& got, Reading reading, double level,
                         const reference::RenderSettings& settings) {
    constexpr double kLight = 1e-4, kReach = 2e-5;  // reach: of the depth, what float32 leaves
    const auto truth = reference::render(s.model, s.camera, settings);
    const auto& table = reference::kernel_table(s.model.kernel, s.model.footprint);
    Agreement a;
    for (int y = 0; y < s.camera.height; ++y)
        for (int x = 0; x < s.camera.width; ++x) {
            const auto slices =
                reference::ray_slices(truth.tiles, truth.projected, x, y, table, settings);
            double end = 1;
            for (const auto& slice : slices) end *= 1 - slice.alpha;
            if (std::abs(end - level) < 1e-4) continue;  // on the limit
            const double depth = got.at(x, y, 0);
            EXPECT_NEAR(got.at(x, y, 1), 1 - end, 1e-4);
            EXPECT_EQ(depth > 0, end <= level) << x << ", " << y;
            if (depth <= 0 || end > level) continue;
            ++a.surfaces;
            const double before =
                light_left(slices, depth * (1 - kReach), reading, table, settings);
            const double behind =
                light_left(slices, depth * (1 + kReach), reading, table, settings);
            const double near = depth <= settings.near_z * (1 + kReach) ? 0 : level - before;
            const double off = std::max(near, behind - level);
            if (off <= kLight) continue;
            ++a.wrong;
            a.worst = std::max(a.worst, off);
        }
    return a;
}

TestScene depth_scene(int kernel, Footprint footprint) {
    TestScene s = random_scene({.count = 250,
                                .width = 40,
                                .height = 36,
                                .kernel = kernel,
                                .footprint = footprint,
                                .sh_degree = 0,
                                .min_log_scale = -3.5,
                                .max_log_scale = -0.9,
                                .min_logit = -2,
                                .max_logit = 4});
    return s;
}

void expect_agreement(const TestScene& s, int reading, double level = 0.5,
                      const ProjectionEffects& effects = {}, int projection = PROJECTION_JACOBIAN) {
    Accuracy accuracy;
    accuracy.choice[kSplatProjection] = projection;
    reference::RenderSettings settings;
    settings.projection = projection;
    Renderer renderer(shared_device(), s.model, accuracy, effects);
    renderer.render(s.camera);
    const ImageF got = renderer.render_depth(static_cast<DepthReading>(reading), float(level));
    const Agreement a = compare_depths(s, got, static_cast<Reading>(reading), level, settings);
    EXPECT_GT(a.surfaces, 500u);
    // A splat whose alpha is the cut-off within rounding is drawn on one side alone, and where a
    // slice begins with a jump or a spike, T passes a thousandth of it within the last step.
    EXPECT_LE(a.wrong, a.surfaces / 50) << "worst " << a.worst;
}

class EveryDepthKernel : public testing::TestWithParam<int> {};

TEST_P(EveryDepthKernel, depth_leaves_half_of_the_light) {
    for (const int reading : {DEPTH_READING_FRONT, DEPTH_READING_SOLID, DEPTH_READING_PLANE}) {
        SCOPED_TRACE(kDepthReadings[reading]);
        expect_agreement(depth_scene(GetParam(), Footprint::psi), reading);
    }
}

INSTANTIATE_TEST_SUITE_P(Kernels, EveryDepthKernel, testing::ValuesIn(every_kernel()),
                         [](const auto& kernel) {
                             std::string name(kernel_name(kernel.param));
                             std::ranges::replace_if(
                                 name, [](char c) { return !std::isalnum(c); }, '_');
                             return name;
                         });

TEST(PointLight, is_that_of_the_reference) {
    for (const int kernel : {KERNEL_GAUSSIAN, KERNEL_RAISED_COSINE})
        for (const int reading : {DEPTH_READING_FRONT, DEPTH_READING_SOLID, DEPTH_READING_PLANE}) {
            SCOPED_TRACE(fmt::format("{} {}", kernel_name(kernel), kDepthReadings[reading]));
            const TestScene s = depth_scene(kernel, Footprint::psi);
            std::vector<ViewPoint> points;
            std::vector<double> expected;
            const auto truth = reference::render(s.model, s.camera, {});
            const auto& table = reference::kernel_table(s.model.kernel, s.model.footprint);
            for (int y = 0; y < s.camera.height; ++y)
                for (int x = 0; x < s.camera.width; ++x) {
                    const auto slices =
                        reference::ray_slices(truth.tiles, truth.projected, x, y, table, {});
                    if (slices.empty()) continue;
                    const auto& slice = slices[points.size() % slices.size()];
                    const double z = slice.mean + slice.deviation * (0.4 - double(x % 3));
                    points.push_back({static_cast<float>(x + 0.5), static_cast<float>(y + 0.5),
                                      static_cast<float>(z)});
                    expected.push_back(light_left(slices, points.back().depth,
                                                  static_cast<Reading>(reading), table, {}));
                }
            Renderer renderer(shared_device(), s.model);
            renderer.list(s.camera);
            const auto got = renderer.light_at(points, static_cast<DepthReading>(reading));
            size_t wrong = 0;
            double spread = 0;
            for (size_t i = 0; i < got.size(); ++i) {
                if (std::abs(got[i] - expected[i]) > 1e-4) ++wrong;
                spread = std::max(spread, expected[i] - expected[0]);
            }
            EXPECT_GT(points.size(), 500u);
            EXPECT_GT(spread, 0.1);
            EXPECT_LE(wrong, points.size() / 50);
            renderer.list(s.camera);
            EXPECT_EQ(got, renderer.light_at(points, static_cast<DepthReading>(reading)));
        }
}

TEST(MedianDepth, follows_the_level) {
    for (const double level : {0.2, 0.8})
        expect_agreement(depth_scene(KERNEL_GAUSSIAN, Footprint::psi), DEPTH_READING_FRONT, level);
}

TEST(MedianDepth, takes_exact_footprints_and_lenses) {
    TestScene s = depth_scene(KERNEL_RAISED_COSINE, Footprint::exact);
    expect_agreement(s, DEPTH_READING_FRONT);
    s.camera.lens = test_lenses().front().second;
    expect_agreement(s, DEPTH_READING_FRONT, 0.5, {.lens = true});
}

TEST(MedianDepth, takes_sigma_points) {
    for (const int reading : {DEPTH_READING_PLANE, DEPTH_READING_FRONT})
        expect_agreement(depth_scene(KERNEL_GAUSSIAN, Footprint::psi), reading, 0.5, {},
                         PROJECTION_UNSCENTED);
}

TEST(MedianDepth, leaves_half_of_the_light_in_long_lists) {
    // Splats beyond the picture's end change no depth, and make the lists too long for the search.
    TestScene s = random_scene(
        {.count = 40, .width = 20, .height = 18, .sh_degree = 0, .min_logit = 2, .max_logit = 4});
    SplatModel many = s.model;
    const size_t n = s.model.size(), copies = LIST_SEGMENT + MEDIAN_SEGMENT;
    many.resize(n + copies);
    for (size_t i = n; i < n + copies; ++i) {
        const glm::dvec3 place = s.camera.centre() + glm::transpose(s.camera.rotation) *
                                                         glm::dvec3(0, 0, 40 + 1e-3 * double(i));
        for (int c = 0; c < 3; ++c) many.position[3 * i + c] = static_cast<float>(place[c]);
        for (int c = 0; c < 3; ++c) many.log_scale[3 * i + c] = 2;
        many.rotation[4 * i] = 1;
        many.opacity_logit[i] = -3;
    }
    Renderer renderer(shared_device(), many);
    renderer.render(s.camera);
    EXPECT_GT(renderer.status().longest_list, LIST_SEGMENT);
    const ImageF got = renderer.render_depth(DepthReading::front);
    s.model = many;
    const Agreement a = compare_depths(s, got, Reading::front, 0.5, {});
    EXPECT_GT(a.surfaces, 50u);
    EXPECT_LE(a.wrong, a.surfaces / 50) << "worst " << a.worst;
}

TEST(MedianDepth, rings_refuse_all_but_planes) {
    TestScene s = depth_scene(KERNEL_GAUSSIAN, Footprint::psi);
    s.model.kernel = KERNEL_SINC_2_PULSES;
    Renderer renderer(shared_device(), s.model);
    renderer.render(s.camera);
    EXPECT_THROW(renderer.render_depth(DepthReading::front), Error);
    EXPECT_THROW(renderer.render_depth(DepthReading::solid), Error);
    expect_agreement(s, DEPTH_READING_PLANE);
}

}  // namespace
}  // namespace darb::test
