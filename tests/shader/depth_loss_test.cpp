// SPDX-License-Identifier: MIT
// The loss of measured depths and the distortion: its pass against double; its gradient through
// blending, by every parameter and by the camera, against the reference, which is tested against
// differences; and smaller photos.
#include "trainer/step/step.h"

#include "engine/core/rng.h"
#include "engine/raster/backward.h"
#include "engine/raster/camera_sums.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/reference/reference_loss.h"
#include "engine/reference/reference_render.h"
#include "tests/support/camera_moves.h"
#include "tests/support/compare_arrays.h"
#include "tests/support/shared_device.h"
#include "tests/support/test_lenses.h"
#include "tests/support/test_scene.h"
#include "trainer/step/photos.h"

namespace darb::test {
namespace {

constexpr float kWeight = 0.5f;
constexpr double kUsual = 3;
constexpr float kDistortion = 0.7f;

/// uint [pixels] colours with every 7th pixel transparent, then float [pixels] depths with every
/// 5th not measured.
std::vector<std::uint32_t> measured_photo(std::size_t pixels) {
    Pcg32 random(31);
    std::vector<std::uint32_t> words(2 * pixels);
    for (std::size_t p = 0; p < pixels; ++p) {
        words[p] = p % 7 == 3 ? 0x00FFFFFFu : 0xFF808080u;
        const auto depth = p % 5 == 0 ? 0.0f : static_cast<float>(random.uniform(2, 6));
        std::memcpy(&words[pixels + p], &depth, 4);
    }
    return words;
}
float depth_of(const std::vector<std::uint32_t>& words, std::size_t p) {
    float depth;
    std::memcpy(&depth, &words[words.size() / 2 + p], 4);
    return depth;
}

/// Which of the terms take part.
struct Terms {
    bool measured = true, distortion = false;
};

/// dL/d(cover) and dL/d(sum w z) in double, and dL/d(sum w z z) in a second channel of sum.
struct DepthGradient {
    Image<double> cover, sum;
};
DepthGradient gradient_of_measured(const reference::RenderResult& r,
                                   const std::vector<std::uint32_t>& photo, bool use_alpha) {
    const Image<double>& t = r.images.transmittance;
    DepthGradient d{Image<double>(t.width, t.height, 1), Image<double>(t.width, t.height, 1)};
    const auto pixels = static_cast<double>(t.data.size());
    for (std::size_t p = 0; p < t.data.size(); ++p) {
        const double cover = 1 - t.data[p], measured = depth_of(photo, p);
        if (!(measured > 0) || cover < 0.5 || (use_alpha && photo[p] < 0x80000000u)) continue;
        const double depth = r.images.depth.data[p] / cover;
        const double sign = depth > measured ? 1 : -1;
        d.sum.data[p] = kWeight / (pixels * kUsual) * sign / cover;
        d.cover.data[p] = -d.sum.data[p] * depth;
    }
    return d;
}

DepthGradient gradient_in_double(const reference::RenderResult& r,
                                 const std::vector<std::uint32_t>& photo, const Terms& terms) {
    std::vector<bool> left_out;
    for (std::size_t p = 0; 2 * p < photo.size(); ++p) left_out.push_back(photo[p] < 0x80000000u);
    const auto distortion =
        reference::distortion(r.images, terms.distortion ? kDistortion : 0, left_out);
    DepthGradient d{distortion.d_alpha, distortion.d_depth};
    if (!terms.measured) return d;
    const DepthGradient measured = gradient_of_measured(r, photo, true);
    for (std::size_t p = 0; p < d.cover.data.size(); ++p) {
        d.cover.data[p] += measured.cover.data[p];
        d.sum.data[2 * p] += measured.sum.data[p];
    }
    return d;
}

/// Planes of gradients of sums of z from what stands for sums of z - z0, with z0 the last plane.
std::vector<double> planes_of_sums(const std::vector<float>& planes) {
    const std::size_t pixels = planes.size() / 4;
    std::vector<double> all(planes.begin(), planes.begin() + std::ptrdiff_t(3 * pixels));
    for (std::size_t p = 0; p < pixels; ++p) {
        const double first = planes[3 * pixels + p], by_square = all[2 * pixels + p];
        all[p] += first * (first * by_square - all[pixels + p]);
        all[pixels + p] -= 2 * first * by_square;
    }
    return all;
}

ForwardOptions depth_options(const ProjectionEffects& effects, bool spread) {
    ForwardOptions options;
    options.store_for_backward = options.depth_sum = options.camera_gradient = true;
    options.depth_spread = spread;
    options.effects = effects;
    return options;
}

void expect_gradients_match(const TestScene& scene, const ProjectionEffects& effects,
                            const Terms& terms = {}) {
    Device& device = shared_device();
    const ForwardOptions options = depth_options(effects, terms.distortion);
    FrameBuffers buffers(device, options);
    Forward forward(device, options);
    Backward backward(device, options);
    GpuSplats splats(device, scene.model, true);
    GradientBuffers gradients(device, splats);
    const auto pixels = static_cast<std::uint32_t>(scene.camera.width * scene.camera.height);
    const std::vector<std::uint32_t> words = measured_photo(pixels);
    Buffer photo(device, "photo", pixels * 8), d_image(device, "d_image", pixels * 28);
    photo.upload(words);
    const std::vector<float> zeros(3 * pixels, 0.0f);
    d_image.upload(zeros);
    FrameView view{camera_data(scene.camera, scene.model.origin)};
    const Buffer cameras = upload_cameras(device, {view.camera});
    view.cameras = &cameras;
    view.sh_degree = scene.model.sh_degree;
    buffers.reserve(splats.count(), 20'000, scene.camera.width, scene.camera.height);
    Frame& frame = buffers.frame();
    backward.reserve(splats.count(), buffers.size().intersections, frame.checkpoint_records());
    DepthLoss loss(device, {.measured = terms.measured, .spread = terms.distortion});
    CameraSums sums(device);
    sums.reserve(splats.count());
    Commands commands(device);
    commands.begin();
    forward.record(commands, splats, view, frame);
    loss.record(commands,
                {frame.images.image, frame.images.final_transmittance, photo, d_image, true},
                pixels, {kWeight, kUsual, kDistortion});
    backward.record_gradients(commands, view, frame, splats, d_image,
                              {gradients, false, &sums.shares()});
    sums.record(commands, splats.count(), gradients.of(kPosition));
    commands.submit_and_wait();
    ASSERT_EQ(frame.read_status().overflow, 0u);

    reference::RenderSettings settings;
    const auto truth = reference::render(scene.model, scene.camera, settings);
    const DepthGradient d = gradient_in_double(truth, words, terms);
    std::vector<double> planes = d.cover.data;
    for (std::size_t channel = 0; channel < (terms.distortion ? 2 : 1); ++channel)
        for (std::size_t p = 0; p < pixels; ++p) planes.push_back(d.sum.data[2 * p + channel]);
    const std::vector<float> behind =
        d_image.download<float>((terms.distortion ? 4 : 2) * pixels, 12 * pixels);
    EXPECT_GT(std::count_if(planes.begin(), planes.end(), [](double v) { return v != 0; }), 200);
    EXPECT_TRUE(compare_scaled("d_image", planes,
                               terms.distortion ? planes_of_sums(behind)
                                                : std::vector<double>(behind.begin(), behind.end()),
                               Tolerance{"d_image", 1e-3, 1e-4, 0.01}));
    const auto expected = reference::backward(
        scene.model, scene.camera, settings, truth,
        Image<double>(scene.camera.width, scene.camera.height, 3), d.cover, d.sum);
    for (const int a : {kPosition, kLogScale, kRotation, kOpacityLogit}) {
        const std::vector<double> values = attribute_values(expected.splats, a);
        std::vector<double> got;
        for (const float v : gradients.download(a)) got.push_back(v);
        EXPECT_TRUE(compare_scaled(std::string(attribute_name(a)), values, got,
                                   tolerance("gradient_scaled_float32")));
    }
    const auto turns_and_translation = [&](const CameraGradient& camera) {
        std::vector<double> all = along_all(camera, scene.camera);
        all.resize(6);
        return all;
    };
    const auto exact = turns_and_translation(as_device(expected.camera)),
               found = turns_and_translation(camera_gradient(scene.camera, sums.read()));
    for (const auto& [name, begin] : {std::pair{"turns", 0}, {"translation", 3}})
        EXPECT_TRUE(compare_scaled(name,
                                   std::vector(exact.begin() + begin, exact.begin() + begin + 3),
                                   std::vector(found.begin() + begin, found.begin() + begin + 3),
                                   tolerance("gradient_scaled_float32")));
    for (const float v : gradients.download(kShDc)) ASSERT_EQ(v, 0) << "depth moves no colour";
}

TEST(DepthLoss, gradients_of_every_parameter_match_double) {
    expect_gradients_match(random_scene({.count = 80, .width = 70, .height = 50, .seed = 12}), {});
}

TEST(DepthLoss, gradients_match_double_through_a_lens_with_antialiasing) {
    TestScene scene =
        random_scene({.count = 80, .width = 70, .height = 50, .antialias = true, .seed = 13});
    scene.camera.lens = test_lenses().front().second;
    expect_gradients_match(scene, {.antialias = true, .lens = true});
}

TEST(DepthLoss, gradients_of_the_distortion_match_double) {
    expect_gradients_match(random_scene({.count = 80, .width = 70, .height = 50, .seed = 12}), {},
                           {.measured = false, .distortion = true});
}

TEST(DepthLoss, gradients_of_both_match_double_through_a_lens_with_antialiasing) {
    TestScene scene =
        random_scene({.count = 80, .width = 70, .height = 50, .antialias = true, .seed = 13});
    scene.camera.lens = test_lenses().front().second;
    expect_gradients_match(scene, {.antialias = true, .lens = true}, {.distortion = true});
}

/// The two planes that the pass leaves of a picture of one depth and cover.
std::vector<float> planes_of(const std::vector<std::uint32_t>& photo, bool measured, bool add) {
    Device& device = shared_device();
    const std::size_t pixels = photo.size() / 2;
    Buffer words(device, "photo", photo.size() * 4), image(device, "image", pixels * 16),
        open(device, "transmittance", pixels * 4), d_image(device, "d_image", pixels * 20);
    words.upload(photo);
    image.upload(std::vector<float>(4 * pixels, 3.0f));
    open.upload(std::vector<float>(pixels, 0.25f));
    d_image.upload(std::vector<float>(5 * pixels, 7.0f));
    DepthLoss loss(device, {.exposure = add});
    Commands commands(device);
    commands.begin();
    loss.record(commands, {image, open, words, d_image, measured},
                static_cast<std::uint32_t>(pixels), {kWeight, kUsual, kDistortion});
    commands.submit_and_wait();
    EXPECT_EQ(d_image.download<float>(3 * pixels), std::vector<float>(3 * pixels, 7.0f));
    return d_image.download<float>(2 * pixels, 12 * pixels);
}

TEST(DepthLoss, a_photo_without_depths_leaves_no_gradient) {
    const auto photo = measured_photo(100);
    EXPECT_EQ(planes_of(photo, false, false), std::vector<float>(200, 0.0f));
    const auto measured = planes_of(photo, true, false), added = planes_of(photo, true, true);
    for (std::size_t p = 0; p < 100; ++p) {
        const bool counts = p % 5 != 0 && p % 7 != 3;
        EXPECT_EQ(measured[100 + p] != 0, counts) << p;
        EXPECT_FLOAT_EQ(added[p], measured[p] + 7) << "what exposure left stays";
    }
}

TEST(ResolutionRamp, takes_the_nearest_measured_depth) {
    Device& device = shared_device();
    const Camera whole{.width = 4, .height = 2}, half{.width = 2, .height = 1};
    std::vector<std::uint32_t> words(16, 0xFF000000u);
    const float depths[] = {1, 0, 0, 0, 2, 0, 0, 0};  // none is measured on the right
    std::memcpy(&words[8], depths, sizeof depths);
    Buffer photo(device, "photo", 64);
    photo.upload(words);
    const Buffer smaller = ResolutionRamp(device).downsample(photo, whole, half);
    ASSERT_EQ(smaller.bytes(), 16u);
    const auto got = smaller.download<float>(2, 8);
    EXPECT_TRUE(got[0] == 1 || got[0] == 2) << got[0];
    EXPECT_EQ(got[1], 0);
}

}  // namespace
}  // namespace darb::test
