// SPDX-License-Identifier: MIT
// Signs, orders and axes of the reference, pinned by tiny images worked out by hand.
#include <gtest/gtest.h>

#include "tests/unit/reference/reference_scenes.h"

namespace darb::test {
namespace {

// The brightest pixel of channel 0.
std::pair<int, int> brightest(const RenderResult& result) {
    std::pair<int, int> best{0, 0};
    const Image<double>& image = result.images.colour;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            if (image.at(x, y, 0) > image.at(best.first, best.second, 0)) {
                best = {x, y};
            }
        }
    }
    return best;
}

TEST(PinnedImage, SplatToTheRightAndDown_LightsThePixelToTheRightAndDown) {
    // x/z = 1/2, y/z = 1/4: mean (4.5 + 2, 3.5 + 1), the centre of pixel (6, 4), where w = 1.
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel) {
        const auto splats = splats_of({{.position = {1, 0.5, 2}}}, kernel);
        const RenderResult result = reference::render(splats, small_camera(), {});
        EXPECT_EQ(brightest(result), std::pair(6, 4)) << kernel_name(kernel);
        EXPECT_NEAR(result.images.colour.at(6, 4, 0), 0.5, 1e-12) << kernel_name(kernel);
        EXPECT_EQ(result.images.contributions.at(6, 4, 0), 1) << kernel_name(kernel);
        EXPECT_EQ(result.images.contributions.at(2, 2, 0), 0) << kernel_name(kernel);
    }
}

TEST(PinnedImage, OffCentrePrincipalPoint_ShiftsTheImage) {
    Camera camera = small_camera();
    camera.cx -= 3;
    camera.cy -= 2;
    const RenderResult result =
        reference::render(splats_of({{.position = {1, 0.5, 2}}}), camera, {});
    EXPECT_EQ(brightest(result), std::pair(3, 2));
}

TEST(PinnedImage, CameraPose_IsWorldToCamera) {
    // Camera at world (10, 0, 0) looking along -x with y down: camera z = 10 - x, camera x = z.
    Camera camera = small_camera();
    camera.rotation = glm::transpose(glm::dmat3({0, 0, 1}, {0, 1, 0}, {-1, 0, 0}));
    camera.translation = -(camera.rotation * glm::dvec3(10, 0, 0));
    EXPECT_NEAR(camera.centre().x, 10, 1e-14);
    const auto splats = splats_of({{.position = {8, 0.5, 1}}});
    const RenderResult result = reference::render(splats, camera, {});
    EXPECT_EQ(brightest(result), std::pair(6, 4));
    EXPECT_NEAR(result.projected[0].depth, 2, 1e-14);
}

TEST(PinnedImage, IsotropicSplat_FallsAsTheGaussianOfItsProjectedVariance) {
    // On the axis at z = 2 with standard deviation 1/2: (4 * 1/2 / 2)^2 + 0.3 = 1.3 px^2.
    const auto splats = splats_of({{.log_scale = glm::dvec3(std::log(0.5))}});
    const RenderResult result = reference::render(splats, small_camera(), {});
    EXPECT_NEAR(result.images.colour.at(4, 3, 0), 0.5, 1e-14);
    EXPECT_NEAR(result.images.colour.at(5, 3, 0), 0.5 * std::exp(-0.5 / 1.3), 1e-14);
    EXPECT_NEAR(result.images.colour.at(3, 2, 0), 0.5 * std::exp(-1 / 1.3), 1e-14);
    EXPECT_NEAR(result.images.colour.at(4, 5, 0), 0.5 * std::exp(-2 / 1.3), 1e-14);
}

TEST(PinnedImage, PsiFootprint_ScalesTheCovarianceBeforeTheLowPass) {
    auto splats = splats_of({{.log_scale = glm::dvec3(std::log(0.5))}}, KERNEL_RAISED_COSINE);
    RenderResult result = reference::render(splats, small_camera(), {});
    EXPECT_NEAR(result.projected[0].cov_xx, 0.655153 + 0.3, 1e-6);
    const double d = 1 / std::sqrt(result.projected[0].cov_xx);
    EXPECT_NEAR(result.images.colour.at(5, 3, 0),
                0.5 * (0.5 + 0.5 * std::cos(3.14159265358979 * d / 2.5)), 1e-12);
    splats.footprint = Footprint::exact;
    result = reference::render(splats, small_camera(), {});
    EXPECT_NEAR(result.projected[0].cov_xx, 1.3, 1e-12);
}

