// SPDX-License-Identifier: MIT
// The loss against an SSIM written out window by window, and its gradient against differences; the
// distortion of depths likewise.
#include "engine/reference/reference_loss.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "engine/core/rng.h"
#include "tests/support/compare_arrays.h"

namespace darb::reference {
namespace {

using test::compare;
using test::tolerance;

Image<double> random_image(int width, int height, std::uint64_t seed, double low = 0,
                           double high = 1) {
    Pcg32 rng(seed);
    Image<double> image(width, height, 3);
    for (double& value : image.data) {
        value = rng.uniform(low, high);
    }
    return image;
}

// SSIM of one pixel and channel from its 121 weighted neighbours, zeros outside the image.
double brute_force_ssim(const Image<double>& a, const Image<double>& b, int px, int py, int c) {
    double total = 0, weights[11][11];
    for (int j = 0; j < 11; ++j) {
        for (int i = 0; i < 11; ++i) {
            const double square = (i - 5) * (i - 5) + (j - 5) * (j - 5);
            weights[j][i] = std::exp(-square / (2 * 1.5 * 1.5));
            total += weights[j][i];
        }
    }
    double mean_a = 0, mean_b = 0, aa = 0, bb = 0, ab = 0;
    for (int j = 0; j < 11; ++j) {
        for (int i = 0; i < 11; ++i) {
            const int x = px + i - 5, y = py + j - 5;
            const bool inside = x >= 0 && y >= 0 && x < a.width && y < a.height;
            const double va = inside ? a.at(x, y, c) : 0, vb = inside ? b.at(x, y, c) : 0;
            const double w = weights[j][i] / total;
            mean_a += w * va;
            mean_b += w * vb;
            aa += w * va * va;
            bb += w * vb * vb;
            ab += w * va * vb;
        }
    }
    const double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
    return (2 * mean_a * mean_b + c1) * (2 * (ab - mean_a * mean_b) + c2) /
           ((mean_a * mean_a + mean_b * mean_b + c1) *
            (aa - mean_a * mean_a + bb - mean_b * mean_b + c2));
}

void expect_gradient(const std::string& name, const Image<double>& image,
                     const Image<double>& truth, const LossSettings& settings,
                     const Image<double>& weight) {
    constexpr double kStep = 1e-6;
    const auto result = loss(image, truth, settings, weight);
    Image<double> moved = image;
    std::vector<double> expected;
    for (double& value : moved.data) {
        const double kept = value;
        value = kept + kStep;
        const double above = loss(moved, truth, settings, weight).loss;
        value = kept - kStep;
        const double below = loss(moved, truth, settings, weight).loss;
        value = kept;
        expected.push_back((above - below) / (2 * kStep));
    }
    const test::Tolerance allowed{"loss difference",      1e-9, 1e-6, 0, 1 - 1e-12, 1e-6,
                                  "rounding 1e-16 / step"};
    EXPECT_TRUE(compare(name, expected, result.d_image.data, allowed, 3));
}

TEST(Loss, Ssim_MatchesTheWindowWrittenOut) {
    for (const auto& [width, height] : {std::pair(17, 13), std::pair(1, 1), std::pair(3, 40)}) {
        const auto image = random_image(width, height, 1), truth = random_image(width, height, 2);
        double ssim = 0, l1 = 0;
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                for (int c = 0; c < 3; ++c) {
                    ssim += brute_force_ssim(image, truth, x, y, c);
                    l1 += std::abs(image.at(x, y, c) - truth.at(x, y, c));
                }
            }
        }
        const double count = width * height * 3;
        const auto result = loss(image, truth);
        EXPECT_NEAR(result.ssim, ssim / count, 1e-12) << width << "x" << height;
        EXPECT_NEAR(result.l1, l1 / count, 1e-14) << width << "x" << height;
        EXPECT_NEAR(result.loss, 0.8 * l1 / count + 0.2 * (1 - ssim / count), 1e-13);
    }
}

TEST(Loss, EqualImages_AreLossZeroWithoutGradient) {
    const auto image = random_image(20, 14, 3);
    const auto result = loss(image, image);
    EXPECT_NEAR(result.loss, 0, 1e-15);
    EXPECT_NEAR(result.ssim, 1, 1e-15);
    for (const double d : result.d_image.data) {
        EXPECT_NEAR(d, 0, 1e-15);
    }
}

TEST(LossGradient, EveryPixel_MatchesDifferences) {
    // Values outside [0, 1] too: the rendered image is not clamped.
    expect_gradient("default", random_image(14, 12, 4, -0.2, 1.3), random_image(14, 12, 5), {}, {});
    expect_gradient("L1 only", random_image(9, 8, 6), random_image(9, 8, 7), {.lambda = 0}, {});
    expect_gradient("SSIM only", random_image(9, 8, 8), random_image(9, 8, 9), {.lambda = 1}, {});
}

