// SPDX-License-Identifier: MIT
// Views with gradients, as a user's own program requests them: against the double reference, for
// one view and several added, an Adam step from them, and a caller's mistakes.
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/check/device_walk.h"
#include "engine/core/error.h"
#include "engine/core/rng.h"
#include "engine/raster/adam.h"
#include "engine/reference/reference_density_control.h"
#include "engine/render/render_gradients.h"
#include "tests/support/compare_images.h"
#include "tests/support/test_walk.h"
#include "trainer/step/batch_step.h"

namespace darb::test {
namespace {

using check::WalkTruth;

ImageF weights_of(const Camera& camera, std::uint64_t seed) {
    Pcg32 rng(seed);
    ImageF weights(camera.width, camera.height, 3);
    for (float& w : weights.data) w = static_cast<float>(rng.uniform(-1, 1));
    return weights;
}

/// The same place, turned a little about the vertical.
Camera turned(Camera camera, double angle) {
    const glm::dmat3 turn = reference::rotation_of(std::cos(angle / 2), 0, std::sin(angle / 2), 0);
    camera.rotation = camera.rotation * turn;
    return camera;
}

void expect_matches(const WalkTruth& truth, const ViewGradients& view) {
    EXPECT_TRUE(compare_scaled("image", truth.image, view.image.data, tolerance("image_float32")));
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<double>& expected = truth.d[static_cast<size_t>(a)];
        if (expected.empty()) continue;
        EXPECT_TRUE(compare_scaled(std::string("d_") + attribute_name(a), expected,
                                   attribute_values(view.d, a),
                                   tolerance("gradient_scaled_float32")));
    }
    EXPECT_TRUE(compare_scaled("mean gradient", truth.mean_gradient_ndc, view.mean_gradient_ndc,
                               tolerance("gradient_scaled_float32")));
}

TEST(ViewGradients, match_the_double_reference) {
    struct Case {
        int kernel;
        Footprint footprint;
        bool antialias;
        int degree;
    };
    for (const Case& c : {Case{KERNEL_GAUSSIAN, Footprint::psi, false, 3},
                          Case{KERNEL_RAISED_COSINE, Footprint::psi, true, 1},
                          Case{KERNEL_HALF_COSINE_SQUARED, Footprint::exact, false, 2}}) {
        SCOPED_TRACE(kernel_name(c.kernel));
        const TestScene scene = random_scene({.count = 40,
                                              .width = 48,
                                              .height = 40,
                                              .kernel = c.kernel,
                                              .footprint = c.footprint,
                                              .antialias = c.antialias,
                                              .seed = 21});
        const ImageF weights = weights_of(scene.camera, 5);
        const glm::vec3 background(0.25f, 0.5f, 0.75f);
        int calls = 0;
        const ViewGradients view =
            render_with_gradients(shared_device(), scene.model, scene.camera, background,
                                  [&](const ImageF& image) {
                                      ++calls;
                                      EXPECT_EQ(image.width, 48);
                                      return weights;
                                  },
                                  {.sh_degree = c.degree});
        EXPECT_EQ(calls, 1);
        WalkSettings settings;
        settings.background = background;
        settings.sh_degree = c.degree;
        expect_matches(check::walk_in_double(scene.model, scene.camera, widened(weights), settings),
                       view);
        EXPECT_EQ(std::count(view.shown.begin(), view.shown.end(), 1),
                  static_cast<std::ptrdiff_t>(view.status.visible));
        EXPECT_EQ(view.status.bad_gradients, 0u);
    }
}

TEST(ViewGradients, of_a_loss_of_the_picture_lead_downhill) {
    TestScene scene = random_scene({.count = 60, .width = 48, .height = 40, .seed = 22});
    GradientRenderer renderer(shared_device(), scene.model);
    const ImageF target = renderer.render(scene.camera);
    for (float& value : scene.model.sh_dc) value += 0.3f;
    for (float& value : scene.model.position) value *= 1.02f;
    std::vector<double> losses;
    for (int step = 0; step < 8; ++step) {
        renderer.update(scene.model);
        const ImageF image = renderer.render(scene.camera);
        ImageF d_image = image;
        double loss = 0;
        for (size_t i = 0; i < image.data.size(); ++i) {
            d_image.data[i] = image.data[i] - target.data[i];
            loss += 0.5 * d_image.data[i] * d_image.data[i];
        }
        losses.push_back(loss);
        const ViewGradients view = renderer.backward(d_image);
        for (size_t i = 0; i < scene.model.sh_dc.size(); ++i)
            scene.model.sh_dc[i] -= 0.01f * view.d.sh_dc[i];
    }
    for (size_t i = 1; i < losses.size(); ++i) EXPECT_LT(losses[i], losses[i - 1]);
    EXPECT_LT(losses.back(), 0.8 * losses.front());
}

TEST(ViewGradients, repeat_bit_by_bit_and_follow_an_update) {
    TestScene scene = random_scene({.count = 50, .sh_degree = 1, .seed = 23});
    const ImageF weights = weights_of(scene.camera, 6);
    const auto d_image = [&](const ImageF&) { return weights; };
    GradientRenderer renderer(shared_device(), scene.model);
    renderer.render(scene.camera);
    renderer.backward(weights);
    for (float& value : scene.model.opacity_logit) value += 0.1f;
    renderer.update(scene.model);
    const ImageF image = renderer.render(scene.camera);
    const ViewGradients again = renderer.backward(weights);
    const ViewGradients fresh =
        render_with_gradients(shared_device(), scene.model, scene.camera, glm::vec3(0), d_image);
    EXPECT_EQ(image.data, fresh.image.data);
    for (int a = 0; a < kAttributeCount; ++a)
        EXPECT_EQ(attribute_values(again.d, a), attribute_values(fresh.d, a)) << attribute_name(a);
}

TEST(ViewGradients, of_no_splats_are_empty) {
    SplatModel none;
    TestScene scene = random_scene({.count = 1});
    const ViewGradients view =
        render_with_gradients(shared_device(), none, scene.camera, glm::vec3(0.5f),
                              [&](const ImageF&) { return weights_of(scene.camera, 7); });
    EXPECT_EQ(view.image.data[0], 0.5f);
    for (int a = 0; a < kAttributeCount; ++a) EXPECT_TRUE(attribute_values(view.d, a).empty());
}

/// Whether the call throws an Error whose text contains `part`.
testing::AssertionResult refuses(const std::function<void()>& call, const std::string& part) {
    try {
        call();
    } catch (const Error& error) {
        if (std::string(error.what()).find(part) != std::string::npos)
            return testing::AssertionSuccess();
        return testing::AssertionFailure() << error.what();
    }
    return testing::AssertionFailure() << "no error";
}

TEST(ViewGradients, errors_of_the_caller_are_thrown) {
    Device& device = shared_device();
    const TestScene scene = random_scene({.count = 5, .sh_degree = 1, .seed = 24});
    const float nan = std::nanf("");
    SplatModel short_of_one = scene.model;
    short_of_one.rotation.pop_back();
    EXPECT_TRUE(refuses([&] { GradientRenderer(device, short_of_one); }, "rotation"));
    SplatModel bad_degree = scene.model;
    bad_degree.sh_degree = 7;
    EXPECT_TRUE(refuses([&] { GradientRenderer(device, bad_degree); }, "degree 7"));

    GradientRenderer renderer(device, scene.model);
    const ImageF good = weights_of(scene.camera, 8);
    EXPECT_TRUE(refuses([&] { renderer.backward(good); }, "no picture"));
    Camera camera = scene.camera;
    camera.width = 0;
    EXPECT_TRUE(refuses([&] { renderer.render(camera); }, "0 x"));
    camera = scene.camera;
    camera.rotation[1][1] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(refuses([&] { renderer.render(camera); }, "not finite"));
    EXPECT_TRUE(refuses([&] { renderer.render(scene.camera, glm::vec3(nan)); }, "not finite"));
    renderer.render(scene.camera);
    ImageF small(scene.camera.width - 1, scene.camera.height, 3);
    EXPECT_TRUE(refuses([&] { renderer.backward(small); }, "channels"));
    ImageF with_nan = good;
    with_nan.at(3, 2, 1) = nan;
    EXPECT_TRUE(refuses([&] { renderer.backward(with_nan); }, "(3, 2), channel 1"));
    EXPECT_NO_THROW(renderer.backward(good)) << "an error leaves the picture";
    EXPECT_TRUE(refuses([&] { renderer.update(random_scene({.count = 6}).model); }, "differs"));
}

TEST(ViewGradients, a_step_of_rates_that_are_no_numbers_is_refused) {
    Device& device = shared_device();
    const TestScene scene = random_scene({.count = 5, .sh_degree = 1, .seed = 25});
    GpuSplats splats(device, scene.model, true);
    GradientBuffers gradients(device, splats);
    Buffer status(device, "status", sizeof(gpu::FrameStatus));
    AdamUpdate update(device);
    Commands commands(device);
    commands.begin();
    const auto with = [&](const std::function<void(AdamStep&)>& change) {
        AdamStep step;
        change(step);
        return [&, step] { update.record(commands, splats, gradients, status, 1, step); };
    };
    EXPECT_TRUE(
        refuses(with([](AdamStep& s) { s.rate[kRotation] = std::nanf(""); }), "rate of rotation"));
    EXPECT_TRUE(refuses(with([](AdamStep& s) { s.rate[kShDc] = -1; }), "rate of sh_dc"));
    EXPECT_TRUE(refuses(with([](AdamStep& s) { s.beta1 = 1.5; }), "beta1"));
    EXPECT_TRUE(refuses(with([](AdamStep& s) { s.largest_log_scale = std::nanf(""); }), "largest"));
    EXPECT_TRUE(refuses([&] { gradients.upload(kPosition, {1, 2, 3}); }, "15"));
    std::vector<float> values(15, 0.0f);
    values[4] = std::numeric_limits<float>::infinity();
    EXPECT_TRUE(refuses([&] { gradients.upload(kPosition, values); }, "value 4"));
    const GpuSplats others(device, random_scene({.count = 6, .sh_degree = 1}).model, false);
    const GradientBuffers of_others(device, others);
    EXPECT_TRUE(refuses([&] { gradients.record_add(commands, of_others); }, "same splats"));
    EXPECT_TRUE(refuses([&] { update.record(commands, splats, of_others, status, 1, AdamStep{}); },
                        "gradients"));
}

/// Frames of several views of one model, their gradients in buffers of their own.
struct Views {
    Device& device = shared_device();
    const TestScene scene = random_scene({.count = 40, .width = 40, .height = 32, .seed = 26});
    std::vector<Camera> cameras;
    std::vector<ImageF> weights;
    GpuSplats splats{device, scene.model, true};
    FrameBuffers buffers{device, check::forward_options(scene.model, {})};
    Forward forward{device, check::forward_options(scene.model, {})};
    Backward backward{device, check::forward_options(scene.model, {})};

