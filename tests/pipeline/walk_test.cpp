// The whole walk on the device, splats to image and image gradient to every parameter, against the
// double-precision reference.

#include <gtest/gtest.h>

#include "engine/core/rng.h"
#include "engine/reference/render.h"
#include "engine/render/backward.h"
#include "engine/render/renderer.h"
#include "tests/support/compare.h"
#include "tests/support/random_scene.h"

namespace darb {
namespace {

struct Walk {
    ImageF image;
    std::vector<std::vector<float>> gradients;  // by attribute
    std::vector<float> gradient_sum;
    gpu::FrameStatus status;
};

// One forward and backward pass on the device with dL/dimage = weights [3][H][W].
Walk run_walk(Device& device, const test::TestScene& scene, const std::vector<float>& weights,
              const glm::vec3& background, int evaluation) {
    ForwardOptions options;
    options.kernel = scene.model.kernel;
    options.footprint = scene.model.footprint;
    options.evaluation = evaluation;
    options.sh_stored = scene.model.sh_degree;
    options.store_for_backward = true;
    GpuSplats splats(device, scene.model, true);
    Forward forward(device, options);
    Backward backward(device, options, BackwardResult::store_gradient);
    const Camera& c = scene.camera;
    const gpu::CameraData data = camera_data(c, scene.model.origin);
    const Buffer cameras = upload_cameras(device, {data});
    Buffer d_image(device, "d_image", weights.size() * sizeof(float));
    d_image.upload(weights);
    forward.reserve(splats.count(), 100'000, c.width, c.height);
    backward.reserve(splats.count(), forward.pair_capacity());
    Commands commands(device);
    commands.begin();
    forward.record(commands, splats, cameras, 0, data, scene.model.sh_degree, background);
    backward.record(commands, forward, splats, d_image, cameras, 0, data, scene.model.sh_degree,
                    background, AdamStep{});
    commands.submit_and_wait();
    Walk walk;
    walk.status = forward.read_status();
    walk.image =
        planes_to_image(forward.image().download<float>(weights.size()), c.width, c.height);
    for (int a = 0; a < kAttributeCount; ++a) {
        const size_t n = size_t{splats.count()} * splats.stride(a);
        std::vector<float> moments = splats.moments(a).download<float>(n * 2), g(n);
        for (size_t i = 0; i < n; ++i) g[i] = moments[2 * i];
        walk.gradients.push_back(g);
    }
    walk.gradient_sum = backward.gradient_sum().download<float>(size_t{splats.count()} * 2);
    return walk;
}

struct Case {
    int kernel;
    Footprint footprint;
    int evaluation;
};

class WalkTest : public testing::TestWithParam<Case> {};

TEST_P(WalkTest, random_scene_matches_double) {
    const Case& p = GetParam();
    test::TestScene scene = test::random_scene({.count = 60,
                                                .width = 53,
                                                .height = 37,
                                                .kernel = p.kernel,
                                                .footprint = p.footprint,
                                                .seed = 7});
    const glm::vec3 background(0.2f, 0.4f, 0.7f);
    Device device;
    const size_t pixels = size_t(scene.camera.width) * scene.camera.height;
    Pcg32 random(3);
    std::vector<float> planes(pixels * 3);
    for (float& w : planes) w = static_cast<float>(random.uniform(-1, 1));
    const Walk walk = run_walk(device, scene, planes, background, p.evaluation);
    ASSERT_GT(walk.status.visible, 30u);
    ASSERT_GT(walk.status.pairs, 100u);

    reference::RenderSettings settings;
    for (int c = 0; c < 3; ++c) settings.background[c] = background[c];
    settings.sh_degree = scene.model.sh_degree;
    const reference::RenderResult truth = reference::render(scene.model, scene.camera, settings);
    EXPECT_TRUE(test::compare("image", truth.images.colour.data, walk.image.data,
                              test::tolerance("image_float32"), 3));
    Image<double> d_image(scene.camera.width, scene.camera.height, 3);
    for (size_t i = 0; i < pixels; ++i)
        for (size_t c = 0; c < 3; ++c) d_image.data[i * 3 + c] = planes[c * pixels + i];
    const reference::Gradients g =
        reference::backward(scene.model, scene.camera, settings, truth, d_image);
    const auto check = [&](const char* name, const std::vector<double>& expected, int attribute) {
        EXPECT_TRUE(test::compare(name, expected, walk.gradients[attribute],
                                  test::tolerance("gradient_float32"), 1));
    };
    check("d_position", g.splats.position, kPosition);
    check("d_log_scale", g.splats.log_scale, kLogScale);
    check("d_rotation", g.splats.rotation, kRotation);
    check("d_opacity", g.splats.opacity, kOpacity);
    check("d_sh_dc", g.splats.sh_dc, kShDc);
    check("d_sh_rest", g.splats.sh_rest, kShRest);
    std::vector<float> norms;
    for (size_t i = 0; i < scene.model.size(); ++i) norms.push_back(walk.gradient_sum[2 * i]);
    EXPECT_TRUE(test::compare("mean gradient", g.mean_gradient_ndc, norms,
                              test::tolerance("gradient_float32"), 1));
}

std::vector<Case> all_cases() {
    std::vector<Case> cases;
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel)
        for (Footprint footprint : {Footprint::psi, Footprint::exact})
            for (int evaluation : {EVALUATION_POLYNOMIAL, EVALUATION_BUILTIN})
                cases.push_back({kernel, footprint, evaluation});
    return cases;
}

INSTANTIATE_TEST_SUITE_P(every_kernel, WalkTest, testing::ValuesIn(all_cases()),
                         [](const testing::TestParamInfo<Case>& param) {
                             return std::string(kernel_name(param.param.kernel)) + "_" +
                                    std::string(footprint_name(param.param.footprint)) +
                                    (param.param.evaluation == EVALUATION_BUILTIN ? "_builtin"
                                                                                  : "");
                         });

}  // namespace
}  // namespace darb
