// SPDX-License-Identifier: MIT
#include "engine/data/metrics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/core/rng.h"

namespace darb {
namespace {

ImageF random_image(int width, int height, int channels, std::uint64_t seed) {
    ImageF image(width, height, channels);
    Pcg32 rng(seed);
    for (float& value : image.data) value = static_cast<float>(rng.uniform());
    return image;
}

/// The definition, pixel by pixel with the full 11 x 11 window in double.
double ssim_by_definition(const ImageF& a, const ImageF& b) {
    double weights[11], norm = 0, total = 0;
    for (int i = 0; i < 11; ++i) norm += weights[i] = std::exp(-(i - 5) * (i - 5) / 4.5);
    for (int c = 0; c < a.channels; ++c)
        for (int y = 0; y < a.height; ++y)
            for (int x = 0; x < a.width; ++x) {
                double m[5] = {0, 0, 0, 0, 0};
                for (int j = -5; j <= 5; ++j)
                    for (int i = -5; i <= 5; ++i) {
                        if (x + i < 0 || x + i >= a.width || y + j < 0 || y + j >= a.height)
                            continue;
                        const double w = weights[i + 5] * weights[j + 5] / (norm * norm);
                        const double p = double{a.at(x + i, y + j, c)};
                        const double q = double{b.at(x + i, y + j, c)};
                        const double terms[5] = {p, q, p * p, q * q, p * q};
                        for (int k = 0; k < 5; ++k) m[k] += w * terms[k];
                    }
                const double vp = m[2] - m[0] * m[0], vq = m[3] - m[1] * m[1];
                const double v = m[4] - m[0] * m[1];
                total += (2 * m[0] * m[1] + 1e-4) * (2 * v + 9e-4) /
                         ((m[0] * m[0] + m[1] * m[1] + 1e-4) * (vp + vq + 9e-4));
            }
    return total / (static_cast<double>(a.width) * a.height * a.channels);
}

TEST(Psnr, constant_difference_has_the_known_value) {
    ImageF a(7, 5, 3), b(7, 5, 3);
    std::fill(a.data.begin(), a.data.end(), 0.5f);
    std::fill(b.data.begin(), b.data.end(), 0.6f);
    EXPECT_NEAR(psnr(a, b), 20.0, 1e-5);
    std::fill(b.data.begin(), b.data.end(), 0.51f);
    EXPECT_NEAR(psnr(a, b), 40.0, 1e-4);
}

TEST(Psnr, equal_images_are_infinite_and_values_are_clamped) {
    ImageF a(2, 2, 3), b(2, 2, 3);
    EXPECT_TRUE(std::isinf(psnr(a, a)));
    std::fill(a.data.begin(), a.data.end(), 7.0f);
    EXPECT_NEAR(psnr(a, b), 0.0, 1e-12);
}

TEST(Psnr, alpha_does_not_count) {
    ImageF a(2, 1, 4), b(2, 1, 4);
    b.at(0, 0, 3) = 1;
    EXPECT_TRUE(std::isinf(psnr(a, b)));
    b.at(0, 0, 0) = 1;
    EXPECT_NEAR(psnr(a, b), 10 * std::log10(6.0), 1e-12);
}

TEST(Ssim, agrees_with_the_definition) {
    for (const auto& [width, height] : {std::pair{37, 23}, {1, 1}, {3, 40}, {64, 2}}) {
        const ImageF a = random_image(width, height, 3, 1);
        ImageF b = random_image(width, height, 3, 2);
        for (std::size_t i = 0; i < b.data.size(); ++i)
            b.data[i] = 0.7f * a.data[i] + 0.3f * b.data[i];
        for (const int threads : {1, 2, 3})
            EXPECT_NEAR(ssim(a, b, threads), ssim_by_definition(a, b), 2e-6)
                << width << " x " << height << ", threads " << threads;
    }
}

TEST(Ssim, equal_images_have_one_and_constants_the_known_value) {
    const ImageF a = random_image(30, 20, 3, 3);
    EXPECT_NEAR(ssim(a, a), 1.0, 1e-6);
    ImageF black(64, 64, 1), white(64, 64, 1);
    std::fill(white.data.begin(), white.data.end(), 1.0f);
    EXPECT_NEAR(ssim(black, white), ssim_by_definition(black, white), 1e-6);
}

}  // namespace
}  // namespace darb
