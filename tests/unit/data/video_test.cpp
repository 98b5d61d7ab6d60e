// SPDX-License-Identifier: MIT
// Which pictures of a video are kept.
#include "engine/data/video.h"
#include "engine/core/process.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/run_colmap.h"
#include "tests/unit/data/data_files.h"

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

TEST(Video, the_option_that_keeps_every_picture_follows_the_help) {
    for (const char* old : {"-y  overwrite\n-vsync  set video sync method globally\n",
                            "-vsync  set video sync method, use -fps_mode\n"})
        EXPECT_EQ(every_picture_option(old), "-vsync passthrough");
    EXPECT_EQ(every_picture_option("-vsync  deprecated\n-fps_mode  set framerate mode\n"),
              "-fps_mode passthrough");
    EXPECT_EQ(every_picture_option("-fps_mode  set framerate mode\n"), "-fps_mode passthrough");
    EXPECT_EQ(every_picture_option(""), "-fps_mode passthrough") << "of versions to come";
}

// Checks the installed ffmpeg, and one that knows only one of the two options.
TEST(Video, pictures_arrive_in_a_folder_of_any_name_by_old_and_new_options) {
    if (!is_installed("ffmpeg")) GTEST_SKIP() << "ffmpeg is not installed";
    const std::string before = std::getenv("PATH"), real = "PATH='" + before + "' ffmpeg \"$@\"";
    const auto root = test_folder(), bin = root / "bin";
    const auto frames_in = [&](const std::string& name) {
        const auto folder = root / name, video = folder / "-%03d's:\n.mp4";
        std::filesystem::create_directories(folder);
        const std::string make =
            "ffmpeg -nostdin -v error -y -f lavfi -i testsrc=size=32x24:duration=1:rate=8 -c:v "
            "mpeg4 " +
            shell_quoted(video);
        EXPECT_EQ(std::system(make.c_str()), 0);
        setenv("PATH", (bin.string() + ":" + before).c_str(), 1);
        std::string error;
        try {
            EXPECT_EQ(video_sharpness(video).size(), 8u) << name;
            write_video_frames(video, {1, 5}, folder / "frames");
        } catch (const Error& caught) {
            error = caught.what();
        }
        setenv("PATH", before.c_str(), 1);
        EXPECT_EQ(error, "") << name;
        for (const char* picture : {"frame_00001.jpg", "frame_00002.jpg"})
            EXPECT_TRUE(std::filesystem::exists(folder / "frames" / picture)) << name;
    };
    for (const char* name : {"100%", "-d%05d", "a:b", "it's", "two\nlines", "%*[a]{b}"})
        frames_in(name);
    for (const std::string refused : {"vsync", "fps_mode"}) {
        write_file_atomic(bin / "ffmpeg", "#!/bin/sh\ncase \" $* \" in\n*' -" + refused +
                                              " '*) echo \"Unrecognized option '" + refused +
                                              "'.\" >&2; exit 8 ;;\n*'-h long '*) " + real +
                                              " | grep -v -e '^-" + refused + " ' ;;\n*) " + real +
                                              " ;;\nesac\n");
        std::filesystem::permissions(bin / "ffmpeg", std::filesystem::perms::owner_all);
        frames_in("without " + refused);
    }
}

TEST(Video, what_is_no_file_is_an_error) {
    EXPECT_THROW(video_sharpness("/nowhere.mp4"), Error);
}

}  // namespace
}  // namespace darb
