// SPDX-License-Identifier: MIT
// darb render without cameras: a turn around a scene, and a camera path of the viewer.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

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

TEST(FilmCommand, An_orthophoto_lies_beside_its_world_file) {
    const std::string ply = scratch() / "scene.ply", folder = scratch() / "map";
    SceneOptions options;
    options.count = 200;
    write_ply(ply, random_scene(options).model);
    const std::string render = fmt::format("render {} --projection orthographic ", ply);
    const Outcome o = darb(render + "--up z --pixel 0.05 -o " + folder);
    ASSERT_EQ(o.code, 0) << o.err;
    const ImageU8 picture = read_image(folder + "/orthophoto.png");
    const auto map = nlohmann::json::parse(read_text_file(folder + "/orthophoto.json"));
    EXPECT_EQ(map["width"], picture.width);
    EXPECT_EQ(map["pixel"], 0.05);
    EXPECT_EQ(read_text_file(folder + "/orthophoto.pgw").substr(0, 15), "0.05\n0\n0\n-0.05\n");
    EXPECT_GT(*std::ranges::max_element(picture.data), 40) << "something is drawn";
    ASSERT_EQ(darb(render + "--up z --pixel 0.05 --from -z -o " + folder + "/below").code, 0);
    const auto below = nlohmann::json::parse(read_text_file(folder + "/below/orthophoto.json"));
    EXPECT_EQ(below["width"], map["width"]) << "the same scene from the other side";
    EXPECT_EQ(below["forward"][2], 1.0);
    expect_refused({{render + "--cameras c -o x", "--cameras"},
                    {render + "--depth png -o x", "--depth"},
                    {render + "--size 64x64 -o x", "--pixel"},
                    {render + "-r 2 -o x", "--pixel"},
                    {render + "--pixel 1e-6 -o x", "--pixel"},
                    {render + "--aperture 1 -o x", "--aperture"},
                    {fmt::format("render {} --pixel 1 -o x", ply), "orthographic"}});
}

TEST(FilmCommand, Lens_and_shutter_blur_films) {
    const std::string ply = scratch() / "scene.ply", path = scratch() / "path.json";
    SceneOptions options;
    options.count = 60;
    write_ply(ply, random_scene(options).model);
    write_file_atomic(path, R"({"key_frames": [
        {"seconds": 0, "eye": [0, 0, -4], "orientation": [1, 0, 0, 0], "fov_y_degrees": 50},
        {"seconds": 1, "eye": [1, 0, -4], "orientation": [1, 0, 0, 0], "fov_y_degrees": 50}]})");
    const auto frame = [&](const std::string& name, const std::string& more) {
        const std::string folder = scratch() / name;
        const Outcome o = darb(fmt::format("render {} --path {} -o {} --size 64x48 --fps 2 {}", ply,
                                           path, folder, more));
        EXPECT_EQ(o.code, 0) << o.err;
        return read_image(folder + "/frame_00001.png").data;
    };
    const auto sharp = frame("sharp", "");
    EXPECT_NE(frame("moved", "--shutter 180 --samples 8"), sharp);
    EXPECT_NE(frame("open", "--aperture 0.2 --focus 4 --samples 8"), sharp);
    EXPECT_EQ(frame("closed", "--aperture 0 --shutter 0"), sharp);
    const std::string render = fmt::format("render {} --path {} -o x ", ply, path);
    expect_refused({{render + "--focus 2", "--aperture"},
                    {render + "--samples 8", "--shutter"},
                    {render + "--aperture 1 --projection equirectangular", "--aperture"},
                    {render + "--force", "--force"},
                    {fmt::format("render {} --cameras c -o x --shutter 90", ply), "--shutter"}});
}

}  // namespace
}  // namespace darb::test