    explicit Views(int count) {
        for (int v = 0; v < count; ++v) {
            cameras.push_back(turned(scene.camera, 0.1 * v));
            weights.push_back(weights_of(scene.camera, 30 + static_cast<std::uint64_t>(v)));
        }
        buffers.reserve(splats.count(), 100'000, 40, 32);
        backward.reserve(splats.count(), buffers.size().intersections);
    }
    void record(int view, GradientBuffers& to, bool add) {
        const auto v = static_cast<size_t>(view);
        FrameView seen{camera_data(cameras[v], scene.model.origin), nullptr, 0, 3, glm::vec3(0)};
        const Buffer buffer = upload_cameras(device, {seen.camera});
        seen.cameras = &buffer;
        Frame& frame = buffers.frame();
        Buffer d_image(device, "d_image", weights[v].data.size() * 4);
        d_image.upload(to_planes(widened(weights[v])));
        Commands commands(device);
        commands.begin();
        forward.record(commands, splats, seen, frame);
        backward.record_gradients(commands, seen, frame, splats, d_image, {to, add});
        commands.submit_and_wait();
        ASSERT_EQ(frame.read_status().overflow, 0u);
    }
};

TEST(ViewGradients, of_several_views_make_one_step_as_in_double) {
    constexpr int kViews = 3;
    Views views(kViews);
    GradientBuffers sum(views.device, views.splats);
    for (int v = 0; v < kViews; ++v) views.record(v, sum, v > 0);
    std::array<std::vector<double>, kAttributeCount> truth;
    for (int v = 0; v < kViews; ++v) {
        const auto at = static_cast<size_t>(v);
        const WalkTruth one = check::walk_in_double(views.scene.model, views.cameras[at],
                                                    widened(views.weights[at]), {});
        for (size_t a = 0; a < kAttributeCount; ++a) {
            truth[a].resize(one.d[a].size());
            for (size_t i = 0; i < one.d[a].size(); ++i) truth[a][i] += one.d[a][i];
        }
    }
    AdamStep step = adam_step({.rate = {2e-3f, 5e-3f, 1e-3f, 0.025f, 2.5e-3f, 1.25e-4f}}, 1);
    AdamUpdate update(views.device);
    Commands commands(views.device);
    commands.begin();
    update.record(commands, views.splats, sum, views.buffers.frame().counters.status, 3, step,
                  1.0f / kViews);
    commands.submit_and_wait();
    const SplatModel after = views.splats.download();
    for (int a = 0; a < kAttributeCount; ++a) {
        const auto at = static_cast<size_t>(a);
        if (truth[at].empty()) continue;
        EXPECT_TRUE(compare_scaled(std::string("sum of d_") + attribute_name(a), truth[at],
                                   sum.download(a), tolerance("gradient_scaled_float32")));
        // Adam from the device's own sums: a first step is the sign of a gradient.
        const std::vector<float> got = sum.download(a);
        const std::vector<float>& before = attribute_values(views.scene.model, a);
        std::vector<double> x(before.begin(), before.end()), g, first(x.size()), second(x.size());
        for (const float value : got) g.push_back(double(value) / kViews);
        const double rate = step.rate[at] * 0.1;  // without the correction
        reference::adam_step<double>(x, g, first, second, rate, 1);
        for (size_t i = 0; i < x.size(); ++i)
            EXPECT_NEAR(attribute_values(after, a)[i], x[i], 1e-4 * rate + 2e-7 * std::abs(x[i]))
                << attribute_name(a) << " " << i;
    }
}

// The order is the caller's: ((a + b) + (c + d)) by buffers is what the host adds in that order.
TEST(ViewGradients, add_in_a_tree_as_the_host_does) {
    Views views(4);
    std::vector<GradientBuffers> leaves;
    std::vector<std::array<std::vector<float>, kAttributeCount>> d(4);
    for (int v = 0; v < 4; ++v) {
        leaves.emplace_back(views.device, views.splats);
        views.record(v, leaves.back(), false);
        for (int a = 0; a < kAttributeCount; ++a)
            d[static_cast<size_t>(v)][static_cast<size_t>(a)] = leaves.back().download(a);
    }
    Commands commands(views.device);
    commands.begin();
    leaves[0].record_add(commands, leaves[1]);
    leaves[2].record_add(commands, leaves[3]);
    leaves[0].record_add(commands, leaves[2]);
    commands.submit_and_wait();
    for (size_t a = 0; a < kAttributeCount; ++a) {
        const std::vector<float> sum = leaves[0].download(static_cast<int>(a));
        for (size_t i = 0; i < sum.size(); ++i)
            EXPECT_EQ(sum[i], (d[0][a][i] + d[1][a][i]) + (d[2][a][i] + d[3][a][i]));
    }
}

// Sums of the positions' gradients in the tree of the views' places, by halves of halves.
std::vector<float> sum_by_halves(const std::vector<std::vector<float>>& views, size_t begin,
                                 size_t end) {
    if (begin >= views.size()) return {};
    if (end - begin == 1) return views[begin];
    const size_t middle = (begin + end) / 2;
    std::vector<float> sum = sum_by_halves(views, begin, middle);
    const std::vector<float> later = sum_by_halves(views, middle, end);
    for (size_t i = 0; i < later.size(); ++i) sum[i] += later[i];
    return sum;
}

// Whole batches and what is left of one at the end of a run.
TEST(GradientTree, adds_views_by_their_places) {
    Views views(0);
    GradientTree tree(views.device, 8);
    tree.reserve(views.splats);
    Pcg32 rng(17);
    Commands commands(views.device);
    for (const size_t count : {8U, 7U, 6U, 5U, 1U}) {
        std::vector<std::vector<float>> d(count);
        tree.begin();
        for (std::vector<float>& one : d) {
            for (size_t i = 0; i < 3 * size_t{views.splats.count()}; ++i)
                one.push_back(static_cast<float>(rng.normal() * std::exp(4 * rng.normal())));
            tree.leaf().upload(kPosition, one);
            commands.begin();
            tree.record_view(commands);
            if (&one == &d.back()) tree.record_end(commands);
            commands.submit_and_wait();
        }
        EXPECT_EQ(tree.sum().download(kPosition), sum_by_halves(d, 0, 8)) << count;
    }
}

// To another rank and back: what no view shows is 0 there, and bytes of other splats are refused.
TEST(PackedGradients, come_back_as_they_were) {
    Views views(1);
    GradientBuffers one(views.device, views.splats), back(views.device, views.splats);
    views.record(0, one, false);
    std::vector<glm::vec2> shown(views.splats.count(), glm::vec2(0));
    one.views().download(std::as_writable_bytes(std::span(shown)));
    for (size_t i = 0; i < shown.size(); i += 3) shown[i] = glm::vec2(0);  // not on their way
    one.views().upload(shown);
    const Bytes bytes = packed_gradients(one, 3);
    const auto of_shown = static_cast<size_t>(
        std::count_if(shown.begin(), shown.end(), [](glm::vec2 v) { return v.y != 0; }));
    ASSERT_GT(of_shown, 0u);
    const size_t mask = (shown.size() + 7) / 8;  // docs/scale.md has these numbers
    EXPECT_EQ(bytes.size(), mask + of_shown * 244);
    EXPECT_EQ(packed_gradients(one, 0).size(), mask + of_shown * 64);
    unpack_gradients(bytes, 3, back);
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<float> before = one.download(a), after = back.download(a);
        const size_t each = one.stride(a);
        for (size_t i = 0; i < after.size(); ++i)
            ASSERT_EQ(after[i], shown[i / each].y == 0 ? 0.0f : before[i]) << attribute_name(a);
    }
    EXPECT_EQ(back.views().download<glm::vec2>(shown.size()), shown);
    for (const size_t size : {size_t{0}, size_t{1}, bytes.size() - 1})
        EXPECT_THROW(unpack_gradients(std::span(bytes).first(size), 3, back), Error) << size;
    EXPECT_THROW(unpack_gradients(bytes, 0, back), Error) << "of another degree";
}

}  // namespace
}  // namespace darb::test
