// SPDX-License-Identifier: MIT
// Gradients of the camera: the device's in float against the double reference, and that against
// central differences of its own pictures, for every kernel and footprint, with lenses and with the
// projection's other effects.
#include <array>
#include <cmath>

#include "engine/core/rng.h"
#include "engine/raster/backward.h"
#include "engine/raster/camera_sums.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/reference/reference_render.h"
#include "engine/render/render_gradients.h"
#include "tests/support/camera_moves.h"
#include "tests/support/given_gradients.h"
#include "tests/support/own_kernels.h"
#include "tests/support/test_lenses.h"
#include "tests/support/test_walk.h"

namespace darb::test {
namespace {

/// A camera moved along one of its degrees of freedom: turned about an axis of its own, moved, or
/// with another number of the pinhole or of the shutter.
Camera moved(Camera camera, int which, double h) {
    if (which < 3) {
        glm::dvec3 axis(0.0);
        axis[which] = std::sin(h / 2);
        const glm::dmat3 turn = reference::rotation_of(std::cos(h / 2), axis.x, axis.y, axis.z);
        camera.rotation = turn * camera.rotation;
        camera.translation = turn * camera.translation;
    } else if (which < 6) {
        camera.translation[which - 3] += h;
    } else if (which < 10) {
        double* const numbers[] = {&camera.fx, &camera.fy, &camera.cx, &camera.cy};
        *numbers[which - 6] += h;
    } else {
        (which < 13 ? camera.shutter.turn : camera.shutter.move)[(which - 10) % 3] += h;
    }
    return camera;
}

/// sum of weights times picture and opacity.
struct WeightedLoss {
    Image<double> d_image, d_alpha;

    explicit WeightedLoss(const Camera& camera) {
        for (auto [image, channels, seed] : {std::tuple{&d_image, 3, 11}, {&d_alpha, 1, 12}}) {
            const ImageF weights = random_image(camera, channels, std::uint64_t(seed));
            *image = Image<double>(camera.width, camera.height, channels);
            image->data.assign(weights.data.begin(), weights.data.end());
        }
    }
    double of(const reference::RenderResult& r) const {
        double sum = 0;
        for (size_t i = 0; i < d_image.data.size(); ++i)
            sum += d_image.data[i] * r.images.colour.data[i];
        for (size_t i = 0; i < d_alpha.data.size(); ++i)
            sum += d_alpha.data[i] * (1 - r.images.transmittance.data[i]);
        return sum;
    }
};

reference::RenderSettings truth_by(int projection) {
    reference::RenderSettings settings = truth_settings();
    settings.projection = projection;
    return settings;
}

std::vector<double> exact_gradient(const TestScene& scene, int projection) {
    const WeightedLoss loss(scene.camera);
    const reference::RenderSettings settings = truth_by(projection);
    const auto result = reference::render(scene.model, scene.camera, settings);
    const auto truth = reference::backward(scene.model, scene.camera, settings, result,
                                           loss.d_image, loss.d_alpha);
    return along_all(as_device(truth.camera), scene.camera);
}

/// Pictures jump across a cut-off, so a difference whose two pictures blend different samples is
/// left out.
void compare_differences(const TestScene& scene, int projection = PROJECTION_JACOBIAN) {
    const WeightedLoss loss(scene.camera);
    const std::vector<double> exact = exact_gradient(scene, projection);
    const reference::RenderSettings settings = truth_by(projection);
    const auto splats = reference::make_splats<double>(scene.model);
    int compared = 0;
    for (int which = 0; which < freedoms(scene.camera); ++which) {
        const double h = 1e-6;
        const auto above = reference::render(splats, moved(scene.camera, which, h), settings);
        const auto below = reference::render(splats, moved(scene.camera, which, -h), settings);
        if (above.images.contributions.data != below.images.contributions.data) continue;
        ++compared;
        const double difference = (loss.of(above) - loss.of(below)) / (2 * h);
        EXPECT_NEAR(exact[size_t(which)], difference, 1e-5 * std::abs(difference) + 1e-5) << which;
    }
    EXPECT_GE(compared, freedoms(scene.camera) / 2);
}

void compare_device(const TestScene& scene, int projection = PROJECTION_JACOBIAN) {
    const ImageF weights = random_image(scene.camera, 3, 11);
    const ImageF alpha_weights = random_image(scene.camera, 1, 12);
    Accuracy accuracy;
    accuracy.choice[kSplatProjection] = projection;
    GradientRenderer renderer(shared_device(), scene.model, {.accuracy = accuracy, .camera = true});
    renderer.render(scene.camera, kBackground);
    const ViewGradients view = renderer.backward(weights, alpha_weights);
    ASSERT_TRUE(view.d_camera.has_value());
    ASSERT_GT(view.status.visible, 3u);
    const std::vector<double> exact = exact_gradient(scene, projection);
    const std::vector<double> got = along_all(*view.d_camera, scene.camera);
    std::vector<std::tuple<const char*, int, int>> parts{{"turns", 0, 3},
                                                         {"translation", 3, 6},
                                                         {"focal lengths", 6, 8},
                                                         {"principal point", 8, 10}};
    if (scene.camera.shutter.active)
        parts.insert(parts.end(), {{"shutter's turn", 10, 13}, {"shutter's move", 13, 16}});
    for (const auto& [name, begin, end] : parts)
        EXPECT_TRUE(compare_scaled(name, std::vector(exact.begin() + begin, exact.begin() + end),
                                   std::vector(got.begin() + begin, got.begin() + end),
                                   tolerance("gradient_scaled_float32")));
}

TestScene scene_of(int kernel, Footprint footprint) {
    return random_scene({.count = 12,
                         .width = 40,
                         .height = 32,
                         .kernel = kernel,
                         .footprint = footprint,
                         .sh_degree = 2,
                         .seed = 43});
}

// Without the device, which must follow the reference for each of them.
TEST(CameraGradient, of_the_reference_is_its_differences_with_every_kernel) {
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel)
        for (const Footprint footprint : {Footprint::psi, Footprint::exact}) {
            SCOPED_TRACE(std::string(kernel_name(kernel)) + " " +
                         std::string(footprint_name(footprint)));
            compare_differences(scene_of(kernel, footprint));
        }
}

TEST(CameraGradient, of_the_device_is_that_of_the_reference) {
    compare_device(scene_of(KERNEL_GAUSSIAN, Footprint::psi));
    compare_device(scene_of(KERNEL_BETA, Footprint::exact));
}

TEST(CameraGradient, of_a_rolling_shutter_is_its_differences_and_the_devices) {
    for (const double fast : {1.0, 5.0}) {
        TestScene scene = scene_of(KERNEL_GAUSSIAN, Footprint::psi);
        scene.camera.shutter = {true, fast * glm::dvec3(0.02, -0.03, 0.02),
                                fast * glm::dvec3(0.03, 0.02, -0.03)};
        compare_differences(scene);
        compare_device(scene);
    }
}

TEST(CameraGradient, of_sigma_points_is_its_differences_and_the_devices) {
    for (const bool lens : {false, true})
        for (const bool shutter : {false, true}) {
            TestScene scene = scene_of(KERNEL_GAUSSIAN, Footprint::psi);
            if (lens) scene.camera.lens = test_lenses()[4].second;
            if (shutter) scene.camera.shutter = {true, {0.02, -0.03, 0.02}, {0.03, 0.02, -0.03}};
            compare_differences(scene, PROJECTION_UNSCENTED);
            compare_device(scene, PROJECTION_UNSCENTED);
        }
}

TEST(CameraGradient, of_the_device_is_that_of_the_reference_with_every_kernel_long) {
    std::vector<int> kernels = own_kernels();
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel) kernels.push_back(kernel);
    for (const int kernel : kernels)
        for (const Footprint footprint : {Footprint::psi, Footprint::exact}) {
            SCOPED_TRACE(std::string(kernel_name(kernel)) + " " +
                         std::string(footprint_name(footprint)));
            compare_device(scene_of(kernel, footprint));
        }
}

