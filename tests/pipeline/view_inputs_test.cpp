// SPDX-License-Identifier: MIT
// What a caller may give besides a model (plain opacities and scales, colours, a loss on the
// pixels' opacity) and what it may ask for (gradients by the background), against the double
// reference and its central differences.
#include <cmath>

#include "engine/core/error.h"
#include "engine/core/rng.h"
#include "engine/reference/reference_render.h"
#include "engine/render/render_gradients.h"
#include "tests/support/compare_images.h"
#include "tests/support/given_gradients.h"
#include "tests/support/test_walk.h"

namespace darb::test {
namespace {

TestScene small_scene(int kernel = KERNEL_GAUSSIAN, std::uint64_t seed = 41) {
    return random_scene({.count = 40, .width = 48, .height = 40, .kernel = kernel, .seed = seed});
}

/// The same splats with plain opacities and scales.
SplatModel linear_model(SplatModel model) {
    for (float& o : model.opacity_logit) o = static_cast<float>(sigmoid(o));
    for (float& s : model.log_scale) s = std::exp(s);
    return model;
}

void expect_gradients(const reference::Gradients& truth, const ViewGradients& view) {
    for (int a = 0; a < kAttributeCount; ++a) {
        if (attribute_values(truth.splats, a).empty()) continue;
        EXPECT_TRUE(compare_scaled(std::string("d_") + attribute_name(a),
                                   attribute_values(truth.splats, a), attribute_values(view.d, a),
                                   tolerance("gradient_scaled_float32")));
    }
    EXPECT_TRUE(compare_scaled(
        "d_background", std::vector{truth.background.x, truth.background.y, truth.background.z},
        std::vector{view.d_background.x, view.d_background.y, view.d_background.z},
        tolerance("gradient_scaled_float32")));
}

TEST(ViewInputs, a_loss_of_opacity_and_background_is_as_in_double) {
    for (const BackwardBlend method : {BackwardBlend::subgroup, BackwardBlend::team,
                                       BackwardBlend::buckets, BackwardBlend::pixels}) {
        Device& device = shared_device();
        const Tuning before = device.tuning();
        Tuning tuning = before;
        tuning.backward = method;
        device.set_tuning(tuning);
        const TestScene scene = small_scene(KERNEL_RAISED_COSINE);
        const ImageF weights = random_image(scene.camera, 3, 5);
        const ImageF alpha_weights = random_image(scene.camera, 1, 6);
        GradientRenderer renderer(device, scene.model);
        renderer.render(scene.camera, kBackground);
        const ImageF alpha = renderer.alpha();
        const ViewGradients view = renderer.backward(weights, alpha_weights);
        device.set_tuning(before);
        const auto result = reference::render(scene.model, scene.camera, truth_settings());
        std::vector<double> opacity;
        for (const double t : result.images.transmittance.data) opacity.push_back(1 - t);
        EXPECT_TRUE(compare_scaled("alpha", opacity, alpha.data, tolerance("image_float32")));
        expect_gradients(reference::backward(scene.model, scene.camera, truth_settings(), result,
                                             widened(weights), widened(alpha_weights)),
                         view);
    }
}

TEST(ViewInputs, opacities_and_scales_themselves_have_gradients_of_their_own) {
    const TestScene scene = small_scene();
    const ImageF weights = random_image(scene.camera, 3, 7);
    const SplatModel linear = linear_model(scene.model);
    GradientRenderer renderer(shared_device(), linear, {.linear_values = true});
    const ImageF image = renderer.render(scene.camera, kBackground);
    const ViewGradients view = renderer.backward(weights);
    const auto result = reference::render(scene.model, scene.camera, truth_settings());
    EXPECT_TRUE(
        compare_scaled("image", result.images.colour.data, image.data, tolerance("image_float32")));
    reference::Gradients truth =
        reference::backward(scene.model, scene.camera, truth_settings(), result, widened(weights));
    for (size_t i = 0; i < scene.model.size(); ++i) {
        const double o = sigmoid(scene.model.opacity_logit[i]);
        truth.splats.opacity_logit[i] /= o * (1 - o);
    }
    for (size_t i = 0; i < scene.model.log_scale.size(); ++i)
        truth.splats.log_scale[i] /= std::exp(double(scene.model.log_scale[i]));
    expect_gradients(truth, view);
}

TEST(ViewInputs, opacities_of_0_and_1_are_no_limits_of_the_gradient) {
    TestScene scene = random_scene({.count = 1, .sh_degree = 0, .seed = 3});
    scene.model.position = {0, 0, 0};
    SplatModel linear = linear_model(scene.model);
    const ImageF weights = random_image(scene.camera, 3, 8);
    std::vector<double> d;
    for (const float opacity : {0.5f, 1.0f}) {
        linear.opacity_logit[0] = opacity;
        GradientRenderer renderer(shared_device(), linear, {.linear_values = true});
        renderer.render(scene.camera);
        const ViewGradients view = renderer.backward(weights);
        ASSERT_EQ(view.status.visible, 1u);
        d.push_back(view.d.opacity_logit[0]);
    }
    EXPECT_NE(d[1], 0) << "at 1, where a logit has no slope";
    linear.opacity_logit[0] = 0;
    GradientRenderer renderer(shared_device(), linear, {.linear_values = true});
    EXPECT_EQ(renderer.render(scene.camera).at(16, 12, 0), 0) << "a splat that is not there";
}

// A picture is linear in its colours, so that differences of any size are exact.
TEST(ViewInputs, colours_of_their_own_may_be_negative) {
    const TestScene scene = random_scene({.count = 30, .sh_degree = 0, .seed = 42});
    SplatModel model = scene.model;
    Pcg32 rng(9);
    for (float& c : model.sh_dc) c = static_cast<float>(rng.uniform(-1, 1));
    const GradientOptions options{.direct_colour = true};
    GradientRenderer renderer(shared_device(), model, options);
    const ImageF before = renderer.render(scene.camera);
    const ImageF weights = random_image(scene.camera, 3, 10);
    const ViewGradients view = renderer.backward(weights);
    SplatModel moved = model;
    double wanted = 0, got = 0;
    for (size_t i = 0; i < model.sh_dc.size(); ++i) {
        const auto step = static_cast<float>(rng.uniform(-1, 1));
        moved.sh_dc[i] += step;
        wanted += double(step) * view.d.sh_dc[i];
    }
    renderer.replace(moved);
    const ImageF after = renderer.render(scene.camera);
    for (size_t i = 0; i < before.data.size(); ++i)
        got += double(weights.data[i]) * (after.data[i] - before.data[i]);
    EXPECT_LT(*std::min_element(before.data.begin(), before.data.end()), -0.01f);
    EXPECT_NEAR(got, wanted, 2e-4 * std::abs(wanted) + 1e-4);
    EXPECT_THROW(GradientRenderer(shared_device(), small_scene().model, options), Error)
        << "harmonics beside colours";
}

TEST(ViewInputs, other_splats_take_the_place_of_those_on_the_device) {
    const TestScene scene = small_scene();
    const TestScene fewer = random_scene({.count = 7, .width = 48, .height = 40, .seed = 44});
    GradientRenderer renderer(shared_device(), scene.model);
    const ImageF first = renderer.render(scene.camera);
    renderer.replace(fewer.model);
    EXPECT_EQ(renderer.count(), 7u);
    EXPECT_EQ(renderer.render(scene.camera).data,
              GradientRenderer(shared_device(), fewer.model).render(scene.camera).data);
    EXPECT_EQ(renderer.backward(first).d.opacity_logit.size(), 7u);
    renderer.replace(scene.model);
    EXPECT_EQ(renderer.render(scene.camera).data, first.data);
    SplatModel cosine = scene.model;
    cosine.kernel = KERNEL_RAISED_COSINE;
    EXPECT_THROW(renderer.replace(cosine), Error);
}

TEST(ViewInputs, values_come_from_where_a_caller_has_them) {
    const TestScene scene = small_scene();
    SplatModel moved = scene.model;
    for (int a = 0; a < kAttributeCount; ++a)
        for (float& value : attribute_values(moved, a)) value += 0.1f;
    GradientRenderer renderer(shared_device(), scene.model);
    EXPECT_TRUE(renderer.holds(moved.size(), moved.sh_degree));
    EXPECT_FALSE(renderer.holds(moved.size() + 1, moved.sh_degree));
    const ImageF wanted = GradientRenderer(shared_device(), moved).render(scene.camera);
    GivenValues given;
    for (size_t a = 0; a < kAttributeCount; ++a)
        given.attributes[a] = attribute_values(moved, static_cast<int>(a));
    const auto any = [](int, std::span<const float>) { return true; };
    EXPECT_TRUE(renderer.set_values(given, any));
    EXPECT_EQ(renderer.render(scene.camera).data, wanted.data);

    const size_t rest = moved.sh_rest.size() / moved.size();
    std::vector<float> bands;
    for (size_t i = 0; i < moved.size(); ++i) {
        bands.insert(bands.end(), &moved.sh_dc[3 * i], &moved.sh_dc[3 * i] + 3);
        bands.insert(bands.end(), &moved.sh_rest[rest * i], &moved.sh_rest[rest * i] + rest);
    }
    given.attributes[kShDc] = given.attributes[kShRest] = {};
    given.harmonics = bands;
    renderer.replace(scene.model);
    EXPECT_TRUE(renderer.set_values(given, any));
    EXPECT_EQ(renderer.render(scene.camera).data, wanted.data);
    for (const int refused : {int(kPosition), int(kShDc)})
        EXPECT_FALSE(renderer.set_values(
            given, [&](int attribute, std::span<const float>) { return attribute != refused; }));
    for (float& value : {std::ref(bands.front()), std::ref(bands.back()), std::ref(bands[20])}) {
        const float kept = std::exchange(value, std::nanf(""));
        EXPECT_FALSE(renderer.set_values(given, any));
        value = -std::numeric_limits<float>::infinity();
        EXPECT_FALSE(renderer.set_values(given, any));
        value = kept;
    }
    moved.opacity_logit.back() = std::numeric_limits<float>::infinity();
    EXPECT_FALSE(renderer.set_values(given, any));
    moved.position.pop_back();
    given.attributes[kPosition] = moved.position;
    EXPECT_THROW(renderer.set_values(given, any), Error);
}

TEST(ViewInputs, depths_are_those_of_the_renderer) {
    const TestScene scene = small_scene();
    GradientRenderer renderer(shared_device(), scene.model);
    const ImageF weights = renderer.render(scene.camera);
    Renderer other(shared_device(), scene.model);
    other.render(scene.camera);
    EXPECT_EQ(renderer.depth().data, other.render_depth().data);
    EXPECT_THROW(renderer.backward(weights), Error) << "the picture is gone";
}

TEST(ViewInputs, mistakes_of_the_caller_are_errors) {
    TestScene scene = small_scene();
    GradientRenderer renderer(shared_device(), scene.model, {.camera = true});
    const ImageF weights = renderer.render(scene.camera);
    EXPECT_THROW(renderer.backward(weights, ImageF(3, 3, 1)), Error);
    ImageF alpha = random_image(scene.camera, 1, 1);
    alpha.data[5] = std::nanf("");
    EXPECT_THROW(renderer.backward(weights, alpha), Error);
    alpha.data[5] = 0;
    EXPECT_NO_THROW(renderer.backward(weights, alpha));
    GradientOptions halved;
    halved.accuracy.choice[kRenderScale] = 1;
    EXPECT_THROW(GradientRenderer(shared_device(), scene.model, halved), Error);
}

}  // namespace
}  // namespace darb::test
