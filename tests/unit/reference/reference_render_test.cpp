// SPDX-License-Identifier: MIT
// The tiled walk against a plain one without tiles, and the invariants of an image.
#include "engine/reference/reference_render.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/support/compare_arrays.h"
#include "tests/support/test_scene.h"
#include "tests/unit/reference/reference_scenes.h"

namespace darb::reference {
namespace {

using test::compare;
using test::random_scene;
using test::TestScene;
using test::tolerance;

constexpr test::Tolerance kRounding{"rounding in double", 1e-11, 1e-11, 0, 1 - 1e-14, 1e-11, ""};

// Every pixel meets every splat, by the inverse of the covariance and the kernel family itself.
Image<double> plain_render(const Splats<double>& splats, const Camera& camera,
                           const RenderSettings& settings) {
    const KernelTable& table = kernel_table(splats.kernel, splats.footprint);
    std::vector<ProjectedSplat<double>> list;
    for (size_t i = 0; i < splats.size(); ++i) {
        const auto p = project(splats, i, camera, settings, table);
        if (p.cull == Cull::none) {
            list.push_back(p);
        }
    }
    std::stable_sort(list.begin(), list.end(),
                     [](const auto& a, const auto& b) { return a.depth < b.depth; });
    Image<double> image(camera.width, camera.height, 3);
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            double left = 1;
            for (const auto& p : list) {
                const double dx = x + 0.5 - p.mean_px.x, dy = y + 0.5 - p.mean_px.y;
                const double det = p.cov_xx * p.cov_yy - p.cov_xy * p.cov_xy;
                const double q =
                    (p.cov_yy * dx * dx - 2 * p.cov_xy * dx * dy + p.cov_xx * dy * dy) / det;
                const double w = kernel_value(splats.kernel, splats.footprint, q);
                const double alpha = std::min(0.99, p.opacity * w);
                if (alpha < settings.alpha_cutoff) {
                    continue;
                }
                if (left * (1 - alpha) < settings.transmittance_stop * (1 - 1e-5)) {
                    break;
                }
                for (int c = 0; c < 3; ++c) {
                    image.at(x, y, c) += left * alpha * p.colour[c];
                }
                left *= 1 - alpha;
            }
            for (int c = 0; c < 3; ++c) {
                image.at(x, y, c) += left * settings.background[c];
            }
        }
    }
    return image;
}

TEST(Render, EveryKernelAndFootprint_MatchesThePlainWalk) {
    RenderSettings settings;
    settings.background[1] = 0.4;
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel) {
        for (const Footprint footprint : {Footprint::psi, Footprint::exact}) {
            const TestScene scene = random_scene({.count = 60,
                                                  .width = 70,
                                                  .height = 51,
                                                  .kernel = kernel,
                                                  .footprint = footprint,
                                                  .min_log_scale = -4,
                                                  .max_log_scale = 0,
                                                  .min_logit = -5,
                                                  .max_logit = 5});
            const auto splats = make_splats<double>(scene.model);
            const RenderResult result = render(splats, scene.camera, settings);
            ASSERT_GT(result.visible_count(), 30U);
            EXPECT_TRUE(compare(std::string(kernel_name(kernel)),
                                plain_render(splats, scene.camera, settings).data,
                                result.images.colour.data, kRounding, 3));
        }
    }
}

TEST(Render, OddImageSizes_MatchThePlainWalk) {
    for (const auto& [width, height] : {std::pair(1, 1), std::pair(1, 300), std::pair(33, 16)}) {
        TestScene scene = random_scene({.count = 30});
        scene.camera.width = width;
        scene.camera.height = height;
        scene.camera.cx = width / 2.0;
        scene.camera.cy = height / 2.0;
        const auto splats = make_splats<double>(scene.model);
        const RenderResult result = render(splats, scene.camera, {});
        EXPECT_GT(result.visible_count(), 0U);
        EXPECT_TRUE(compare("size", plain_render(splats, scene.camera, {}).data,
                            result.images.colour.data, kRounding, 3));
    }
}

TEST(Render, PermutedSplats_GiveTheSameImageAndGradients) {
    const TestScene scene = random_scene({.count = 40});
    const auto splats = make_splats<double>(scene.model);
    auto permuted = splats;
    const size_t n = splats.size();
    for (size_t i = 0; i < n; ++i) {
        const size_t from = (i * 7 + 3) % n;
        const auto copy = [&](auto& to, const auto& all, size_t stride) {
            std::copy_n(all.begin() + from * stride, stride, to.begin() + i * stride);
        };
        copy(permuted.position, splats.position, 3);
        copy(permuted.log_scale, splats.log_scale, 3);
        copy(permuted.rotation, splats.rotation, 4);
        copy(permuted.opacity_logit, splats.opacity_logit, 1);
        copy(permuted.sh_dc, splats.sh_dc, 3);
        copy(permuted.sh_rest, splats.sh_rest, 45);
    }
    const auto weights = test::random_weights(scene.camera, 3, 1);
    const auto a = render(splats, scene.camera, {}), b = render(permuted, scene.camera, {});
    EXPECT_EQ(a.images.colour.data, b.images.colour.data);
    const auto da = backward(splats, scene.camera, {}, a, weights);
    const auto db = backward(permuted, scene.camera, {}, b, weights);
    for (size_t i = 0; i < n; ++i) {
        EXPECT_EQ(db.splats.opacity_logit[i], da.splats.opacity_logit[(i * 7 + 3) % n])
            << "splat " << i;
    }
}