// Splats beside the picture reach into it, where the Jacobian is held.
TEST(CameraGradient, holds_beside_the_picture) {
    TestScene scene = random_scene({.count = 30, .width = 48, .height = 40, .seed = 43});
    scene.camera.fx *= 2.5;
    scene.camera.fy *= 2.5;
    compare_differences(scene);
    compare_device(scene);
}

TEST(CameraGradient, holds_with_anti_aliasing) {
    const TestScene scene = random_scene({.count = 20, .antialias = true, .seed = 45});
    compare_differences(scene);
    compare_device(scene);
}

TestScene scene_through(const LensTerms& lens) {
    TestScene scene = random_scene({.count = 20, .width = 48, .height = 40, .seed = 46});
    scene.camera.lens = lens;
    return scene;
}

TEST(CameraGradient, holds_through_a_lens) {
    for (const auto& [name, lens] : test_lenses()) {
        SCOPED_TRACE(name);
        compare_differences(scene_through(lens));
    }
    compare_device(scene_through(test_lenses().back().second));
}

TEST(CameraGradient, of_the_device_holds_through_every_lens_long) {
    for (const auto& [name, lens] : test_lenses()) {
        SCOPED_TRACE(name);
        compare_device(scene_through(lens));
    }
}

// As in training: the sums on the device equal those of the shares.
TEST(CameraSums, of_the_device_are_those_of_the_host) {
    Device& device = shared_device();
    CameraSums sums(device);
    Pcg32 rng(3);
    for (const std::uint32_t n : {1u, 63u, 64u, 1000u, 40'000u}) {
        std::vector<float> shares(size_t{n} * CAMERA_SHARES), d_position(size_t{n} * 3);
        for (float& v : shares) v = static_cast<float>(rng.normal());
        for (float& v : d_position) v = static_cast<float>(rng.normal());
        sums.reserve(n);
        Buffer positions(device, "d_position", d_position.size() * 4);
        positions.upload(d_position);
        sums.shares().upload(shares);
        Commands commands(device);
        std::array<double, CAMERA_SUMS> first{};
        for (int repeat = 0; repeat < 2; ++repeat) {
            commands.begin();
            sums.record(commands, n, positions);
            commands.submit_and_wait();
            if (repeat == 0) first = sums.read();
        }
        EXPECT_EQ(first, sums.read()) << "bit by bit";
        for (size_t k = 0; k < CAMERA_SUMS; ++k) {
            double sum = 0, size = 0;
            for (size_t i = 0; i < n; ++i) {
                const float v = k < CAMERA_SHARES ? shares[i * CAMERA_SHARES + k]
                                                  : d_position[i * 3 + k - CAMERA_SHARES];
                sum += double(v);
                size += std::abs(double(v));
            }
            EXPECT_NEAR(first[k], sum, 1e-6 * size) << n << " splats, " << k;
        }
    }
}

}  // namespace
}  // namespace darb::test
