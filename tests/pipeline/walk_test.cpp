// SPDX-License-Identifier: MIT
// The whole walk on the device, splats to image and image gradient to every parameter, against the
// double-precision reference, for every kernel, footprint and evaluation, and each of them with
// every degree of the harmonics.
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <set>

#include "engine/core/rng.h"
#include "engine/reference/reference_render.h"
#include "tests/support/scoped_variants.h"
#include "tests/support/test_lenses.h"
#include "tests/support/test_walk.h"

namespace darb::test {
namespace {

struct Case {
    int kernel = KERNEL_GAUSSIAN;
    Footprint footprint = Footprint::psi;
    int evaluation = EVALUATION_POLYNOMIAL;
    int sh_degree = 3;
    std::string name() const {
        return std::string(kernel_name(kernel)) + "_" + std::string(footprint_name(footprint)) +
               (evaluation == EVALUATION_BUILTIN ? "_builtin" : "") +
               fmt::format("_sh{}", sh_degree);
    }
    /// Exact footprints of the kernels with a jump fall like a root at their edge: the slope there
    /// grows without bound, and a rounding of q is a percent of it.
    bool steep_edge() const {
        return footprint == Footprint::exact &&
               (kernel == KERNEL_INVERSE_QUADRATIC || kernel == KERNEL_INVERSE_MULTIQUADRIC);
    }
};
void PrintTo(const Case& c, std::ostream* out) {
    *out << c.name();
}

Image<double> random_weights(const Camera& camera) {
    Pcg32 random(3);
    Image<double> weights(camera.width, camera.height, 3);
    for (double& w : weights.data) w = static_cast<float>(random.uniform(-1, 1));
    return weights;
}

void expect_walk_matches(const TestScene& scene, const WalkSettings& settings,
                         const Tolerance& gradient) {
    const Image<double> weights = random_weights(scene.camera);
    const DeviceWalk walk = walk_on_device(scene.model, scene.camera, weights, settings);
    reference::RenderSettings raster;
    for (int c = 0; c < 3; ++c) raster.background[c] = settings.background[c];
    raster.sh_degree = settings.sh_degree;
    const reference::RenderResult truth = reference::render(scene.model, scene.camera, raster);
    ASSERT_GT(walk.status.visible, scene.model.size() / 2);
    ASSERT_GT(walk.status.intersections, walk.status.visible);
    // The slack of the tile test may list a splat that reaches no pixel centre.
    EXPECT_GE(walk.status.visible, truth.visible_count());
    EXPECT_LE(walk.status.visible, truth.visible_count() + 1);
    EXPECT_EQ(walk.status.bad_gradients, 0U);
    EXPECT_TRUE(
        compare("image", truth.images.colour.data, walk.image.data, tolerance("image_float32"), 3));

    const reference::Gradients g =
        reference::backward(scene.model, scene.camera, raster, truth, weights);
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<double>& expected = attribute_values(g.splats, a);
        if (expected.empty()) continue;
        EXPECT_TRUE(
            compare_scaled(std::string("d_") + attribute_name(a), expected, walk.d[a], gradient));
    }
    EXPECT_TRUE(
        compare_scaled("mean gradient", g.mean_gradient_ndc, walk.mean_gradient_ndc, gradient));
}

class Walk : public testing::TestWithParam<Case> {};

TEST_P(Walk, random_scene_matches_double) {
    const Case& c = GetParam();
    const TestScene scene = random_scene({.count = 60,
                                          .width = 53,
                                          .height = 37,
                                          .kernel = c.kernel,
                                          .footprint = c.footprint,
                                          .sh_degree = c.sh_degree,
                                          .seed = 7});
    WalkSettings settings;
    settings.evaluation = c.evaluation;
    settings.background = {0.2f, 0.4f, 0.7f};
    expect_walk_matches(
        scene, settings,
        tolerance(c.steep_edge() ? "gradient_steep_float32" : "gradient_scaled_float32"));
}

std::vector<Case> all_cases() {
    std::vector<Case> cases;
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel)
        for (const Footprint footprint : {Footprint::psi, Footprint::exact})
            for (const int evaluation : {EVALUATION_POLYNOMIAL, EVALUATION_BUILTIN}) {
                const int degree = (kernel + 2 * static_cast<int>(footprint) + evaluation) % 4;
                cases.push_back({kernel, footprint, evaluation, degree});
            }
    return cases;
}