TEST(PinnedImage, QuarterTurnHalfway_TiltsFromXTowardsY) {
    // Long along its x axis, turned by +45 degrees about z: x goes to (1, 1) / sqrt 2, which is
    // right and down in the image.
    const double half = 3.14159265358979 / 8;
    const OneSplat tilted = {.log_scale = {0, -4, -4},
                             .rotation = {std::cos(half), 0, 0, std::sin(half)}};
    const RenderResult result = reference::render(splats_of({tilted}), small_camera(), {});
    EXPECT_GT(result.projected[0].cov_xy, 0);
    // Two pixels along both axes: q = 8 / 4.3.
    EXPECT_NEAR(result.images.colour.at(6, 5, 0), 0.5 * std::exp(-4 / 4.3), 1e-3);
    EXPECT_NEAR(result.images.colour.at(2, 1, 0), 0.5 * std::exp(-4 / 4.3), 1e-3);
    EXPECT_LT(result.images.colour.at(6, 1, 0), 0.01);
    EXPECT_LT(result.images.colour.at(2, 5, 0), 0.01);
}

TEST(PinnedImage, QuaternionAboutXAndY_TurnTheRightWay) {
    const double root = std::sqrt(0.5);
    // +90 degrees about y: z goes to x. +90 degrees about x: z goes to y.
    const OneSplat long_z{.log_scale = {-4, -4, 0}};
    OneSplat about_y = long_z, about_x = long_z;
    about_y.rotation = {root, 0, root, 0};
    about_x.rotation = {root, root, 0, 0};
    const RenderResult result =
        reference::render(splats_of({about_y, about_x}), small_camera(), {});
    EXPECT_NEAR(result.projected[0].cov_xx, 4.3, 2e-3);
    EXPECT_NEAR(result.projected[0].cov_yy, 0.3, 2e-3);
    EXPECT_NEAR(result.projected[1].cov_xx, 0.3, 2e-3);
    EXPECT_NEAR(result.projected[1].cov_yy, 4.3, 2e-3);
}

TEST(PinnedImage, QuaternionOfAnyNormOrSign_GivesTheSameImage) {
    const OneSplat one = {.log_scale = {0, -1, -2}, .rotation = {0.4, 0.2, -0.7, 0.5}};
    OneSplat scaled = one;
    scaled.rotation *= -1e4;
    const auto a = reference::render(splats_of({one}), small_camera(), {});
    const auto b = reference::render(splats_of({scaled}), small_camera(), {});
    for (size_t i = 0; i < a.images.colour.data.size(); ++i) {
        EXPECT_NEAR(a.images.colour.data[i], b.images.colour.data[i], 1e-14) << "value " << i;
    }
}

TEST(PinnedImage, TwoOverlappingSplats_BlendByDepthNotByIndex) {
    const OneSplat green_far = {.position = {0, 0, 4}, .colour = {0, 1, 0}};
    const OneSplat red_near = {.position = {0, 0, 2}, .colour = {1, 0, 0}};
    RenderSettings settings;
    settings.background[2] = 0.8;
    const auto check = [&](const Splats<double>& splats) {
        const RenderResult result = reference::render(splats, small_camera(), settings);
        // Both have opacity 1/2 and their peak on the pixel: red 1/2, green 1/2 of the rest.
        EXPECT_NEAR(result.images.colour.at(4, 3, 0), 0.5, 1e-14);
        EXPECT_NEAR(result.images.colour.at(4, 3, 1), 0.25, 1e-14);
        EXPECT_NEAR(result.images.colour.at(4, 3, 2), 0.25 * 0.8, 1e-14);
        EXPECT_NEAR(result.images.transmittance.at(4, 3, 0), 0.25, 1e-14);
        EXPECT_EQ(result.images.contributions.at(4, 3, 0), 2);
    };
    check(splats_of({green_far, red_near}));
    check(splats_of({red_near, green_far}));
}

TEST(PinnedImage, EqualDepths_KeepIndexOrder) {
    const OneSplat red = {.colour = {1, 0, 0}}, green = {.colour = {0, 1, 0}};
    const RenderResult result = reference::render(splats_of({green, red}), small_camera(), {});
    EXPECT_NEAR(result.images.colour.at(4, 3, 1), 0.5, 1e-14);
    EXPECT_NEAR(result.images.colour.at(4, 3, 0), 0.25, 1e-14);
}

