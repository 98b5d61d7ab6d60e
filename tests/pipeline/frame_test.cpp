// SPDX-License-Identifier: MIT
// The forward walk as a whole: lists against the host, ties, invariances, empty and overfull
// frames, and sizes at the limits.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/check/device_walk.h"
#include "engine/core/error.h"
#include "engine/core/rng.h"
#include "engine/raster/blend_backward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/frame_view.h"
#include "tests/support/projected_frame.h"
#include "tests/support/scoped_variants.h"
#include "tests/support/test_walk.h"

namespace darb::test {
namespace {

using Words = std::vector<std::uint32_t>;

struct ShownFrame {
    Camera camera;
    gpu::FrameStatus status;
    std::vector<float> image;
    std::vector<glm::uvec2> ranges;  // [T]
    std::vector<Words> tiles;        // [T] splats in order of blending
    std::uint64_t tile_intersections() const {
        return std::accumulate(tiles.begin(), tiles.end(), std::uint64_t{0},
                               [](std::uint64_t sum, const Words& t) { return sum + t.size(); });
    }
};

ShownFrame render_frame(const SplatModel& model, const Camera& camera,
                        std::uint32_t intersections = 200'000) {
    Device& device = shared_device();
    GpuSplats splats(device, model, false);
    FrameBuffers buffers(device, forward_options(model, {}));
    Forward forward(device, forward_options(model, {}));
    FrameView view{camera_data(camera, model.origin), nullptr, 0, model.sh_degree,
                   glm::vec3(0.25f)};
    const Buffer cameras = upload_cameras(device, {view.camera});
    view.cameras = &cameras;
    buffers.reserve(splats.count(), intersections, camera.width, camera.height);
    Frame& frame = buffers.frame();
    Commands commands(device);
    commands.begin();
    forward.record(commands, splats, view, frame);
    commands.submit_and_wait();
    ShownFrame f{camera, frame.read_status(), {}, {}, {}};
    f.image = frame.images.image.download<float>(size_t(camera.width) * camera.height * 3);
    const size_t tile_count = size_t{view.camera.tiles_x} * view.camera.tiles_y;
    const TileIntersections& t = frame.intersections;
    f.ranges = t.tile_range.download<glm::uvec2>(tile_count);
    const std::uint32_t stored = std::min(f.status.intersections, frame.size.intersections);
    const Words order = t.intersection_from_sorted.download<std::uint32_t>(stored);
    const Words splat = t.splat_from_intersection.download<std::uint32_t>(stored);
    for (const glm::uvec2& range : f.ranges) {
        f.tiles.emplace_back();
        for (std::uint32_t j = range.x; j < range.y; ++j)
            f.tiles.back().push_back(splat.at(order.at(j)) & INTERSECTION_SPLAT_MASK);
    }
    return f;
}

const SceneOptions kFrameScene{.count = 400,
                               .width = 140,
                               .height = 90,
                               .sh_degree = 1,
                               .min_log_scale = -4,
                               .max_log_scale = -1,
                               .seed = 41};

TEST(Frame, lists_match_the_covers_sorted_by_depth_on_the_host) {
    const TestScene s = random_scene(kFrameScene);
    const ShownFrame f = render_frame(s.model, s.camera);
    const ProjectedFrame p = project_on_device(s.model, s.camera);
    Words order;
    for (std::uint32_t i = 0; i < s.model.size(); ++i)
        if (p.visible[i] == 1) order.push_back(i);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return p.bound[a].z < p.bound[b].z; });
    std::vector<Words> expected(f.tiles.size());
    for (const std::uint32_t i : order)
        for (const std::uint32_t tile : cover_tiles(p.cover[i], 9)) expected[tile].push_back(i);
    EXPECT_GT(order.size(), 300U);
    EXPECT_EQ(f.status.visible, order.size());
    EXPECT_EQ(f.status.overflow, 0U);
    EXPECT_EQ(f.tiles, expected);
    EXPECT_EQ(f.status.intersections, f.tile_intersections());
}

TEST(Frame, equal_depths_keep_file_order) {
    TestScene s = random_scene({.count = 300, .width = 64, .height = 64, .sh_degree = 0});
    s.camera.rotation = glm::dmat3(1.0);
    s.camera.translation = {0, 0, 3};
    for (size_t i = 0; i < s.model.size(); ++i)
        s.model.position[i * 3 + 2] = static_cast<float>(i % 3) * 0.25f;
    const ShownFrame f = render_frame(s.model, s.camera);
    ASSERT_GT(f.status.visible, 200U);
    for (const Words& tile : f.tiles)
        for (size_t j = 1; j < tile.size(); ++j) {
            const auto key = [&](std::uint32_t i) { return std::pair(i % 3, i); };
            ASSERT_LT(key(tile[j - 1]), key(tile[j]));
        }
}

