// SPDX-License-Identifier: MIT
// Every accuracy setting on the device, images and gradients, against the double reference with the
// same settings: what is chosen is computed, and the way back is the derivative of what was chosen.
#include <gtest/gtest.h>

#include "engine/core/rng.h"
#include "engine/plan/accuracy.h"
#include "engine/reference/reference_render.h"
#include "tests/support/scoped_variants.h"
#include "tests/support/test_walk.h"

namespace darb::test {
namespace {

struct Chosen {
    std::string name;
    Accuracy accuracy;
    int kernel = KERNEL_GAUSSIAN;
};
void PrintTo(const Chosen& c, std::ostream* out) {
    *out << c.name;
}

std::vector<Chosen> every_choice() {
    std::vector<Chosen> all;
    for (const int kernel : {KERNEL_GAUSSIAN, KERNEL_RAISED_COSINE}) {
        const std::string prefix = std::string(kernel_name(kernel)) + "_";
        for (int s = 0; s < kAccuracyCount; ++s) {
            const AccuracySetting& setting = accuracy_settings()[s];
            if (s == kShDegree || s == kRenderScale) continue;  // no constant of the walk
            if (kernel != KERNEL_GAUSSIAN && s > kFootprint) continue;
            for (size_t i = 1; i < setting.choices.size(); ++i) {
                Chosen c{
                    prefix + std::string(setting.name) + "_" + std::string(setting.choices[i].name),
                    {},
                    kernel};
                std::replace_if(
                    c.name.begin(), c.name.end(), [](char x) { return x == '/' || x == '-'; }, '_');
                c.accuracy.choice[s] = static_cast<int>(i);
                all.push_back(std::move(c));
            }
        }
        for (int p = 0; p < kPresetCount; ++p)
            all.push_back({prefix + std::string(preset_name(p)), preset_accuracy(p), kernel});
    }
    return all;
}

reference::RenderSettings reference_settings(const ForwardOptions& options) {
    reference::RenderSettings raster;
    if (options.evaluation != EVALUATION_BUILTIN)
        raster.polynomial_degree = options.polynomial_degree;
    raster.alpha_cutoff = options.alpha_cutoff;
    raster.transmittance_stop = options.transmittance_stop;
    raster.storage = options.storage;
    raster.depth_order = options.depth_order;
    raster.projection = options.projection;
    raster.depth_window = DEPTH_WINDOW;
    return raster;
}

class EveryChoice : public testing::TestWithParam<Chosen> {};

TEST_P(EveryChoice, matches_the_double_reference_at_the_same_settings) {
    const Chosen& c = GetParam();
    TestScene scene = random_scene({.count = 120,
                                    .width = 93,
                                    .height = 61,
                                    .kernel = c.kernel,
                                    .sh_degree = 1,
                                    .min_log_scale = -3.5,
                                    .max_log_scale = -1,
                                    .min_logit = -3,
                                    .max_logit = 5,
                                    .seed = 33});
    const FrameAccuracy frame = frame_accuracy(c.accuracy, scene.model);
    scene.model.footprint = frame.footprint;
    const ForwardOptions& o = frame.options;
    WalkSettings settings;
    settings.evaluation = o.evaluation;
    settings.polynomial_degree = o.polynomial_degree;
    settings.storage = o.storage;
    settings.depth_order = o.depth_order;
    settings.projection = o.projection;
    settings.alpha_cutoff = o.alpha_cutoff;
    settings.transmittance_stop = o.transmittance_stop;
    settings.arithmetic = o.arithmetic;
    Image<double> weights;
    if (o.depth_order != DEPTH_ORDER_PIXEL) {
        Pcg32 random(3);
        weights = Image<double>(scene.camera.width, scene.camera.height, 3);
        for (double& w : weights.data) w = static_cast<float>(random.uniform(-1, 1));
    }
    const DeviceWalk walk = walk_on_device(scene.model, scene.camera, weights, settings);
    const reference::RenderSettings raster = reference_settings(o);
    const reference::RenderResult truth = reference::render(scene.model, scene.camera, raster);
    const bool half = o.storage == STORAGE_FLOAT16;
    const char* image = half ? "image_half" : "image_float32";
    if (o.depth_order == DEPTH_ORDER_PIXEL) image = "image_resorted";
    if (o.arithmetic == ARITHMETIC_FAST16) image = "image_fast16";
    EXPECT_TRUE(compare("image", truth.images.colour.data, walk.image.data, tolerance(image), 3));
    if (weights.data.empty()) return;

    const reference::Gradients g =
        reference::backward(scene.model, scene.camera, raster, truth, weights);
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<double>& expected = attribute_values(g.splats, a);
        if (expected.empty()) continue;
        EXPECT_TRUE(
            compare_scaled(std::string("d_") + attribute_name(a), expected, walk.d[a],
                           tolerance(o.arithmetic == ARITHMETIC_FAST16 ? "gradient_scaled_fast16"
                                     : half                            ? "gradient_scaled_half"
                                            : "gradient_scaled_float32")));
    }
}

INSTANTIATE_TEST_SUITE_P(settings, EveryChoice, testing::ValuesIn(every_choice()),
                         [](const auto& i) {
                             std::string name = i.param.name;
                             std::replace(name.begin(), name.end(), '.', '_');
                             return name;
                         });

double difference(const ImageF& a, const ImageF& b) {
    double largest = 0;
    for (size_t i = 0; i < a.data.size(); ++i)
        largest = std::max(largest, std::abs(double(a.data[i]) - b.data[i]));
    return largest;
}

// What changes nothing with one kernel: its footprints are one, or its polynomial is short anyway.
bool is_same(int kernel, int setting, const AccuracyChoice& choice) {
    if (setting == kFootprint)
        return kernel == KERNEL_GAUSSIAN || choice.value == FOOTPRINT_PSI;  // as the model says
    if (setting == kEvaluation && choice.value > 0) {
        const auto degree = [&](int most) {
            return kernel_coefficients(kernel, Footprint::psi, most).degree;
        };
        return degree(static_cast<int>(choice.value)) == degree(kFullDegree);
    }
    if (setting == kArithmetic) return !has_half_blend(kernel);
    return setting == kShDegree && choice.value == 3;
}

class EveryKernel : public testing::TestWithParam<int> {};

TEST_P(EveryKernel, every_choice_changes_the_picture) {
    const int kernel = GetParam();
    const TestScene scene = random_scene({.count = 4000,
                                          .width = 96,
                                          .height = 64,
                                          .kernel = kernel,
                                          .footprint = Footprint::psi,
                                          .min_log_scale = -4,
                                          .max_log_scale = -1,
                                          .min_logit = -3,
                                          .max_logit = 6,
                                          .seed = 41});
    Renderer plain(shared_device(), scene.model);
    const ImageF picture = plain.render(scene.camera);
    for (int s = 0; s < kAccuracyCount; ++s)
        for (size_t i = 1; i < accuracy_settings()[s].choices.size(); ++i) {
            Accuracy accuracy;
            accuracy.choice[s] = static_cast<int>(i);
            const AccuracyChoice& choice = accuracy.of(s);
            Renderer renderer(shared_device(), scene.model, accuracy);
            const double moved = difference(picture, renderer.render(scene.camera));
            if (is_same(kernel, s, choice))
                EXPECT_EQ(moved, 0) << accuracy_settings()[s].name << " " << choice.name;
            else
                EXPECT_GT(moved, 0) << accuracy_settings()[s].name << " " << choice.name;
        }
}

INSTANTIATE_TEST_SUITE_P(settings, EveryKernel,
                         testing::Values(KERNEL_GAUSSIAN, KERNEL_RAISED_COSINE));

// The device's choice of exp is that of `auto` alone, and of kernels that are exponentials.
TEST(Accuracy, auto_takes_the_drivers_exp_where_the_device_chose_it) {
    Accuracy polynomial, builtin;
    polynomial.choice[kEvaluation] = find_choice(kEvaluation, "polynomial");
    builtin.choice[kEvaluation] = find_choice(kEvaluation, "builtin");
    for (const int kernel :
         {KERNEL_GAUSSIAN, KERNEL_RAISED_COSINE, KERNEL_GENERALIZED_EXPONENTIAL, KERNEL_BETA}) {
        SCOPED_TRACE(kernel_name(kernel));
        const TestScene scene =
            random_scene({.count = 400, .width = 96, .height = 64, .kernel = kernel, .seed = 9});
        const auto drawn = [&](const Accuracy& accuracy, const std::string& exp) {
            const ScopedVariants variants(shared_device(), "exp=" + exp);
            return Renderer(shared_device(), scene.model, accuracy).render(scene.camera).data;
        };
        const auto exact = drawn(polynomial, "polynomial"), own = drawn(builtin, "polynomial");
        ASSERT_NE(exact, own);
        EXPECT_EQ(drawn({}, "polynomial"), exact);
        EXPECT_EQ(drawn(polynomial, "builtin"), exact);
        const bool exponential =
            kernel == KERNEL_GAUSSIAN || kernel == KERNEL_GENERALIZED_EXPONENTIAL;
        EXPECT_EQ(drawn({}, "builtin"), exponential ? own : exact);
        const ScopedVariants variants(shared_device(), "exp=builtin");
        EXPECT_EQ(changes_evaluation(shared_device(), builtin, kernel), !exponential);
        EXPECT_EQ(changes_evaluation(shared_device(), polynomial, kernel), exponential);
    }
}

// Splats that lie one after another at every pixel keep their order whatever sorts them; two that
// cross do not.
TEST(Accuracy, resorting_shows_the_nearer_of_two_crossing_splats) {
    SplatModel m;
    m.sh_degree = 0;
    const float half_turn = 0.38268343f, cosine = 0.92387953f;  // 45 degrees about y
    for (const float sign : {1.0f, -1.0f}) {
        m.position.insert(m.position.end(), {0, 0, sign * 1e-3f});
        m.log_scale.insert(m.log_scale.end(), {0.0f, 0.0f, -4.0f});
        m.rotation.insert(m.rotation.end(), {cosine, 0, sign * half_turn, 0});
        m.opacity_logit.push_back(8);
        m.sh_dc.insert(m.sh_dc.end(), {sign * 1.5f, 0, -sign * 1.5f});
    }
    Camera camera;
    camera.width = camera.height = 64;
    camera.fx = camera.fy = 64;
    camera.cx = camera.cy = 32;
    camera.translation = {0, 0, 4};
    Accuracy accuracy;
    accuracy.choice[kDepthOrder] = find_choice(kDepthOrder, "pixel");
    Renderer by_centre(shared_device(), m), by_pixel(shared_device(), m, accuracy);
    const ImageF centre = by_centre.render(camera), pixel = by_pixel.render(camera);
    const auto red = [](const ImageF& image, int x) { return image.at(x, 32, 0); };
    EXPECT_NEAR(red(centre, 24), red(centre, 40), 0.1) << "one is in front everywhere";
    EXPECT_GT(std::abs(red(pixel, 24) - red(pixel, 40)), 0.5) << "each is in front on its side";
}

TEST(Accuracy, half_resolution_keeps_a_smooth_picture_and_odd_sizes) {
    TestScene scene = random_scene({.count = 20,
                                    .width = 75,
                                    .height = 51,
                                    .sh_degree = 0,
                                    .min_log_scale = -1.5,
                                    .max_log_scale = -0.8,
                                    .seed = 5});
    Accuracy accuracy;
    accuracy.choice[kRenderScale] = find_choice(kRenderScale, "1/2");
    Renderer whole(shared_device(), scene.model), half(shared_device(), scene.model, accuracy);
    const ImageF a = whole.render(scene.camera), b = half.render(scene.camera);
    ASSERT_EQ(b.width, 75);
    ASSERT_EQ(b.height, 51);
    double sum = 0;
    for (size_t i = 0; i < a.data.size(); ++i) sum += std::abs(a.data[i] - b.data[i]);
    EXPECT_LT(sum / static_cast<double>(a.data.size()), 0.02) << "a shift of a pixel is more";
}

}  // namespace
}  // namespace darb::test
