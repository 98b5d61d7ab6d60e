// SPDX-License-Identifier: MIT
// darb render without cameras: a turn around a scene, and a camera path of the viewer.
#include <gtest/gtest.h>

#include <filesystem>

#include "engine/core/process.h"
#include "engine/data/image_io.h"
#include "engine/data/run_colmap.h"
#include "engine/scene/ply.h"
#include "tests/support/run_command.h"
#include "tests/support/test_scene.h"

namespace darb::test {
namespace {

TEST(FilmCommand, Render_without_cameras_turns_or_follows_a_path) {
    const std::string ply = scratch() / "scene.ply", turn = scratch() / "turn",
                      film = scratch() / "film", path = scratch() / "path.json";
    SceneOptions options;
    options.count = 60;
    write_ply(ply, random_scene(options).model);
    const std::string size = " --size 64x48 --fps 2";
    const Outcome o = darb(fmt::format("render {} -o {}{} --seconds 2", ply, turn, size));
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(count_png(turn), 4U) << o.out;
    const ImageU8 first = read_image(turn + "/frame_00000.png");
    EXPECT_EQ(first.width, 64);
    EXPECT_NE(first.data, read_image(turn + "/frame_00002.png").data);
    EXPECT_EQ(fs::exists(turn + "/video.mp4"), is_installed("ffmpeg"));
    EXPECT_EQ(o.out.find("video.mp4") != std::string::npos, is_installed("ffmpeg")) << o.out;
    write_file_atomic(path, R"({"key_frames": [
        {"seconds": 0, "eye": [0, 0, -4], "orientation": [1, 0, 0, 0], "fov_y_degrees": 50},
        {"seconds": 1, "eye": [0, 0, -3], "orientation": [1, 0, 0, 0], "fov_y_degrees": 50}]})");
    const Outcome p = darb(fmt::format("render {} --path {} -o {}{}", ply, path, film, size));
    ASSERT_EQ(p.code, 0) << p.err;
    EXPECT_EQ(count_png(film), 3U) << p.out;
    EXPECT_NE(read_image(film + "/frame_00000.png").data,
              read_image(film + "/frame_00002.png").data);
}

TEST(FilmCommand, What_is_no_scene_says_what_to_type) {
    const fs::path folder = scratch() / "no_scene";
    for (const char* name : {"photos", "set/images", "set/sparse/0", "run"})
        fs::create_directories(folder / name);
    for (const char* name : {"photos/a.jpg", "set/images/a.png", "run/run.jsonl", "clip.mp4",
                             "run/checkpoint.darb", "page.html", "cameras.json"})
        write_file_atomic(folder / name, "{}");
    const auto expect_said = [&](const std::string& what, const std::string& said,
                                 const std::string& hint) {
        for (const char* command : {"view --screenshot /dev/null", "render -o x"}) {
            const Outcome o = darb(fmt::format("{} '{}'", command, (folder / what).string()));
            EXPECT_EQ(o.code, 2) << o.err;
            EXPECT_NE(o.err.find(said), std::string::npos) << o.err;
            EXPECT_NE(o.err.find(hint), std::string::npos) << o.err;
        }
    };
    expect_said("photos", "is a folder of photos",
                "/photos -o OUT. Then look at it: darb view OUT");
    expect_said("set", "is a data set", "/set -o OUT");
    expect_said("run", "has not saved a scene yet", "--resume");
    expect_said("clip.mp4", "is a video", "/clip.mp4 -o OUT");
    expect_said("run/checkpoint.darb", "is the checkpoint of a run", "the folder of the run");
    expect_said("page.html", "is a web page", "browser");
    expect_said("cameras.json", "is no scene", "--cameras");
}

TEST(FilmCommand, What_goes_with_cameras_alone_is_refused) {
    expect_refused({{"render a.ply -o b -r 2", "--size"},
                    {"render a.ply -o b --lens original", "--cameras"},
                    {"render a.ply -o b --depth png", "--depth"},
                    {"render a.ply -o b --cameras c --path d.json", "--cameras"}});
}

}  // namespace
}  // namespace darb::test
