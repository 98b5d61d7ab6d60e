// SPDX-License-Identifier: MIT
// The effects' own passes against double: exposure forward, backward and its step, the 3D smoothing
// filter, and the depth image.
#include "engine/core/rng.h"
#include "engine/reference/reference_density_control.h"
#include "engine/reference/reference_render.h"
#include "engine/render/renderer.h"
#include "tests/support/compare_arrays.h"
#include "tests/support/shared_device.h"
#include "tests/support/test_scene.h"
#include "trainer/step/exposure.h"
#include "trainer/step/smoothing.h"

namespace darb::test {
namespace {

constexpr std::uint32_t kPhotos = 3;
constexpr glm::vec3 kBehind(0.9f, 0.2f, 0.6f);

std::vector<float> random_values(size_t count, std::uint64_t seed) {
    Pcg32 random(seed);
    std::vector<float> values(count);
    for (float& v : values) v = static_cast<float>(random.uniform(-1.0, 1.0));
    return values;
}

std::vector<float> colours_at_start() {
    std::vector<float> start = random_values(ExposureMaps{kPhotos}.state_size(), 7);
    for (size_t i = kPhotos * 12; i < start.size(); ++i) start[i] = std::abs(start[i]) * 1e-3f;
    return start;
}

struct ExposureRun {
    std::vector<float> mapped, d_image, state;
};

/// How much of the background each pixel shows.
std::vector<float> open_pixels(size_t count) {
    std::vector<float> open = random_values(count, 3);
    for (float& t : open) t = 0.5f * (t + 1);
    return open;
}

/// One step of photo 1 from these maps, of a picture of `open` transmittances.
ExposureRun run_exposure(const std::vector<float>& open, const std::vector<float>& image,
                         const std::vector<float>& d_mapped, const std::vector<float>& start,
                         std::uint32_t overflow = 0) {
    Device& device = shared_device();
    const auto pixels = static_cast<std::uint32_t>(open.size());
    Exposure exposure(device, {kPhotos}, pixels);
    exposure.restore(start);
    Buffer colours(device, "image", image.size() * 4), d(device, "d_image", open.size() * 16),
        transmittance(device, "transmittance", open.size() * 4),
        status(device, "status", sizeof(gpu::FrameStatus));
    colours.upload(image);
    transmittance.upload(open);
    d.upload(d_mapped);
    const ExposedPicture picture{colours, transmittance, kBehind};
    gpu::FrameStatus s{};
    s.overflow = overflow;
    status.upload(std::vector{s});
    Commands commands(device);
    commands.begin();
    exposure.record(commands, picture, 1, pixels);
    exposure.record_backward(commands, picture, d, {1, pixels, 0.01f, 3});
    exposure.record_step(commands, status, {1, pixels, 0.01f, 3});
    commands.submit_and_wait();
    return {exposure.mapped().download<float>(image.size()), d.download<float>(open.size() * 4),
            exposure.state()};
}

ExposureRun run_exposure(std::uint32_t pixels, std::uint32_t overflow = 0) {
    return run_exposure(open_pixels(pixels), random_values(pixels * 3, 1),
                        random_values(pixels * 3, 2), colours_at_start(), overflow);
}

TEST(ExposurePass, map_gradient_and_step_match_double_on_any_size) {
    for (const std::uint32_t pixels : {1u, 63u, 65u, 20'000u}) {
        const auto image = random_values(pixels * 3, 1), d = random_values(pixels * 3, 2);
        const std::vector<float> start = colours_at_start(), open = open_pixels(pixels);
        const ExposureRun run = run_exposure(open, image, d, start);
        std::vector<double> mapped(image.size()), d_image(pixels * 4), d_map(12, 0.0);
        const float* m = &start[12];
        for (size_t p = 0; p < pixels; ++p) {
            double d_open = 0;  // the splats' colours held
            for (size_t r = 0; r < 3; ++r) {
                const double gradient = d[r * pixels + p], t = open[p];
                double sum = m[r * 4 + 3] * (1 - t) + t * kBehind[int(r)];
                for (size_t c = 0; c < 3; ++c) {
                    const double x = image[c * pixels + p] - t * kBehind[int(c)];
                    sum += m[r * 4 + c] * x;
                    d_map[r * 4 + c] += gradient * x;
                    d_image[c * pixels + p] += m[r * 4 + c] * gradient;
                }
                mapped[r * pixels + p] = sum;
                d_map[r * 4 + 3] += gradient * (1 - t);
                d_open += gradient * (kBehind[int(r)] - m[r * 4 + 3]);
            }
            // The image is colours + t background: what it does not tell of dL/dt.
            for (size_t c = 0; c < 3; ++c)
                d_image[3 * pixels + p] += d_image[c * pixels + p] * kBehind[int(c)];
            d_image[3 * pixels + p] -= d_open;
        }
        EXPECT_TRUE(compare("mapped", mapped, run.mapped, tolerance("projection_float32")));
        EXPECT_TRUE(compare("d_image", d_image, run.d_image, tolerance("projection_float32")));
        std::vector<double> expected, got, moments, got_moments;
        for (size_t k = 0; k < 12; ++k) {
            const double m1 = 0.9 * start[36 + 24 + 2 * k] + 0.1 * d_map[k];
            const double m2 = 0.999 * start[36 + 24 + 2 * k + 1] + 0.001 * d_map[k] * d_map[k];
            moments.insert(moments.end(), {m1, m2});
            got_moments.insert(got_moments.end(),
                               {run.state[36 + 24 + 2 * k], run.state[36 + 24 + 2 * k + 1]});
            const double change = -0.01 * (m1 / (1 - std::pow(0.9, 3))) /
                                  (std::sqrt(m2 / (1 - std::pow(0.999, 3))) + 1e-15);
            for (size_t v = 0; v < kPhotos; ++v) {
                expected.push_back(start[v * 12 + k] + (v == 1 ? change : 0) - change / kPhotos);
                got.push_back(run.state[v * 12 + k]);
            }
        }
        EXPECT_TRUE(compare("moments", moments, got_moments, tolerance("gradient_float32")));
        EXPECT_TRUE(compare("maps", expected, got, tolerance("gradient_float32")));
    }
}

// Otherwise random backgrounds of photos with transparent parts would pull every map to the
// identity.
TEST(ExposurePass, what_nothing_covers_keeps_the_background_and_says_nothing_of_the_map) {
    constexpr size_t kPixels = 100;
    std::vector<float> image;
    for (int c = 0; c < 3; ++c) image.insert(image.end(), kPixels, kBehind[c]);
    const std::vector<float> start = colours_at_start();
    const ExposureRun run = run_exposure(std::vector<float>(kPixels, 1.0f), image,
                                         random_values(3 * kPixels, 2), start);
    EXPECT_EQ(run.mapped, image);
    for (size_t k = 0; k < 12; ++k)
        EXPECT_EQ(run.state[36 + 24 + 2 * k], 0.9f * start[36 + 24 + 2 * k]) << "term " << k;
}

TEST(ExposurePass, a_frame_that_overflowed_changes_no_map) {
    EXPECT_EQ(run_exposure(100, 1).state, colours_at_start());
}

TEST(ExposurePass, repeats_bit_by_bit) {
    const ExposureRun a = run_exposure(20'000), b = run_exposure(20'000);
    EXPECT_EQ(a.state, b.state);
    EXPECT_EQ(a.d_image, b.d_image);
}

TEST(ExposureFit, finds_the_map_that_made_the_photo) {
    const ColourMap truth = {1.1f, 0.02f, 0, 0.01f, 0, 0.9f, 0.03f, -0.02f, 0.01f, 0, 1.05f, 0.03f};
    ImageF picture(40, 30, 3);
    Pcg32 random(4);
    for (float& v : picture.data) v = static_cast<float>(random.uniform(0.2, 0.7));
    ImageU8 photo(40, 30, 4);
    for (size_t p = 0; p < 1200; ++p) photo.data[p * 4 + 3] = 255;
    const ImageF mapped = apply_exposure(truth, picture, photo, false);
    for (size_t p = 0; p < 1200; ++p)
        for (size_t c = 0; c < 3; ++c)
            photo.data[p * 4 + c] = static_cast<std::uint8_t>(mapped.data[p * 3 + c] * 255 + 0.5f);
    // Half of the picture is background, which no exposure changes.
    for (size_t p = 0; p < 600; ++p) {
        photo.data[p * 4 + 3] = 0;
        for (size_t c = 0; c < 3; ++c) picture.data[p * 3 + c] = kBehind[int(c)];
    }
    const ColourMap found = fit_exposure(picture, photo, kBehind, false);
    for (size_t k = 0; k < 12; ++k) EXPECT_NEAR(found[k], truth[k], 5e-3) << k;
    EXPECT_EQ(apply_exposure(found, picture, photo, false).data[7], picture.data[7]);
}

TEST(SmoothingFilterPass, matches_double_and_unseen_splats_have_none) {
    Device& device = shared_device();
    TestScene s = random_scene({.count = 50, .width = 64, .height = 48});
    for (size_t c = 0; c < 3; ++c) s.model.position[c] = 500;  // far outside of every view
    Camera close = s.camera;
    close.fx *= 3;
    const std::vector<Camera> cameras = {s.camera, close};
    GpuSplats splats(device, s.model, false);
    const Buffer buffer = upload_cameras(
        device, {camera_data(cameras[0], s.model.origin), camera_data(cameras[1], s.model.origin)});
    SmoothingFilter filter(device, {});
    filter.update(splats, buffer, 2);
    const auto got = splats.smoothing().download<float>(s.model.size());
    size_t close_ups = 0;
    for (size_t i = 0; i < s.model.size(); ++i) {
        double least = 1e300;
        for (const Camera& c : cameras) {
            const float* at = &s.model.position[3 * i];
            const glm::dvec3 p = c.rotation * glm::dvec3(at[0], at[1], at[2]) + c.translation;
            const double x = c.fx * p.x / p.z + c.cx, y = c.fy * p.y / p.z + c.cy;
            const bool seen = p.z > 0.2 && x >= -0.15 * c.width && x <= 1.15 * c.width &&
                              y >= -0.15 * c.height && y <= 1.15 * c.height;
            if (seen) least = std::min(least, p.z / std::max(c.fx, c.fy));
            if (seen && &c == &cameras[1]) ++close_ups;
        }
        const double expected = least < 1e299 ? std::sqrt(0.2) * least : 0;
        EXPECT_NEAR(got[i], expected, 2e-6 * expected) << "splat " << i;
    }
    EXPECT_EQ(got[0], 0);
    EXPECT_GT(close_ups, 5u);
}

TEST(SmoothingFilterPass, baked_splats_look_the_same) {
    const TestScene s = random_scene({.count = 60, .sh_degree = 0, .antialias = true});
    auto live = reference::make_splats<double>(s.model);
    std::vector<float> filter;
    for (size_t i = 0; i < s.model.size(); ++i) filter.push_back(0.01f + 0.002f * float(i));
    live.smoothing.assign(filter.begin(), filter.end());
    const auto expected = reference::render(live, s.camera, {}).images.colour;
    const auto got = reference::render(bake_smoothing(s.model, filter), s.camera, {}).images.colour;
    EXPECT_TRUE(compare("image", expected.data, got.data, tolerance("image_float32")));
    const auto plain = reference::render(s.model, s.camera, {}).images.colour;
    double difference = 0;
    for (size_t i = 0; i < plain.data.size(); ++i)
        difference = std::max(difference, std::abs(plain.data[i] - got.data[i]));
    EXPECT_GT(difference, 0.01) << "the filter is meant to change the picture";
}

TEST(DepthImage, matches_double) {
    const TestScene s = random_scene({.count = 80, .width = 70, .height = 50, .sh_degree = 0});
    Renderer renderer(shared_device(), s.model);
    renderer.render(s.camera);
    const ImageF got = renderer.render_depth();
    // In double: splats of colour (z, 1, 0) by a model whose dc is that colour.
    const auto projected = reference::render(s.model, s.camera, {});
    SplatModel coloured = s.model;
    for (size_t i = 0; i < s.model.size(); ++i) {
        const double z = projected.projected[i].depth;
        const double colour[3] = {z, 1, 0};
        for (size_t c = 0; c < 3; ++c)
            coloured.sh_dc[3 * i + c] = static_cast<float>((colour[c] - 0.5) / 0.28209479177387814);
    }
    const auto sums = reference::render(coloured, s.camera, {}).images.colour;
    std::vector<double> expected, depth;
    for (size_t p = 0; p < sums.data.size() / 3; ++p) {
        const double weight = sums.data[p * 3 + 1];
        if (std::abs(weight - 1.0 / 255) < 1e-3) continue;  // on the limit
        expected.push_back(weight > 1.0 / 255 ? sums.data[p * 3] / weight : 0);
        depth.push_back(got.data[p * 2]);
    }
    EXPECT_GT(expected.size(), 3000u);
    EXPECT_TRUE(compare("depth", expected, depth, Tolerance{"depth", 1e-4, 1e-4, 0.01}));
}

}  // namespace
}  // namespace darb::test
