// SPDX-License-Identifier: MIT
// darb train VIDEO, with a program named colmap that notes its calls and takes the scene's own
// model as its result.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "engine/core/files.h"
#include "engine/core/process.h"
#include "engine/data/run_colmap.h"
#include "tests/support/fake_programs.h"
#include "tests/support/run_command.h"

namespace darb {
namespace {

namespace fs = std::filesystem;
using namespace test;

using test::kScene;

fs::path video() {
    return scratch() / "a video.mp4";
}

fs::path program(const std::string& name) {
    return scratch() / "bin" / name;
}

std::string train(const std::string& more = "") {
    return fmt::format("train '{}' -o {} --iterations 1 {}", video().string(),
                       (scratch() / "of_video").string(), more);
}

TEST(VideoCommand, what_is_missing_is_named_with_its_package) {
    write_file_atomic(video(), std::string("no video"));
    const Outcome both = with_path("/nowhere", train());
    EXPECT_EQ(both.code, 2);
    EXPECT_NE(both.err.find("not installed: ffmpeg colmap"), std::string::npos) << both.err;
    EXPECT_NE(both.err.find("apt install ffmpeg colmap"), std::string::npos) << both.err;
    EXPECT_FALSE(fs::exists(scratch() / "of_video"));
    write_fake_program(program("ffmpeg"), "exit 0\n");
    const Outcome one = with_path((scratch() / "bin").string(), train());
    EXPECT_NE(one.err.find("apt install colmap"), std::string::npos) << one.err;
    EXPECT_EQ(one.err.find("apt install ffmpeg"), std::string::npos) << one.err;
    fs::remove(scratch() / "bin" / "ffmpeg");
}

TEST(VideoCommand, sound_and_a_file_that_is_cut_off_are_told_apart) {
    if (!is_installed("ffmpeg")) GTEST_SKIP() << "ffmpeg is not installed";
    write_fake_program(program("colmap"), "exit 1\n");
    const std::string path = (scratch() / "bin").string() + ":/usr/bin:/bin";
    const auto says = [&](const std::string& source, const std::string& part) {
        ASSERT_EQ(std::system(("ffmpeg -nostdin -v error -y -f lavfi -i " + source + " " +
                               shell_quoted(video()))
                                  .c_str()),
                  0);
        if (source.starts_with("testsrc")) {
            const auto whole = read_file(video());
            write_file_atomic(video(), std::span<const std::byte>(whole).first(whole.size() / 2));
        }
        const Outcome o = with_path(path, train());
        EXPECT_EQ(o.code, 2);
        EXPECT_NE(o.err.find(part), std::string::npos) << o.err;
    };
    says("sine=duration=1 -c:a aac", "holds no pictures");
    says("testsrc=size=32x24:duration=1 -c:v mpeg4", "It is incomplete");
}

TEST(VideoCommand, its_sharpest_pictures_go_to_colmap_in_their_order) {
    if (!is_installed("ffmpeg")) GTEST_SKIP() << "ffmpeg is not installed";
    // Each picture three times: as it is between two blurred ones.
    const std::string command = fmt::format(
        "ffmpeg -nostdin -v error -y -framerate 10 -i {}/images/view_%02d.png -frames:v 6 -vf "
        "\"fps=30,boxblur=3:enable='not(eq(mod(n,3),1))',format=yuv420p\" -c:v mpeg4 -q:v 1 {}",
        kScene, shell_quoted(video()));
    ASSERT_EQ(std::system(command.c_str()), 0);
    write_fake_colmap(program("colmap"), scratch() / "calls", kScene);
    const std::string path = (scratch() / "bin").string() + ":/usr/bin:/bin";
    const Outcome o = with_path(path, train("--frames 5"));
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.err.find("5 of "), std::string::npos) << o.err;
    EXPECT_NE(read_text_file(scratch() / "calls").find("sequential_matcher"), std::string::npos);
    EXPECT_EQ(
        read_text_file(scratch() / "calls.photos"),
        "frame_00001.jpg\nframe_00002.jpg\nframe_00003.jpg\nframe_00004.jpg\nframe_00005.jpg\n");
    // It goes on without them, and another number is another set of photos.
    EXPECT_EQ(
        with_path("/nowhere", "train -q --resume -o " + (scratch() / "of_video").string()).code, 0);
    EXPECT_NE(with_path(path, train("--frames 4")).err.find("another number"), std::string::npos);
    const std::string made = read_text_file(scratch() / "of_video" / "frames.txt");
    EXPECT_EQ(made.find(scratch().string()), std::string::npos) << made;
    // A run that was ended while it wrote them goes on.
    write_file_atomic(scratch() / "of_video" / "frames.txt", made + "not all are written\n");
    fs::remove(scratch() / "of_video" / "frames" / "frame_00003.jpg");
    EXPECT_EQ(with_path(path, train("--frames 5")).code, 0);
    EXPECT_TRUE(fs::exists(scratch() / "of_video" / "frames" / "frame_00003.jpg"));
    EXPECT_EQ(read_text_file(scratch() / "of_video" / "frames.txt"), made);
    // What ffmpeg cannot read is its own words.
    write_file_atomic(video(), std::string("no video"));
    fs::remove_all(scratch() / "of_video");
    const Outcome bad = with_path(path, train());
    EXPECT_EQ(bad.code, 2);
    EXPECT_NE(bad.err.find("ffmpeg cannot read it"), std::string::npos) << bad.err;
}

TEST(VideoCommand, as_many_pictures_as_it_takes_unasked_are_written) {
    if (!is_installed("ffmpeg")) GTEST_SKIP() << "ffmpeg is not installed";
    const std::string command =
        "ffmpeg -nostdin -v error -y -f lavfi -i testsrc=size=32x24:rate=30:duration=10 -c:v "
        "mpeg4 " +
        shell_quoted(video());
    ASSERT_EQ(std::system(command.c_str()), 0);
    write_fake_program(program("colmap"), "exit 1\n");
    const std::string path = (scratch() / "bin").string() + ":/usr/bin:/bin";
    const Outcome o = with_path(path, fmt::format("train '{}' -o {} --frames 240 --iterations 1",
                                                  video().string(), (scratch() / "many").string()));
    EXPECT_NE(o.err.find("240 of 300 pictures"), std::string::npos) << o.err;
    EXPECT_TRUE(fs::exists(scratch() / "many" / "frames" / "frame_00240.jpg")) << o.err;
}

TEST(VideoCommand, a_folder_of_the_users_own_is_left_as_it_is) {
    write_file_atomic(video(), std::string("no video"));
    const fs::path mine = scratch() / "mine" / "frames" / "frame_00001.jpg";
    write_file_atomic(mine, std::string("my picture"));
    const Outcome o = darb(fmt::format("train '{}' -o {} --iterations 1", video().string(),
                                       (scratch() / "mine").string()));
    EXPECT_EQ(o.code, 2);
    EXPECT_NE(o.err.find("not of this video"), std::string::npos) << o.err;
    EXPECT_EQ(read_text_file(mine), "my picture");
}

}  // namespace
}  // namespace darb
