// SPDX-License-Identifier: MIT
// The device's gradients of every parameter, for every kernel and footprint, against central
// differences: of the device's own float images, which no formula of the reference takes part in,
// and of the reference's images in double.
#include "engine/core/rng.h"
#include "engine/reference/reference_render.h"
#include "tests/support/own_kernels.h"
#include "tests/support/test_walk.h"

namespace darb::test {
namespace {

Image<double> random_weights(const Camera& camera) {
    Pcg32 rng(5);
    Image<double> weights(camera.width, camera.height, 3);
    for (double& w : weights.data) w = static_cast<float>(rng.normal());
    return weights;
}

double weighted_sum(const Image<double>& weights, const auto& image) {
    double sum = 0;
    for (size_t i = 0; i < weights.data.size(); ++i) sum += weights.data[i] * image.data[i];
    return sum;
}

std::string name_of(const testing::TestParamInfo<std::tuple<int, Footprint>>& info) {
    const auto [kernel, footprint] = info.param;
    return std::string(kernel_name(kernel)) + "_" + std::string(footprint_name(footprint));
}

class KernelGradient : public testing::TestWithParam<std::tuple<int, Footprint>> {
  protected:
    SceneOptions options() const {
        SceneOptions o;
        std::tie(o.kernel, o.footprint) = GetParam();
        o.sh_degree = 1;
        return o;
    }
};

// Splats so wide that no pixel is near the edge of a support; no alpha cut-off, no stop.
TEST_P(KernelGradient, matches_differences_of_the_devices_own_images) {
    SceneOptions o = options();
    o.count = 3;
    o.width = 16;
    o.height = 12;
    const double support = kernel_support(o.kernel);
    const double reach = std::isfinite(support) ? std::sqrt(support) : 2;  // d
    const double footprint = std::sqrt(covariance_scale(o.kernel, o.footprint));
    o.min_log_scale = std::log(2.6 / (reach * footprint));
    o.max_log_scale = o.min_log_scale + 0.4;
    o.max_logit = 1;
    o.seed = 81;
    TestScene s = random_scene(o);
    for (float& x : s.model.position) x *= 0.4f;
    const Image<double> weights = random_weights(s.camera);
    WalkSettings settings;
    settings.alpha_cutoff = 1e-7f;
    settings.transmittance_stop = 0;
    settings.background = {0.2f, 0.5f, 0.8f};
    const DeviceWalk walk = walk_on_device(s.model, s.camera, weights, settings);
    ASSERT_EQ(walk.status.visible, 3U);

    const reference::RenderResult truth = reference::render(s.model, s.camera, {});
    for (const auto& p : truth.projected)  // the premise: every pixel is inside every support
        for (const double x : {0.5, 15.5})
            for (const double y : {0.5, 11.5}) {
                const double dx = p.mean_px.x - x, dy = p.mean_px.y - y;
                const double u = p.l11 * dx + p.l21 * dy, v = p.l22 * dy;
                ASSERT_LT(u * u + v * v, 0.95 * kernel_support(o.kernel));
            }

    Device& device = shared_device();
    GpuSplats splats(device, s.model, false);
    FrameBuffers buffers(device, forward_options(s.model, settings));
    Forward forward(device, forward_options(s.model, settings));
    FrameView view{camera_data(s.camera, s.model.origin), nullptr, 0, 1, settings.background};
    const Buffer cameras = upload_cameras(device, {view.camera});
    view.cameras = &cameras;
    Frame& frame = buffers.frame();
    buffers.reserve(splats.count(), 1024, o.width, o.height);
    Commands commands(device);
    const auto loss = [&] {
        commands.begin();
        forward.record(commands, splats, view, frame);
        commands.submit_and_wait();
        return weighted_sum(
            weights,
            planes_to_image(frame.images.image.download<float>(16 * 12 * 3), o.width, o.height));
    };
    constexpr float kStep = 0x1p-6f;
    for (int a = 0; a < kAttributeCount; ++a) {
        std::vector<float> values = attribute_values(s.model, a);
        std::vector<double> differences;
        for (float& value : values) {
            const float kept = value, above = kept + kStep, below = kept - kStep;
            value = above;
            upload_rows(splats.parameters(a), splats.rows(a), values);
            const double loss_above = loss();
            value = below;
            upload_rows(splats.parameters(a), splats.rows(a), values);
            const double loss_below = loss();
            value = kept;
            upload_rows(splats.parameters(a), splats.rows(a), values);
            differences.push_back((loss_above - loss_below) / (double(above) - double(below)));
        }
        if (values.empty()) continue;
        EXPECT_TRUE(compare_scaled(attribute_name(a), differences, walk.d[a],
                                   tolerance("difference_float32")));
    }
}

// Supports that end within the image, as they do in scenes. A parameter whose two images blend
// different samples sits on a cut-off: it is counted, and left out.
void compare_with_double_images(SceneOptions o, size_t most_left_out) {
    o.count = 6;
    o.seed = 82;
    const TestScene s = random_scene(o);
    const Image<double> weights = random_weights(s.camera);
    WalkSettings settings;
    settings.alpha_cutoff = 0.02f;  // away from where the exact footprints are steep
    const DeviceWalk walk = walk_on_device(s.model, s.camera, weights, settings);
    ASSERT_GT(walk.status.visible, 4U);
    reference::RenderSettings raster;
    raster.alpha_cutoff = settings.alpha_cutoff;
    raster.threads = 1;
    auto splats = reference::make_splats<double>(s.model);
    constexpr double kStep = 1e-6;
    size_t compared = 0, band = 0;
    for (int a = 0; a < kAttributeCount; ++a) {
        std::vector<double> expected, got;
        std::vector<double>& values = attribute_values(splats, a);
        if (values.empty()) continue;
        for (size_t i = 0; i < values.size(); ++i) {
            const double kept = values[i];
            values[i] = kept + kStep;
            const auto above = reference::render(splats, s.camera, raster);
            values[i] = kept - kStep;
            const auto below = reference::render(splats, s.camera, raster);
            values[i] = kept;
            if (above.images.contributions.data != below.images.contributions.data) {
                ++band;
                continue;
            }
            expected.push_back((weighted_sum(weights, above.images.colour) -
                                weighted_sum(weights, below.images.colour)) /
                               (2 * kStep));
            got.push_back(walk.d[a][i]);
        }
        compared += expected.size();
        EXPECT_TRUE(
            compare_scaled(attribute_name(a), expected, got, tolerance("gradient_scaled_float32")));
    }
    EXPECT_GE(compared, 6U * 23U - most_left_out);
    EXPECT_LE(band, most_left_out);
}

// One that meets its formula, and one whose polynomial takes its place and ends with a jump.
INSTANTIATE_TEST_SUITE_P(own, KernelGradient,
                         testing::Combine(testing::ValuesIn(own_kernels()),
                                          testing::Values(Footprint::psi, Footprint::exact)),
                         name_of);

// For built-in kernels without rings, the device is compared with gradients in double, and these
// with differences in double, in separate tests.
class DoubleDifferences : public KernelGradient {};

TEST_P(DoubleDifferences, are_matched) {
    const bool rings = options().kernel < KERNEL_BETA && kernel_pulses(options().kernel) > 1;
    compare_with_double_images(options(), rings ? 12 : 6);  // every ring has two cut-offs
}

INSTANTIATE_TEST_SUITE_P(every_kernel, KernelGradient,
                         testing::Combine(testing::Range(0, KERNEL_COUNT),
                                          testing::Values(Footprint::psi, Footprint::exact)),
                         name_of);

INSTANTIATE_TEST_SUITE_P(own, DoubleDifferences,
                         testing::Combine(testing::ValuesIn(own_kernels()),
                                          testing::Values(Footprint::psi, Footprint::exact)),
                         name_of);

INSTANTIATE_TEST_SUITE_P(every_kernel_with_rings, DoubleDifferences,
                         testing::Combine(testing::Range(KERNEL_COUNT, KERNEL_BETA),
                                          testing::Values(Footprint::psi)),
                         [](const auto& i) {
                             return std::string(kernel_name(std::get<0>(i.param)));
                         });

}  // namespace
}  // namespace darb::test