SplatModel reordered(const SplatModel& model, const Words& order) {
    SplatModel result = model;
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<float>& from = attribute_values(model, a);
        const size_t stride = from.size() / model.size();
        for (size_t i = 0; i < order.size(); ++i)
            std::copy_n(
                from.begin() + static_cast<std::ptrdiff_t>(order[i] * stride), stride,
                attribute_values(result, a).begin() + static_cast<std::ptrdiff_t>(i * stride));
    }
    return result;
}

TEST(Frame, image_does_not_depend_on_the_order_in_the_file) {
    const TestScene s = random_scene(kFrameScene);
    Words order(s.model.size());
    std::iota(order.begin(), order.end(), 0U);
    Pcg32 rng(3);
    for (size_t i = order.size(); i > 1; --i)
        std::swap(order[i - 1], order[rng.below(static_cast<std::uint32_t>(i))]);
    EXPECT_EQ(render_frame(s.model, s.camera).image,
              render_frame(reordered(s.model, order), s.camera).image);
}

TEST(Frame, splats_that_nobody_sees_change_no_bit) {
    TestScene s = random_scene(kFrameScene);
    const std::vector<float> before = render_frame(s.model, s.camera).image;
    const size_t n = s.model.size();
    s.model.resize(n + 300);
    for (size_t i = n; i < n + 300; ++i) {
        const size_t twin = i - n;
        for (int a = 0; a < kAttributeCount; ++a) {
            std::vector<float>& values = attribute_values(s.model, a);
            const size_t stride = values.size() / s.model.size();
            for (size_t c = 0; c < stride; ++c) values[i * stride + c] = values[twin * stride + c];
        }
        if (i % 3 == 0) s.model.opacity_logit[i] = -7;
        if (i % 3 == 1) s.model.rotation[i * 4] = std::nanf("");
        if (i % 3 == 2) s.model.position[i * 3] = 1e5f;
    }
    EXPECT_EQ(render_frame(s.model, s.camera).image, before);
}

// The principal point moves by whole tiles. Splats of 1 px, so that none which reaches the window
// lies beyond the Jacobian's clamp, which depends on the image.
TEST(Frame, tiles_rendered_apart_equal_the_whole) {
    SceneOptions options = kFrameScene;
    options.count = 3000;
    options.min_log_scale = -5;
    options.max_log_scale = -3.8;
    const TestScene s = random_scene(options);
    const ShownFrame whole = render_frame(s.model, s.camera);
    Camera part = s.camera;
    part.width = part.height = 32;
    part.cx -= 48;
    part.cy -= 32;
    const ShownFrame window = render_frame(s.model, part);
    std::vector<float> expected;
    for (size_t c = 0; c < 3; ++c)
        for (size_t y = 0; y < 32; ++y)
            for (size_t x = 0; x < 32; ++x)
                expected.push_back(whole.image[(c * 90 + y + 32) * 140 + x + 48]);
    EXPECT_GT(window.status.visible, 100U);
    EXPECT_TRUE(compare("window", expected, window.image, tolerance("image_float32")));
}

void expect_background(const ShownFrame& f) {
    for (const float value : f.image) ASSERT_EQ(value, 0.25f);
    EXPECT_EQ(f.status.visible, 0U);
    EXPECT_EQ(f.status.intersections, 0U);
    EXPECT_EQ(f.status.overflow, 0U);
    for (const Words& tile : f.tiles) EXPECT_TRUE(tile.empty());
}

TEST(Frame, zero_splats_show_the_background) {
    expect_background(render_frame({}, random_scene(kFrameScene).camera));
}

TEST(Frame, zero_visible_splats_show_the_background) {
    TestScene s = random_scene(kFrameScene);
    s.camera.translation.z = -30;
    expect_background(render_frame(s.model, s.camera));
    TestScene faint = random_scene(kFrameScene);
    for (float& logit : faint.model.opacity_logit) logit = -8;
    expect_background(render_frame(faint.model, faint.camera));
}