TEST(Render, Threads_ChangeNothing) {
    const TestScene scene = random_scene({.count = 100, .width = 130, .height = 70});
    const auto weights = test::random_weights(scene.camera, 3, 1);
    RenderSettings one, four;
    one.threads = 1;
    four.threads = 4;
    const auto a = render(scene.model, scene.camera, one);
    const auto b = render(scene.model, scene.camera, four);
    EXPECT_EQ(a.images.colour.data, b.images.colour.data);
    EXPECT_EQ(backward(scene.model, scene.camera, one, a, weights).splats.position,
              backward(scene.model, scene.camera, four, b, weights).splats.position);
}

TEST(Render, InvisibleSplats_ChangeNothing) {
    const TestScene scene = random_scene({.count = 20, .sh_degree = 0});
    auto splats = make_splats<double>(scene.model);
    const auto before = render(splats, scene.camera, {});
    test::add_splat(splats, {.position = scene.camera.centre()});
    test::add_splat(splats, {.logit = -20});
    test::add_splat(splats, {.rotation = {0, 0, 0, 0}});
    const auto after = render(splats, scene.camera, {});
    EXPECT_EQ(before.images.colour.data, after.images.colour.data);
    EXPECT_EQ(after.visible_count(), before.visible_count());
}

TEST(Render, Float_IsCloseToDouble) {
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel) {
        const TestScene scene =
            random_scene({.count = 60, .width = 64, .height = 48, .kernel = kernel});
        const auto splats = make_splats<double>(scene.model);
        const auto splats_f = make_splats<float>(scene.model);
        const auto weights = test::random_weights(scene.camera, 3, 1);
        Image<float> weights_f(64, 48, 3);
        std::copy(weights.data.begin(), weights.data.end(), weights_f.data.begin());
        const auto expected = render(splats, scene.camera, {});
        const auto got = render(splats_f, scene.camera, {});
        const std::string name(kernel_name(kernel));
        EXPECT_TRUE(compare(name, expected.images.colour.data, got.images.colour.data,
                            tolerance("image_float32"), 3));
        const auto d = backward(splats, scene.camera, {}, expected, weights).splats;
        const auto d_f = backward(splats_f, scene.camera, {}, got, weights_f).splats;
        const test::Tolerance* const allowed = &tolerance("gradient_float32");
        EXPECT_TRUE(compare(name + " position", d.position, d_f.position, *allowed, 3));
        EXPECT_TRUE(compare(name + " log_scale", d.log_scale, d_f.log_scale, *allowed, 3));
        EXPECT_TRUE(compare(name + " rotation", d.rotation, d_f.rotation, *allowed, 4));
        EXPECT_TRUE(compare(name + " opacity", d.opacity_logit, d_f.opacity_logit, *allowed));
    }
}

// 10,000 splats of opacity 5e-4 on one pixel, in random colours. The image is linear in each alpha,
// so that dL/dalpha is the difference of the pixel with that alpha at 1 and at 0.
TEST(Render, TenThousandThinLayers_KeepTheirGradients) {
    constexpr int kLayers = 10000;
    constexpr double kOpacity = 5e-4;
    Pcg32 rng(1);
    Splats<double> splats;
    std::vector<double> reds;
    for (int i = 0; i < kLayers; ++i) {
        reds.push_back(rng.uniform());
        test::add_splat(splats, {.position = {0, 0, 2 + i * 1e-4},
                                 .logit = std::log(kOpacity / (1 - kOpacity)),
                                 .colour = {reds.back(), 0, 0}});
    }
    RenderSettings settings;
    settings.alpha_cutoff = 1e-5;
    const Camera camera = test::small_camera();
    const RenderResult result = render(splats, camera, settings);
    EXPECT_EQ(result.images.contributions.at(4, 3, 0), kLayers);
    EXPECT_NEAR(result.images.transmittance.at(4, 3, 0), std::pow(1 - kOpacity, kLayers), 1e-13);
    Image<double> d_image(camera.width, camera.height, 3);
    d_image.at(4, 3, 0) = 1;
    const Gradients gradients = backward(splats, camera, settings, result, d_image);
    const auto pixel_with = [&](int changed, double alpha) {
        double behind = 0;
        for (int i = kLayers - 1; i >= 0; --i) {
            const double a = i == changed ? alpha : kOpacity;
            behind = a * reds[i] + (1 - a) * behind;
        }
        return behind;
    };
    for (int i = 0; i < kLayers; i += 499) {
        EXPECT_NEAR(gradients.projected[i].d_opacity, pixel_with(i, 1) - pixel_with(i, 0), 1e-12)
            << "layer " << i;
        EXPECT_NEAR(gradients.projected[i].d_colour.x, kOpacity * std::pow(1 - kOpacity, double(i)),
                    1e-15)
            << "layer " << i;
    }
}

TEST(SmallestQ, Box_IsBelowEveryPixelAndTouched) {
    const TestScene scene = random_scene({.count = 50, .width = 64, .height = 64});
    const RenderResult result = render(scene.model, scene.camera, {});
    for (const auto& p : result.projected) {
        if (p.cull != Cull::none) {
            continue;
        }
        const double bound = smallest_q(p, 16, 32, 32, 48);
        double smallest = std::numeric_limits<double>::infinity();
        for (int j = 0; j <= 300; ++j) {  // a fine grid over the box of pixel centres
            for (int i = 0; i <= 300; ++i) {
                const double dx = p.mean_px.x - (16.5 + i * 15.0 / 300);
                const double dy = p.mean_px.y - (32.5 + j * 15.0 / 300);
                const double u = p.l11 * dx + p.l21 * dy, v = p.l22 * dy;
                smallest = std::min(smallest, u * u + v * v);
            }
        }
        EXPECT_LE(bound, smallest + 1e-12);
        EXPECT_NEAR(bound, smallest, 0.01 + 0.02 * smallest);
    }
}

}  // namespace
}  // namespace darb::reference
