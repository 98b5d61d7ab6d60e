#include "engine/core/image.h"

#include <gtest/gtest.h>

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

TEST(ImageDeathTest, At_outside_aborts_with_position_and_size) {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    const ImageU8 image(4, 2, 3);
    EXPECT_DEATH(image.at(4, 0, 0), "\\(4, 0, 0\\) in 4x2x3");
    EXPECT_DEATH(image.at(0, -1, 0), "\\(0, -1, 0\\)");
    EXPECT_DEATH(image.at(0, 0, 3), "\\(0, 0, 3\\)");
}

}  // namespace
}  // namespace darb