TEST(WalkCoverage, every_pair_of_choices_is_walked) {
    std::set<std::array<int, 4>> pairs;  // which two of the choices, and their values
    for (const Case& c : all_cases()) {
        const int choice[] = {c.kernel, static_cast<int>(c.footprint), c.evaluation, c.sh_degree};
        for (int a = 0; a < 4; ++a)
            for (int b = a + 1; b < 4; ++b) pairs.insert({a, b, choice[a], choice[b]});
    }
    constexpr size_t k = KERNEL_COUNT, f = 2, e = 2, sh = 4;
    EXPECT_EQ(pairs.size(), k * f + k * e + k * sh + f * e + f * sh + e * sh);
}

INSTANTIATE_TEST_SUITE_P(every_kernel, Walk, testing::ValuesIn(all_cases()),
                         [](const auto& c) { return c.param.name(); });

// Many layers of all opacities, small and large splats mixed, several thousand intersections, every
// degree.
class WalkDegree : public testing::TestWithParam<int> {};

TEST_P(WalkDegree, dense_scene_matches_double) {
    TestScene scene = random_scene({.count = 600,
                                    .width = 121,
                                    .height = 83,
                                    .kernel = KERNEL_RAISED_COSINE,
                                    .sh_degree = 3,
                                    .min_log_scale = -4.5,
                                    .max_log_scale = -1,
                                    .min_logit = -5,
                                    .max_logit = 6,
                                    .seed = 21});
    WalkSettings settings;
    settings.sh_degree = GetParam();
    expect_walk_matches(scene, settings, tolerance("gradient_scaled_float32"));
}

INSTANTIATE_TEST_SUITE_P(sh, WalkDegree, testing::Range(0, 4));

TEST(WalkCases, needles_and_discs_match_double) {
    for (const double ratio : {1e2, 1e4, 1e6})
        for (const bool disc : {false, true}) {
            SCOPED_TRACE(fmt::format("ratio {} {}", ratio, disc ? "disc" : "needle"));
            TestScene s = random_scene({.count = 60,
                                        .width = 121,
                                        .height = 83,
                                        .kernel = KERNEL_SINC,
                                        .sh_degree = 0,
                                        .seed = 55});
            const auto thin = static_cast<float>(-std::log(ratio));
            for (size_t i = 0; i < s.model.size(); ++i)
                for (int c = 0; c < 3; ++c)
                    s.model.log_scale[i * 3 + c] = (c == 0) == disc ? thin : 0.0f;
            expect_walk_matches(s, {}, tolerance("gradient_scaled_float32"));
        }
}

// Long on the screen: there, the factor times the rows would lose what the product keeps.
TEST(WalkCases, needles_across_the_picture_match_double) {
    TestScene s = random_scene(
        {.count = 40, .width = 121, .height = 83, .sh_degree = 0, .max_logit = 0, .seed = 57});
    for (size_t i = 0; i < s.model.size(); ++i)
        for (int c = 0; c < 3; ++c) s.model.log_scale[i * 3 + c] = c == 0 ? 3.0f : -8.0f;
    expect_walk_matches(s, {}, tolerance("gradient_scaled_float32"));
}

TEST(WalkCases, a_camera_with_a_lens_matches_double) {
    TestScene s = random_scene({.count = 60, .width = 53, .height = 37, .sh_degree = 1, .seed = 7});
    s.camera.lens = test_lenses()[2].second;
    expect_walk_matches(s, {}, tolerance("gradient_scaled_float32"));
}

TEST(WalkCases, backward_by_buckets_matches_double) {
    const ScopedVariants variants(shared_device(), "backward=buckets");
    const TestScene scene = random_scene(
        {.count = 600, .width = 121, .height = 83, .sh_degree = 1, .max_logit = 1, .seed = 21});
    expect_walk_matches(scene, {.background = {0.2f, 0.4f, 0.7f}},
                        tolerance("gradient_scaled_float32"));
}

// Runs at other vector widths are worth something only where the width takes effect.
TEST(Subgroup, size_is_that_of_the_vector_width) {
    const char* width = std::getenv("LP_NATIVE_VECTOR_WIDTH");
    if (width == nullptr || !shared_device().is_lavapipe()) return;
    EXPECT_EQ(shared_device().info().subgroup_size, std::stoul(width) / 32);
    EXPECT_EQ(blend_subgroup(shared_device()), std::stoul(width) / 32);
}

}  // namespace
}  // namespace darb::test