TEST(LossGradient, WeightedPixels_MatchDifferences) {
    Image<double> weight(14, 12, 1);
    Pcg32 rng(10);
    for (double& value : weight.data) {
        value = rng.uniform() < 0.3 ? 0 : rng.uniform(0, 2);
    }
    expect_gradient("weights", random_image(14, 12, 11), random_image(14, 12, 12), {}, weight);
}

TEST(Loss, WeightZeroOutsideOnePixel_IsThatPixelsLoss) {
    const auto image = random_image(10, 10, 13), truth = random_image(10, 10, 14);
    Image<double> weight(10, 10, 1);
    weight.at(3, 6, 0) = 1;
    double expected = 0;
    for (int c = 0; c < 3; ++c) {
        expected += 0.8 * std::abs(image.at(3, 6, c) - truth.at(3, 6, c)) +
                    0.2 * (1 - brute_force_ssim(image, truth, 3, 6, c));
    }
    EXPECT_NEAR(loss(image, truth, {}, weight).loss, expected / 300, 1e-14);
}

TEST(Loss, WeightOne_IsNoWeight) {
    const auto image = random_image(10, 7, 15), truth = random_image(10, 7, 16);
    Image<double> weight(10, 7, 1);
    weight.data.assign(weight.data.size(), 1.0);
    EXPECT_EQ(loss(image, truth, {}, weight).loss, loss(image, truth).loss);
}

TEST(Loss, Float_IsCloseToDouble) {
    const auto image = random_image(40, 33, 17), truth = random_image(40, 33, 18);
    ImageF image_f(40, 33, 3), truth_f(40, 33, 3);
    for (size_t i = 0; i < image.data.size(); ++i) {
        image_f.data[i] = static_cast<float>(image.data[i]);
        truth_f.data[i] = static_cast<float>(truth.data[i]);
    }
    const auto expected = loss(image, truth);
    const auto got = loss(image_f, truth_f);
    EXPECT_NEAR(got.loss, expected.loss, 1e-6);
    EXPECT_TRUE(compare("d_image", expected.d_image.data, got.d_image.data,
                        tolerance("loss_gradient_float32"), 3));
}

TEST(ToUnitRange, Bytes_AreDividedBy255) {
    ImageU8 photo(1, 1, 3);
    photo.data = {0, 51, 255};
    EXPECT_EQ(to_unit_range<double>(photo).data, (std::vector<double>{0, 0.2, 1}));
}

// One pixel, three splats. D is held where it was.
TEST(ReferenceDistortion, gradients_match_differences_of_the_sum_over_pairs) {
    constexpr double kWeight = 0.7, kStep = 1e-6;
    std::array<double, 3> weights{0.2, 0.45, 0.15}, depths{2.5, 2.6, 2.75};
    const auto images_of = [&] {
        BlendImages<double> images{Image<double>(1, 1, 3), Image<double>(1, 1, 1),
                                   Image<double>(1, 1, 1), Image<std::int32_t>(1, 1, 1),
                                   Image<double>(1, 1, 1)};
        images.transmittance.data[0] = 1;
        for (std::size_t i = 0; i < 3; ++i) {
            images.transmittance.data[0] -= weights[i];
            images.depth.data[0] += weights[i] * depths[i];
            images.square.data[0] += weights[i] * depths[i] * depths[i];
        }
        return images;
    };
    const BlendImages<double> images = images_of();
    const double at = images.depth.data[0] / (1 - images.transmittance.data[0]);
    const auto over_pairs = [&] {
        double sum = 0;
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = 0; j < 3; ++j)
                sum += weights[i] * weights[j] * std::pow((depths[i] - depths[j]) / at, 2);
        return kWeight * sum / (sum + 0.05 * 0.05);
    };
    const DistortionResult got = distortion(images, kWeight);
    EXPECT_NEAR(got.loss, over_pairs(), 1e-12);
    const double by_sum = got.d_depth.data[0], by_square = got.d_depth.data[1];
    for (std::size_t i = 0; i < 3; ++i) {
        const auto difference = [&](double& value) {
            const double kept = value;
            value = kept + kStep;
            const double above = over_pairs();
            value = kept - kStep;
            const double below = over_pairs();
            value = kept;
            return (above - below) / (2 * kStep);
        };
        const double z = depths[i];
        EXPECT_NEAR(got.d_alpha.data[0] + z * (by_sum + z * by_square), difference(weights[i]),
                    1e-8);
        EXPECT_NEAR(weights[i] * (by_sum + 2 * z * by_square), difference(depths[i]), 1e-8);
    }
    EXPECT_EQ(distortion(images, kWeight, {true}).loss, 0);
    BlendImages<double> empty = images;
    empty.transmittance.data[0] = 1;
    EXPECT_EQ(distortion(empty, kWeight).d_alpha.data[0], 0) << "nothing is there";
}

}  // namespace
}  // namespace darb::reference