TEST(PinnedImage, NoSplats_IsTheBackground) {
    RenderSettings settings;
    settings.background[0] = 0.25;
    settings.background[1] = 1.5;
    const Splats<double> none;
    const RenderResult result = reference::render(none, small_camera(), settings);
    EXPECT_EQ(result.visible_count(), 0U);
    for (int x = 0; x < 9; ++x) {
        EXPECT_EQ(result.images.colour.at(x, 2, 0), 0.25);
        EXPECT_EQ(result.images.colour.at(x, 2, 1), 1.5);
        EXPECT_EQ(result.images.transmittance.at(x, 2, 0), 1);
    }
    const auto gradients = reference::backward(none, small_camera(), settings, result,
                                               random_weights(small_camera(), 3, 1));
    EXPECT_TRUE(gradients.splats.opacity_logit.empty());
}

TEST(PinnedImage, OpaqueSplat_IsClampedAtAlphaMax) {
    const RenderResult result = reference::render(splats_of({{.logit = 20}}), small_camera(), {});
    EXPECT_NEAR(result.images.colour.at(4, 3, 0), 0.99, 1e-14);
    EXPECT_NEAR(result.images.transmittance.at(4, 3, 0), 0.01, 1e-14);
}

// T meets the stop: 0.01, 1e-4, and the third would bring it to 1e-6.
TEST(PinnedImage, TwoOpaqueSplats_AreBothBlended) {
    const auto splats = splats_of({{.position = {0, 0, 2}, .logit = 20},
                                   {.position = {0, 0, 3}, .logit = 20},
                                   {.position = {0, 0, 4}, .logit = 20}});
    RenderSettings settings;
    const int expected[] = {1, 2, 3};
    const double stops[] = {1e-2, 1e-4, 1e-6};
    for (int i = 0; i < 3; ++i) {
        settings.transmittance_stop = stops[i];
        const RenderResult result = reference::render(splats, small_camera(), settings);
        EXPECT_EQ(result.images.contributions.at(4, 3, 0), expected[i]) << stops[i];
        EXPECT_NEAR(result.images.transmittance.at(4, 3, 0), stops[i], 1e-12) << stops[i];
        EXPECT_NEAR(result.images.colour.at(4, 3, 0), 1 - stops[i], 1e-12) << stops[i];
    }
}

TEST(PinnedImage, StopComesBeforeTheSplatThatWouldCrossIt) {
    // Opacity 0.98: T = 0.02, 4e-4, then 8e-6 would be below 1e-4.
    const double logit = std::log(0.98 / 0.02);
    const auto splats = splats_of({{.position = {0, 0, 2}, .logit = logit},
                                   {.position = {0, 0, 3}, .logit = logit},
                                   {.position = {0, 0, 4}, .logit = logit}});
    const RenderResult result = reference::render(splats, small_camera(), {});
    EXPECT_EQ(result.images.contributions.at(4, 3, 0), 2);
    EXPECT_NEAR(result.images.transmittance.at(4, 3, 0), 4e-4, 1e-15);
    EXPECT_NEAR(result.images.colour.at(4, 3, 0), 1 - 4e-4, 1e-14);
}

TEST(PinnedImage, ColourBelowZero_IsBlackWithoutGradient) {
    const auto splats = splats_of({{.colour = {-0.1, 0.6, 0.6}}});
    const RenderResult result = reference::render(splats, small_camera(), {});
    EXPECT_EQ(result.projected[0].colour.x, 0);
    Image<double> ones(9, 7, 3);
    ones.data.assign(ones.data.size(), 1.0);
    const auto gradients = reference::backward(splats, small_camera(), {}, result, ones);
    EXPECT_EQ(gradients.splats.sh_dc[0], 0);
    EXPECT_GT(gradients.splats.sh_dc[1], 0);
}

TEST(PinnedImage, BrighterRightSide_PullsTheMeanToTheRight) {
    // dL/dimage = -1 to the right of the splat: the loss falls when it moves there.
    const auto splats = splats_of({{.log_scale = glm::dvec3(std::log(0.5))}});
    const RenderResult result = reference::render(splats, small_camera(), {});
    Image<double> d_image(9, 7, 3);
    d_image.at(6, 3, 0) = -1;
    const auto gradients = reference::backward(splats, small_camera(), {}, result, d_image);
    EXPECT_LT(gradients.projected[0].d_mean_px.x, 0);
    EXPECT_NEAR(gradients.projected[0].d_mean_px.y, 0, 1e-15);
    EXPECT_LT(gradients.splats.position[0], 0);
}

}  // namespace
}  // namespace darb::test
