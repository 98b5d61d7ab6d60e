// SPDX-License-Identifier: MIT
// The accuracy setting fast16: what device and which kernels take it, that it repeats bit for bit,
// and that its tolerances can fail. accuracy_walk_test holds it against double.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "engine/core/error.h"
#include "engine/core/rng.h"
#include "engine/gpu/faults.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/plan/accuracy.h"
#include "engine/reference/comparison.h"
#include "engine/reference/reference_render.h"
#include "tests/support/scoped_variants.h"
#include "tests/support/test_device_options.h"
#include "tests/support/test_walk.h"

namespace darb::test {
namespace {

Accuracy fast16() {
    Accuracy accuracy;
    accuracy.choice[kArithmetic] = find_choice(kArithmetic, "fast16", true);
    return accuracy;
}

struct HalfScene {
    TestScene scene = random_scene({.count = 500,
                                    .width = 121,
                                    .height = 83,
                                    .sh_degree = 1,
                                    .min_log_scale = -4,
                                    .max_log_scale = -1,
                                    .seed = 17});
    Image<double> weights{scene.camera.width, scene.camera.height, 3};

    HalfScene() {
        Pcg32 random(3);
        for (double& w : weights.data) w = static_cast<float>(random.uniform(-1, 1));
    }
    DeviceWalk walk(int arithmetic) const {
        WalkSettings settings;
        settings.arithmetic = arithmetic;
        return walk_on_device(scene.model, scene.camera, weights, settings);
    }
};

TEST(HalfBlend, repeats_bit_for_bit_whatever_the_tuning) {
    if (!shared_device().info().half_arithmetic) GTEST_SKIP() << "no half precision here";
    const HalfScene s;
    const DeviceWalk once = s.walk(ARITHMETIC_FAST16), again = s.walk(ARITHMETIC_FAST16);
    EXPECT_EQ(again.image.data, once.image.data);
    EXPECT_EQ(again.d, once.d);
    for (const char* form : {"backward=pixels4", "backward=buckets", "blend=records",
                             "tiles=longest", "lists=counts"}) {
        const ScopedVariants variants(shared_device(), form);
        const DeviceWalk walk = s.walk(ARITHMETIC_FAST16);
        EXPECT_EQ(walk.image.data, once.image.data) << form;
        EXPECT_EQ(walk.d, once.d) << form;
    }
    EXPECT_NE(s.walk(ARITHMETIC_FLOAT32).image.data, once.image.data);
}

// Lists of several dispatches, which keep the pixels' state between them.
TEST(HalfBlend, long_lists_come_out_as_whole_ones) {
    if (!shared_device().info().half_arithmetic) GTEST_SKIP() << "no half precision here";
    TestScene s = random_scene({.count = 50'000,
                                .width = 32,
                                .height = 32,
                                .sh_degree = 0,
                                .min_log_scale = -2,
                                .max_log_scale = -1,
                                .min_logit = -6,
                                .max_logit = -5,
                                .seed = 5});
    ForwardOptions options = forward_options(s.model, {});
    options.arithmetic = ARITHMETIC_FAST16;
    const auto drawn = [&](int arithmetic) {
        options.arithmetic = arithmetic;
        return Renderer(shared_device(), s.model, options).render(s.camera);
    };
    Renderer renderer(shared_device(), s.model, options);
    const ImageF half = renderer.render(s.camera);
    ASSERT_GT(renderer.status().longest_list, LIST_SEGMENT);
    const ImageF whole = drawn(ARITHMETIC_FLOAT32);
    for (std::size_t i = 0; i < half.data.size(); ++i)
        ASSERT_NEAR(half.data[i], whole.data[i], 0.03) << i;
}

TEST(HalfBlend, other_kernels_keep_float32) {
    for (const int kernel : {KERNEL_RAISED_COSINE, KERNEL_BETA, KERNEL_GENERALIZED_EXPONENTIAL,
                             blend_of(KERNEL_GAUSSIAN, KERNEL_RAISED_COSINE)}) {
        EXPECT_FALSE(has_half_blend(kernel)) << kernel_name(kernel);
        const TestScene s =
            random_scene({.count = 100, .width = 64, .height = 48, .kernel = kernel, .seed = 3});
        EXPECT_EQ(Renderer(shared_device(), s.model, fast16()).render(s.camera).data,
                  Renderer(shared_device(), s.model).render(s.camera).data)
            << kernel_name(kernel);
    }
    EXPECT_TRUE(has_half_blend(KERNEL_GAUSSIAN) && has_half_blend(KERNEL_GES_PUBLISHED));
    ForwardOptions options;
    options.arithmetic = ARITHMETIC_FAST16;
    EXPECT_TRUE(blends_in_half(options));
    options.depth_order = DEPTH_ORDER_PIXEL;
    EXPECT_FALSE(blends_in_half(options)) << "pixels are resorted in float32";
}

TEST(HalfBlend, a_device_without_half_precision_refuses_it_and_nothing_else) {
    DeviceOptions without = device_options();
    without.faults = parse_faults("no_half");
    Device device(without);
    EXPECT_FALSE(device.info().half_arithmetic);
    const TestScene s = random_scene({.count = 50, .width = 32, .height = 24, .sh_degree = 0});
    EXPECT_NO_THROW(Renderer(device, s.model).render(s.camera));
    try {
        Renderer(device, s.model, fast16()).render(s.camera);
        FAIL() << "drawn in half precision";
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("shaderFloat16"), std::string::npos) << e.what();
    }
}

// A picture whose opacities are 2 % off is not within the tolerance, nor are its gradients.
TEST(HalfBlend, tolerances_fail_where_alpha_is_wrong) {
    if (!shared_device().info().half_arithmetic) GTEST_SKIP() << "no half precision here";
    HalfScene s;
    const reference::RenderSettings raster;
    const auto truth = reference::render(s.scene.model, s.scene.camera, raster);
    const auto gradients =
        reference::backward(s.scene.model, s.scene.camera, raster, truth, s.weights);
    const DeviceWalk right = s.walk(ARITHMETIC_FAST16);
    const reference::Tolerance& image = reference::tolerance("image_fast16");
    EXPECT_TRUE(compare("image", truth.images.colour.data, right.image.data, image, 3));
    for (float& logit : s.scene.model.opacity_logit) {
        const double opacity = 0.98 / (1 + std::exp(-double{logit}));
        logit = static_cast<float>(std::log(opacity / (1 - opacity)));
    }
    const DeviceWalk wrong = s.walk(ARITHMETIC_FAST16);
    EXPECT_FALSE(compare("image", truth.images.colour.data, wrong.image.data, image, 3));
    EXPECT_FALSE(compare_scaled("d_opacity", attribute_values(gradients.splats, kOpacityLogit),
                                wrong.d[kOpacityLogit],
                                reference::tolerance("gradient_scaled_fast16")));
}

}  // namespace
}  // namespace darb::test
