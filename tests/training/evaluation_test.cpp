// SPDX-License-Identifier: MIT
// How a render is compared with a photo: alpha as transparency, and alpha as a mask.
#include "trainer/run/run_report.h"

#include <gtest/gtest.h>

#include <cmath>

namespace darb {
namespace {

// 8 x 8, grey 51 = 0.2; the right half has the given alpha.
ImageU8 half_photo(std::uint8_t alpha) {
    ImageU8 photo(8, 8, 4);
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x) {
            for (int c = 0; c < 3; ++c) photo.at(x, y, c) = 51;
            photo.at(x, y, 3) = x < 4 ? 255 : alpha;
        }
    return photo;
}

ImageF render(float left, float right) {
    ImageF image(8, 8, 3);
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x)
            for (int c = 0; c < 3; ++c) image.at(x, y, c) = x < 4 ? left : right;
    return image;
}

TEST(CompareView, alpha_shows_the_background) {
    const glm::vec3 white(1.0f);
    EXPECT_EQ(compare_view("v", render(0.2f, 1.0f), half_photo(0), white).psnr_db, 100.0);
    EXPECT_LT(compare_view("v", render(0.2f, 0.2f), half_photo(0), white).psnr_db, 10.0);
}

TEST(CompareView, masked_pixels_do_not_count) {
    const glm::vec3 white(1.0f);
    const ViewMetrics far_off = compare_view("v", render(0.3f, 0.9f), half_photo(0), white, true);
    const ViewMetrics same = compare_view("v", render(0.3f, 0.2f), half_photo(0), white, true);
    EXPECT_EQ(far_off.psnr_db, same.psnr_db);
    EXPECT_EQ(far_off.ssim, same.ssim);
    // An error of 0.1 on every pixel that counts: 20 dB, however many are masked.
    EXPECT_NEAR(far_off.psnr_db, 20.0, 1e-3);
    EXPECT_NEAR(compare_view("v", render(0.3f, 0.3f), half_photo(255), white, true).psnr_db, 20.0,
                1e-3);
}

TEST(CompareView, a_view_masked_throughout_has_no_part_in_the_mean) {
    const glm::vec3 white(1.0f);
    ImageU8 masked = half_photo(0);
    for (size_t i = 3; i < masked.data.size(); i += 4) masked.data[i] = 0;
    Evaluation evaluation;
    evaluation.views.push_back(compare_view("v", render(0.3f, 0.9f), masked, white, true));
    EXPECT_TRUE(std::isnan(evaluation.views[0].psnr_db));
    take_means(evaluation);
    EXPECT_TRUE(std::isnan(evaluation.psnr_db));
    evaluation.views.push_back(compare_view("w", render(0.3f, 0.9f), half_photo(0), white, true));
    take_means(evaluation);
    EXPECT_EQ(evaluation.psnr_db, evaluation.views[1].psnr_db);
    EXPECT_EQ(evaluation.ssim, evaluation.views[1].ssim);
}

}  // namespace
}  // namespace darb
