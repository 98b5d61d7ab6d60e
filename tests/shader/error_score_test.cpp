// Shares of the error against the reference's backward blend, the opacity's decay, and smaller
// photos against area means in double.
#include "trainer/density/error_score.h"

#include "engine/core/rng.h"
#include "engine/reference/reference_density_control.h"
#include "engine/reference/reference_render.h"
#include "tests/support/compare_arrays.h"
#include "tests/support/scoped_variants.h"
#include "tests/support/shared_device.h"
#include "tests/support/test_scene.h"
#include "tests/support/test_walk.h"
#include "trainer/density/density_control.h"
#include "trainer/resolution_ramp.h"

namespace darb::test {
namespace {

std::vector<std::uint32_t> random_photo(int width, int height, std::uint64_t seed) {
    Pcg32 rng(seed);
    std::vector<std::uint32_t> photo(static_cast<size_t>(width) * static_cast<size_t>(height));
    for (std::uint32_t& pixel : photo) pixel = rng.next() | (rng.below(2) == 0 ? 0xff000000u : 0);
    return photo;
}

double channel(std::uint32_t rgba, int c) {
    return (rgba >> (8 * c) & 255u) / 255.0;
}

struct Shares {
    std::vector<glm::vec2> got;
    ImageF image;
};

/// Forward and the score, of one view, `times` over.
Shares shares_on_device(const TestScene& scene, const std::vector<std::uint32_t>& photo,
                        const LossOptions& photos, const glm::vec3& background, int times) {
    Device& d = shared_device();
    const ForwardOptions options = [&] {
        ForwardOptions o = forward_options(scene.model, {});
        o.store_for_backward = true;
        return o;
    }();
    FrameBuffers buffers(d, options);
    Frame& frame = buffers.frame();
    Forward forward(d, options);
    Backward backward(d, options);
    GpuSplats splats(d, scene.model, true);
    const auto n = splats.count();
    FrameView view{camera_data(scene.camera, scene.model.origin), nullptr, 0, scene.model.sh_degree,
                   background};
    const Buffer cameras = upload_cameras(d, {view.camera});
    view.cameras = &cameras;
    buffers.reserve(n, 200'000, scene.camera.width, scene.camera.height);
    backward.reserve(n, frame.size.intersections);
    Buffer ground(d, "photo", photo.size() * 4), scratch(d, "d_image", photo.size() * 12);
    ground.upload(photo);
    ErrorScore score(d, photos);
    score.reset(n);
    Commands commands(d);
    for (int i = 0; i < times; ++i) {
        commands.begin();
        forward.record(commands, splats, view, frame);
        score.record(commands, view, frame, backward, {frame.images.image, ground, scratch}, n);
        commands.submit_and_wait();
    }
    EXPECT_EQ(frame.read_status().overflow, 0U);
    const std::vector<float> flat = score.state(n);
    Shares result;
    for (size_t i = 0; i < n; ++i) result.got.emplace_back(flat[2 * i], flat[2 * i + 1]);
    const std::vector<float> planes = frame.images.image.download<float>(photo.size() * 3);
    result.image = ImageF(scene.camera.width, scene.camera.height, 3);
    for (size_t p = 0; p < photo.size(); ++p)
        for (size_t c = 0; c < 3; ++c) result.image.data[3 * p + c] = planes[c * photo.size() + p];
    return result;
}

void expect_shares(const LossOptions& photos) {
    const TestScene scene =
        random_scene({.count = 150, .width = 70, .height = 45, .sh_degree = 1, .seed = 12});
    const auto photo = random_photo(70, 45, 4);
    const glm::vec3 background(0.2f, 0.7f, 0.4f);
    const Shares shares = shares_on_device(scene, photo, photos, background, 2);
    Image<double> error(70, 45, 3);
    for (size_t p = 0; p < photo.size(); ++p) {
        double sum = 0;
        for (int c = 0; c < 3; ++c) {
            const double alpha = photos.use_alpha && !photos.use_mask ? channel(photo[p], 3) : 1;
            const double y = channel(photo[p], c) * alpha + double(background[c]) * (1 - alpha);
            const double x = shares.image.data[3 * p + static_cast<size_t>(c)];
            sum += std::abs(std::clamp(x, 0.0, 1.0) - y) / 3;
        }
        const bool masked = photos.use_alpha && photos.use_mask && channel(photo[p], 3) < 0.5;
        error.data[3 * p] = masked ? 0 : sum;
    }
    reference::RenderSettings settings;
    for (int c = 0; c < 3; ++c) settings.background[c] = double(background[c]);
    const auto result = reference::render(scene.model, scene.camera, settings);
    const auto gradients = reference::backward(scene.model, scene.camera, settings, result, error);
    std::vector<double> expected, got;
    double whole = 0, all = 0;
    for (size_t i = 0; i < scene.model.size(); ++i) {
        expected.push_back(2 * gradients.projected[i].d_colour.x / (70.0 * 45));  // two times over
        got.push_back(double(shares.got[i].x));
        EXPECT_GE(shares.got[i].x, 0) << i;
        EXPECT_TRUE(expected[i] == 0 || shares.got[i].y == 1) << i;
        whole += got[i];
    }
    EXPECT_TRUE(compare_scaled("share", expected, got, tolerance("gradient_scaled_float32")));
    for (size_t p = 0; p < photo.size(); ++p)
        all += 2 * error.data[3 * p] * (1 - result.images.transmittance.data[p]) / (70.0 * 45);
    EXPECT_NEAR(whole / all, 1, 1e-3) << "the shares add up to what is not background";
}

TEST(ErrorScore, shares_match_the_reference_over_two_photos) {
    expect_shares({});
}

TEST(ErrorScore, opaque_photos_do_not_read_alpha) {
    expect_shares({.use_alpha = false});
}

TEST(ErrorScore, masked_pixels_do_not_count) {
    expect_shares({.use_alpha = true, .use_mask = true});
}

TEST(ErrorScore, unseen_splats_have_no_share) {
    TestScene scene = random_scene({.count = 20, .width = 32, .height = 32, .seed = 3});
    scene.model.opacity_logit[4] = -20;
    const Shares shares = shares_on_device(scene, random_photo(32, 32, 1), {}, glm::vec3(0), 1);
    EXPECT_EQ(shares.got[4], glm::vec2(0));
}

/// Gradients of all parameters.
std::array<std::vector<float>, kAttributeCount> gradients(const TestScene& scene, bool scored) {
    Device& d = shared_device();
    ForwardOptions options = forward_options(scene.model, {});
    options.store_for_backward = true;
    FrameBuffers buffers(d, options);
    Frame& frame = buffers.frame();
    Forward forward(d, options);
    Backward backward(d, options);
    const GpuSplats splats(d, scene.model, false);
    GradientBuffers into(d, splats);
    const auto n = splats.count();
    const int width = scene.camera.width, height = scene.camera.height;
    FrameView view{camera_data(scene.camera, scene.model.origin), nullptr, 0, scene.model.sh_degree,
                   glm::vec3(0.3f)};
    const Buffer cameras = upload_cameras(d, {view.camera});
    view.cameras = &cameras;
    buffers.reserve(n, 200'000, width, height);
    backward.reserve(n, frame.size.intersections);
    const auto photo = random_photo(width, height, 4);
    Buffer ground(d, "photo", photo.size() * 4), scratch(d, "scratch", photo.size() * 12),
        d_image(d, "d_image", photo.size() * 12);
    ground.upload(photo);
    std::vector<float> weights;
    Pcg32 rng(8);
    for (size_t i = 0; i < photo.size() * 3; ++i)
        weights.push_back(static_cast<float>(rng.uniform(-1, 1)));
    d_image.upload(weights);
    ErrorScore score(d, {});
    score.reset(n);
    Commands commands(d);
    commands.begin();
    forward.record(commands, splats, view, frame);
    if (scored)
        score.record(commands, view, frame, backward, {frame.images.image, ground, scratch}, n);
    backward.record_gradients(commands, view, frame, splats, d_image, {into});
    commands.submit_and_wait();
    EXPECT_EQ(frame.read_status().overflow, 0U);
    std::array<std::vector<float>, kAttributeCount> result;
    for (int a = 0; a < kAttributeCount; ++a) result[static_cast<size_t>(a)] = into.download(a);
    return result;
}

TEST(ErrorScore, a_score_before_changes_no_bit_of_the_gradients) {
    const TestScene scene =
        random_scene({.count = 300, .width = 70, .height = 45, .sh_degree = 1, .seed = 12});
    for (const char* way : {"backward=subgroup", "backward=buckets"}) {
        SCOPED_TRACE(way);
        const ScopedVariants variants(shared_device(), way);
        const auto plain = gradients(scene, false);
        EXPECT_NE(plain[kPosition][0], 0);
        EXPECT_EQ(gradients(scene, true), plain);
    }
}

TEST(DecayOpacity, matches_double_and_leaves_the_rest) {
    const SplatModel model =
        random_scene({.count = 300, .min_logit = -12, .max_logit = 12, .seed = 6}).model;
    Device& d = shared_device();
    GpuSplats splats(d, model, true);
    DensityControl density(d, KERNEL_GAUSSIAN);
    density.decay_opacity(splats, 0.9f);
    const SplatModel after = splats.download();
    for (size_t i = 0; i < 300; ++i)
        EXPECT_NEAR(after.opacity_logit[i],
                    reference::decayed_opacity(model.opacity_logit[i], double{0.9f}), 2e-5)
            << model.opacity_logit[i];
    EXPECT_EQ(after.log_scale, model.log_scale);
    EXPECT_EQ(after.position, model.position);
}

/// Area mean of pixel (x, y) of the smaller photo, weighted by alpha; [3]: the mean alpha.
glm::dvec4 area_mean(const std::vector<std::uint32_t>& photo, const Camera& from, const Camera& to,
                     int x, int y) {
    const double w = double(from.width) / to.width, h = double(from.height) / to.height;
    glm::dvec4 sum(0);
    for (int v = 0; v < from.height; ++v)
        for (int u = 0; u < from.width; ++u) {
            const double across = std::min(u + 1.0, (x + 1) * w) - std::max(double(u), x * w);
            const double down = std::min(v + 1.0, (y + 1) * h) - std::max(double(v), y * h);
            if (across <= 0 || down <= 0) continue;
            const std::uint32_t p = photo[static_cast<size_t>(v * from.width + u)];
            const double alpha = across * down * channel(p, 3);
            sum += glm::dvec4(alpha * channel(p, 0), alpha * channel(p, 1), alpha * channel(p, 2),
                              alpha);
        }
    const double alpha = sum.w;
    if (alpha > 0) sum /= alpha;
    sum.w = alpha / (w * h);
    return sum;
}

TEST(Downsample, is_the_mean_of_the_area) {
    Camera from;
    from.width = 51;
    from.height = 38;
    const auto photo = random_photo(51, 38, 8);
    Device& d = shared_device();
    Buffer buffer(d, "photo", photo.size() * 4);
    buffer.upload(photo);
    ResolutionRamp ramp(d);
    for (const int divisor : {2, 4}) {
        const Camera to = divided(from, divisor);
        const auto got = ramp.downsample(buffer, from, to)
                             .download<std::uint32_t>(size_t(to.width) * size_t(to.height));
        for (int y = 0; y < to.height; ++y)
            for (int x = 0; x < to.width; ++x) {
                const glm::dvec4 mean = area_mean(photo, from, to, x, y);
                for (int c = 0; c < 4; ++c)
                    EXPECT_NEAR(channel(got[static_cast<size_t>(y * to.width + x)], c), mean[c],
                                0.51 / 255)
                        << divisor << ": " << x << ", " << y << ", " << c;
            }
    }
}

}  // namespace
}  // namespace darb::test