TEST(Frame, an_empty_frame_after_a_full_one_is_empty) {
    Device& device = shared_device();
    const TestScene s = random_scene(kFrameScene);
    GpuSplats splats(device, s.model, false);
    FrameBuffers buffers(device, forward_options(s.model, {}));
    Forward forward(device, forward_options(s.model, {}));
    Camera away = s.camera;
    away.translation.z = -30;
    const std::vector<gpu::CameraData> data = {camera_data(s.camera, {}), camera_data(away, {})};
    const Buffer cameras = upload_cameras(device, data);
    buffers.reserve(splats.count(), 100'000, s.camera.width, s.camera.height);
    Commands commands(device);
    commands.begin();
    Frame& frame = buffers.frame();
    for (std::uint32_t i = 0; i < 2; ++i)
        forward.record(commands, splats, {data[i], &cameras, i, 1, glm::vec3(0.25f)}, frame);
    commands.submit_and_wait();
    EXPECT_EQ(frame.read_status().visible, 0U);
    EXPECT_EQ(frame.read_status().culled[CULL_NEAR], splats.count());
    for (const float value : frame.images.image.download<float>(140 * 90 * 3))
        ASSERT_EQ(value, 0.25f);
}

TEST(Frame, one_splat_over_the_whole_image_is_in_every_tile) {
    TestScene s = random_scene({.count = 1, .width = 700, .height = 500, .sh_degree = 0});
    for (int c = 0; c < 3; ++c) {
        s.model.position[c] = 0;
        s.model.log_scale[c] = 3;
    }
    s.model.opacity_logit[0] = 4;
    const ShownFrame f = render_frame(s.model, s.camera);
    EXPECT_EQ(f.status.intersections, 44U * 32U);
    for (const Words& tile : f.tiles) EXPECT_EQ(tile, Words{0});
    for (size_t i = 0; i < size_t{700} * 500; ++i) ASSERT_NE(f.image[i], 0.25f);
}

TEST(Frame, intersections_beyond_the_capacity_raise_the_flag_and_keep_the_rest_in_bounds) {
    TestScene s = random_scene({.count = 500, .width = 300, .height = 200, .sh_degree = 0});
    const ShownFrame full = render_frame(s.model, s.camera);
    const ShownFrame cut =
        render_frame(s.model, s.camera, 1);  // raised to the least capacity, 1,024
    ASSERT_GT(full.status.intersections, 2000U);
    EXPECT_EQ(full.status.overflow, 0U);
    EXPECT_EQ(cut.status.overflow, 1U);
    EXPECT_EQ(cut.status.intersections, full.status.intersections);
    EXPECT_EQ(cut.tile_intersections(), 1024U);
    for (const glm::uvec2& range : cut.ranges) EXPECT_LE(range.y, 1024U);
}

TEST(Frame, renderer_grows_and_repeats_until_everything_fits) {
    TestScene s = random_scene({.count = 500, .width = 300, .height = 200, .sh_degree = 0});
    const ShownFrame full = render_frame(s.model, s.camera);
    Renderer renderer(shared_device(), s.model);
    const ImageF image = renderer.render(s.camera, glm::vec3(0.25f));
    EXPECT_EQ(renderer.status().overflow, 0U);
    EXPECT_EQ(renderer.status().intersections, full.status.intersections);
    EXPECT_EQ(image.data, planes_to_image(full.image, 300, 200).data);
}

// A frame that wanted more intersections gets half as many again, or just those where the budget
// ends.
TEST(Frame, a_budget_without_ample_room_gets_the_room_it_needs) {
    const TestScene s = random_scene({.count = 500, .width = 300, .height = 200, .sh_degree = 0});
    Device& device = shared_device();
    for (const bool store : {false, true}) {
        ForwardOptions options = forward_options(s.model, {});
        options.store_for_backward = store;
        gpu::FrameStatus status{};
        status.overflow = OVERFLOW_INTERSECTIONS;
        status.intersections = 300'000;
        const auto grown = [&](std::uint32_t budget_intersections) {
            FrameBuffers buffers(device, options);
            buffers.reserve(500, 1024, 300, 200);
            BlendBackward backward(device, options);
            if (store) backward.reserve(buffers.size().intersections);
            const auto bytes = [&](std::uint32_t intersections) {
                FrameSize size = buffers.size();
                size.intersections = intersections;
                const std::uint64_t own =
                    FrameBuffers::device_bytes(device, options, size).intersections;
                return store ? own + BlendBackward::device_bytes(size).intersections : own;
            };
            device.set_memory_budget(budget_intersections == 0
                                         ? 0
                                         : device.allocated_bytes() + bytes(budget_intersections) -
                                               bytes(1024));
            buffers.make_room(status);
            if (store) backward.reserve(buffers.size().intersections);
            return buffers.size().intersections;
        };
        EXPECT_EQ(grown(0), 450'000U);
        EXPECT_EQ(grown(460'000), 450'000U);
        EXPECT_EQ(grown(330'000), 300'000U);
        EXPECT_THROW(grown(290'000), Error);
        device.set_memory_budget(0);
    }
}

TEST(Frame, a_picture_beyond_a_binding_names_its_camera_and_a_resolution) {
    const Device& device = shared_device();
    const int side = static_cast<int>(std::sqrt(double(max_frame_pixels(device))));
    const auto refusal = [&](int width, int height) -> std::string {
        try {
            check_frame(device, width, height, "north");
        } catch (const Error& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_EQ(refusal(side, side), "");
    const std::string text = refusal(2 * side, 3 * side);
    EXPECT_NE(text.find("\"north\""), std::string::npos) << text;
    EXPECT_NE(text.find(fmt::format("{} pixels", max_frame_pixels(device))), std::string::npos);
    const std::size_t at = text.find("-r ");
    ASSERT_NE(at, std::string::npos) << text;
    const int width = std::stoi(text.substr(at + 3));
    EXPECT_GT(width, 0.8 * side);
    EXPECT_EQ(refusal(width, static_cast<int>(std::lround(1.5 * width))), "");
    FrameBuffers buffers(shared_device(), {});
    EXPECT_THROW(buffers.reserve(1, 1, 2 * side, side), Error);
}

TEST(Frame, intersections_beyond_the_buckets_name_the_way_that_holds_them) {
    const TestScene s = random_scene({.count = 5, .width = 30, .height = 20, .sh_degree = 0});
    Device& device = shared_device();
    ForwardOptions options = forward_options(s.model, {});
    options.store_for_backward = true;
    std::uint32_t most = 0;
    {
        const ScopedVariants variants(device, "backward=subgroup");
        most = FrameBuffers::max_intersections(device);
    }
    const ScopedVariants variants(device, "backward=buckets");
    ASSERT_LT(FrameBuffers::max_intersections(device), most);
    FrameBuffers buffers(device, options);
    buffers.reserve(5, 1024, 30, 20);
    const auto hint = [&](std::uint32_t intersections) -> std::string {
        gpu::FrameStatus status{};
        status.overflow = OVERFLOW_INTERSECTIONS;
        status.intersections = intersections;
        try {
            buffers.make_room(status);
        } catch (const Error& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_NE(hint(most).find("--tune backward=subgroup"), std::string::npos) << hint(most);
    EXPECT_EQ(hint(most + 1).find("--tune"), std::string::npos) << hint(most + 1);
    EXPECT_NE(hint(most + 1).find("--cap-max"), std::string::npos) << hint(most + 1);
}

// The second round takes the list in parts, with and without the state for the backward pass.
TEST(Frame, a_list_of_20000_splats_is_shown_to_its_end) {
    TestScene s = random_scene({.count = 20'000, .width = 16, .height = 16, .sh_degree = 0});
    s.camera.rotation = glm::dmat3(1.0);
    for (size_t i = 0; i < s.model.size(); ++i) {
        const bool last = i + 1 == s.model.size();
        for (size_t c = 0; c < 3; ++c) {
            s.model.position[i * 3 + c] = c < 2 ? 0 : last ? 1 : 0;
            s.model.log_scale[i * 3 + c] = 0;
        }
        s.model.opacity_logit[i] =
            last ? 6.0f : -5.54f;  // just below the cut-off, but for the last one
    }
    for (size_t i = 0; i < 9000; ++i) s.model.opacity_logit[i] = -5.5f;
    WalkSettings settings;
    settings.alpha_cutoff = 1e-5f;
    settings.transmittance_stop = 1e-30f;
    const DeviceWalk walk = walk_on_device(s.model, s.camera, {}, settings);
    EXPECT_EQ(walk.status.longest_list, 20'000U);
    EXPECT_EQ(walk.status.overflow, 0U);

    s.model.resize(13'000);  // the renderer, at its finest: 2.6e-6 of the light passes all of them
    std::fill(s.model.opacity_logit.begin(), s.model.opacity_logit.end(), -6.9167f);
    settings.alpha_cutoff = 1.0f / 1024;
    settings.transmittance_stop = 1e-6f;
    const DeviceWalk fine = walk_on_device(s.model, s.camera, {}, settings);
    EXPECT_EQ(fine.status.longest_list, 13'000U);
    Accuracy accuracy;
    accuracy.choice[kAlphaCutoff] = find_choice(kAlphaCutoff, "1/1024");
    accuracy.choice[kTransmittanceStop] = find_choice(kTransmittanceStop, "1e-6");
    Renderer renderer(shared_device(), s.model, accuracy);
    EXPECT_EQ(renderer.render(s.camera).data, fine.image.data);
    EXPECT_EQ(renderer.render(s.camera).data, fine.image.data) << "the second frame";
}

// 65,538 tiles: tile numbers take 17 bits. The splats lie in the last and in the first tiles.
// A million equal layers in the one tile of an image. Their alpha is 2^-20, so that 1 - alpha is a
// float; of the background 0.385 is left.
TEST(Frame, a_million_splats_in_one_tile_are_all_shown_slow) {
    constexpr size_t kCount = 1'000'000;
    TestScene s = random_scene({.count = kCount, .width = 8, .height = 8, .sh_degree = 0});
    s.camera.rotation = glm::dmat3(1.0);
    std::fill(s.model.position.begin(), s.model.position.end(), 0.0f);
    std::fill(s.model.log_scale.begin(), s.model.log_scale.end(), 8.0f);  // flat over the image
    std::fill(s.model.opacity_logit.begin(), s.model.opacity_logit.end(), -20 * std::log(2.0f));
    std::fill(s.model.sh_dc.begin(), s.model.sh_dc.end(), 0.0f);  // grey
    WalkSettings settings;
    settings.alpha_cutoff = 1e-7f;
    settings.background = {1, 0, 0.5f};
    const Image<double> weights = check::random_weights(s.camera);
    const DeviceWalk walk = walk_on_device(s.model, s.camera, weights, settings);
    EXPECT_EQ(walk.status.longest_list, kCount);
    EXPECT_EQ(walk.status.bad_gradients, 0U);
    const double left = std::pow(1 - 0x1p-20, double(kCount));
    double sum = 0, expected = 0;
    for (size_t i = 0; i < walk.image.data.size(); ++i) {
        const double background = settings.background[int(i % 3)];
        EXPECT_NEAR(walk.image.data[i], 0.5 * (1 - left) + background * left, 2e-3) << i;
        expected += weights.data[i] * 0.28209479 * (1 - left);
    }
    for (size_t i = 0; i < walk.d[kShDc].size(); ++i) sum += walk.d[kShDc][i];
    EXPECT_NEAR(sum, expected, 0.01 * std::abs(expected));
}

TEST(Frame, more_than_65536_tiles_are_told_apart) {
    TestScene s = random_scene({.count = 4, .width = 17, .height = 524'290, .sh_degree = 0});
    s.camera.rotation = glm::dmat3(1.0);
    s.camera.translation = {0, 0, 3};
    s.camera.fx = s.camera.fy = 30'000;
    s.camera.cx = 8.5;
    s.camera.cy = s.camera.height / 2.0;
    for (size_t i = 0; i < 4; ++i) {  // top, bottom, top, bottom at one depth
        s.model.position[i * 3] = 0;
        s.model.position[i * 3 + 1] = i % 2 == 0 ? -26.214f : 26.214f;
        s.model.position[i * 3 + 2] = 0;
        for (size_t c = 0; c < 3; ++c) s.model.log_scale[i * 3 + c] = -8;
        s.model.opacity_logit[i] = 4;
    }
    const ShownFrame f = render_frame(s.model, s.camera);
    ASSERT_EQ(f.tiles.size(), 65'538U);
    EXPECT_EQ(f.status.visible, 4U);
    EXPECT_EQ(f.tiles.front().size(), 2U);
    EXPECT_EQ(f.tiles.back().size(), 2U);
    for (size_t t = 32; t + 32 < f.tiles.size(); ++t) ASSERT_TRUE(f.tiles[t].empty()) << t;
}

// Positions relative to an origin a thousand kilometres away: the camera moves, not the splats.
TEST(Frame, an_origin_far_away_leaves_the_image_alone) {
    TestScene s = random_scene(kFrameScene);
    const std::vector<float> near_zero = render_frame(s.model, s.camera).image;
    s.model.origin = {1e6, -2e6, 5e5};
    s.camera.translation -= s.camera.rotation * s.model.origin;
    const std::vector<float> far = render_frame(s.model, s.camera).image;
    double worst = 0;
    for (size_t i = 0; i < far.size(); ++i)
        worst = std::max(worst, double(std::abs(far[i] - near_zero[i])));
    EXPECT_LT(worst, 1e-4);
}

}  // namespace
}  // namespace darb::test
