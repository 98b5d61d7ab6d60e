// Which pictures of a video are kept.
#include "engine/data/video.h"

#include <gtest/gtest.h>

#include "engine/core/error.h"

namespace darb {
namespace {

TEST(Video, the_sharpest_of_each_interval_is_kept) {
    const std::vector<double> sharpness{1, 5, 2, 9, 3, 4, 7, 7, 8};
    EXPECT_EQ(sharpest_of_intervals(sharpness, 3), (std::vector<std::size_t>{1, 3, 8}));
    EXPECT_EQ(sharpest_of_intervals(sharpness, 1), (std::vector<std::size_t>{3}));
    EXPECT_EQ(sharpest_of_intervals(sharpness, 100).size(), sharpness.size());
    EXPECT_TRUE(sharpest_of_intervals({}, 5).empty());
}

TEST(Video, a_blurred_picture_has_less_variance) {
    constexpr int kSide = 16;
    std::vector<unsigned char> sharp, blurred;
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
            sharp.push_back((x / 4 + y / 4) % 2 == 0 ? 0 : 200);
            blurred.push_back(static_cast<unsigned char>(4 * x + 4 * y));
        }
    EXPECT_GT(laplacian_variance(sharp.data(), kSide, kSide), 1'000);
    EXPECT_EQ(laplacian_variance(blurred.data(), kSide, kSide), 0);
}

TEST(Video, is_told_by_its_name) {
    for (const char* name : {"a.mp4", "b.MOV", "c.webm", "x/d.mkv"})
        EXPECT_TRUE(is_video_name(name));
    for (const char* name : {"a.png", "mp4", "a.mp4.txt", ""}) EXPECT_FALSE(is_video_name(name));
}

TEST(Video, what_is_no_file_is_an_error) {
    EXPECT_THROW(video_sharpness("/nowhere.mp4"), Error);
}

}  // namespace
}  // namespace darb
