// SPDX-License-Identifier: MIT
#include "engine/core/image.h"

#include <gtest/gtest.h>

#include "engine/core/error.h"

namespace darb {
namespace {

TEST(Image, Image_new_is_zero_and_of_the_asked_size) {
    const ImageF image(5, 3, 4);
    EXPECT_EQ(image.data, std::vector<float>(60, 0.0f));
    EXPECT_TRUE(ImageU8().data.empty());
}

TEST(Image, At_counts_channels_then_columns_then_rows) {
    ImageU8 image(4, 2, 3);
    EXPECT_EQ(image.index(1, 0, 0), 3u);
    EXPECT_EQ(image.index(0, 1, 0), 12u);
    image.at(3, 1, 2) = 9;
    EXPECT_EQ(image.data.back(), 9);
}

TEST(Image, Image_beyond_4_GiB_of_pixels_has_64_bit_indices) {
    ImageU8 image;  // without memory: only the arithmetic is of interest
    image.width = image.height = 65536;
    image.channels = 4;
    EXPECT_EQ(image.index(65535, 65535, 3), (std::size_t{1} << 34) - 1);
}

TEST(Image, At_outside_is_an_error_with_position_and_size) {
    const ImageU8 image(4, 2, 3);
    const auto message = [&](int x, int y, int c) -> std::string {
        try {
            static_cast<void>(image.at(x, y, c));
        } catch (const Error& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_NE(message(4, 0, 0).find("(4, 0, 0) in 4x2x3"), std::string::npos);
    EXPECT_NE(message(0, -1, 0).find("(0, -1, 0)"), std::string::npos);
    EXPECT_NE(message(0, 0, 3).find("(0, 0, 3)"), std::string::npos);
    EXPECT_EQ(message(3, 1, 2), "");
}

}  // namespace
}  // namespace darb
