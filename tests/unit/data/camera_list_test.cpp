// SPDX-License-Identifier: MIT
#include "engine/data/camera_list.h"

#include <gtest/gtest.h>

#include "engine/core/files.h"
#include "engine/data/colmap.h"
#include "tests/unit/data/data_files.h"

namespace darb {
namespace {

constexpr const char* kOne =
    R"([{"id": 0, "img_name": "a", "width": 40, "height": 30, "position": [1, 2, 3],
        "rotation": [[0, 0, 1], [1, 0, 0], [0, 1, 0]], "fy": 50, "fx": 60}])";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
}

TEST(CameraList, position_is_the_centre_and_rows_are_camera_to_world) {
    const std::vector<View> views = parse_camera_list(kOne, "cameras.json");
    ASSERT_EQ(views.size(), 1u);
    const Camera& camera = views[0].camera;
    EXPECT_NEAR(glm::length(camera.centre() - glm::dvec3(1, 2, 3)), 0, 1e-12);
    // Third column of camera to world: where the camera looks.
    EXPECT_NEAR(
        glm::length(glm::transpose(camera.rotation) * glm::dvec3(0, 0, 1) - glm::dvec3(1, 0, 0)), 0,
        1e-12);
    EXPECT_EQ(camera.cx, 20);
    EXPECT_EQ(camera.cy, 15);
    EXPECT_EQ(camera.fx, 60);
    EXPECT_EQ(camera.fy, 50);
}

constexpr const char* kNerfstudio =
    R"({"camera_type": "perspective", "render_height": 120, "render_width": 160, "fps": 24,
        "seconds": 1, "crop": null, "keyframes": [], "camera_path": [
        {"camera_to_world": [1,0,0,5, 0,1,0,6, 0,0,1,7, 0,0,0,1], "fov": 90, "aspect": 1.3333},
        {"camera_to_world": [[0,-1,0,5], [1,0,0,6], [0,0,1,7]], "fov": 60, "aspect": 2}]})";

TEST(CameraList, a_camera_path_of_nerfstudio_has_a_camera_a_frame) {
    const auto path = test_folder() / "camera_path.json";
    write_file_atomic(path, std::string(kNerfstudio));
    std::vector<std::string> notes;
    const std::vector<View> views = load_cameras(path, {}, &notes);
    ASSERT_EQ(views.size(), 2u);
    EXPECT_EQ(views[1].name, "frame_00001");
    const Camera& camera = views[0].camera;
    EXPECT_EQ(camera.width, 160);
    EXPECT_EQ(camera.height, 120);
    EXPECT_NEAR(camera.fy, 60, 1e-9);  // 90 degrees from top to bottom
    EXPECT_NEAR(camera.fx, 60, 1e-9);
    EXPECT_NEAR(glm::length(camera.centre() - glm::dvec3(5, 6, 7)), 0, 1e-12);
    // It looks along -z, and +y of the world is up.
    EXPECT_NEAR(glm::length(camera.rotation * glm::dvec3(0, 0, -1) - glm::dvec3(0, 0, 1)), 0,
                1e-12);
    EXPECT_NEAR(glm::length(camera.rotation * glm::dvec3(0, 1, 0) - glm::dvec3(0, -1, 0)), 0,
                1e-12);
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("1 of 2 frames"), std::string::npos) << notes[0];
    EXPECT_EQ(parse_nerfstudio_path(kNerfstudio, "p")->fps, 24);
    EXPECT_FALSE(parse_nerfstudio_path(kOne, "p"));
}

TEST(CameraList, camera_paths_that_cannot_be_drawn_say_why) {
    const auto error = [](const std::string& from, const std::string& to) {
        try {
            parse_nerfstudio_path(replaced(kNerfstudio, from, to), "p.json");
        } catch (const Error& e) {
            EXPECT_EQ(std::string(e.what()).find("json.exception"), std::string::npos) << e.what();
            EXPECT_EQ(e.where.find("p.json"), 0u) << e.where;
            EXPECT_FALSE(e.hint.empty());
            return e.where + ": " + e.reason;
        }
        return std::string("no error");
    };
    for (const char* type : {"fisheye", "equirectangular", "omnidirectional"})
        EXPECT_NE(error("perspective", type).find(type), std::string::npos);
    EXPECT_NE(error("\"fov\": 60", "\"fov\": 180").find("frame 2 of 2"), std::string::npos);
    EXPECT_NE(error("\"fov\": 60,", "").find("fov"), std::string::npos);
    EXPECT_NE(error("0,0,0,1]", "0,0]").find("14 numbers"), std::string::npos);
    EXPECT_NE(error("[1,0,0,5", "[null,0,0,5").find("frame 1 of 2"), std::string::npos);
    EXPECT_NE(error("\"render_width\": 160", "\"render_width\": 0").find("render_width"),
              std::string::npos);
    EXPECT_NE(error("\"fps\": 24", "\"fps\": -1").find("frames a second"), std::string::npos);
}

TEST(CameraList, other_json_is_refused_by_line_and_column_in_words_of_its_own) {
    const auto error = [](const std::string& text) {
        try {
            parse_camera_list(text, "c.json");
        } catch (const Error& e) {
            const std::string what = e.what();
            EXPECT_EQ(what.find("json.exception"), std::string::npos) << what;
            EXPECT_EQ(what.find("parse"), std::string::npos) << what;
            return what;
        }
        return std::string("no error");
    };
    EXPECT_NE(error("").find("c.json: is empty"), std::string::npos);
    EXPECT_NE(error("[{\"id\": 0,\n \"fx\": NaN}]").find("line 2, column 8, at 'NaN}]', as JSON"),
              std::string::npos)
        << error("[{\"id\": 0,\n \"fx\": NaN}]");
    EXPECT_NE(error("[{\"id\": 0,\n").find("ends in line 2 before it is complete"),
              std::string::npos)
        << error("[{\"id\": 0,\n");
    EXPECT_NE(error("[{'id': 0}]").find("line 1, column 3, at ''id'"), std::string::npos)
        << error("[{'id': 0}]");
    EXPECT_NE(error("\xff\xfe[").find("UTF-16"), std::string::npos);
}

TEST(CameraList, written_list_reads_back) {
    std::vector<View> views = parse_camera_list(kOne, "cameras.json");
    views[0].camera.cx = 17.25;
    const auto path = test_folder() / "sub" / "cameras.json";
    write_camera_list(path, views);
    const std::vector<View> again = load_cameras(path);
    EXPECT_EQ(again[0].camera.cx, 17.25);
    EXPECT_EQ(again[0].camera.cy, 15);
    EXPECT_NEAR(glm::length(again[0].camera.translation - views[0].camera.translation), 0, 1e-12);
    EXPECT_EQ(load_cameras(path.parent_path())[0].name, "a");
}

TEST(CameraList, a_rolling_shutter_reads_back_and_a_broken_one_is_an_error) {
    View view;
    view.name = "a";
    view.camera = {.width = 8, .height = 6, .fx = 5, .fy = 5, .cx = 4, .cy = 3};
    view.camera.shutter = {true, {0.1, 0.2, -0.3}, {1e-3, 2, 3}};
    const std::string text = format_camera_list({view, view});
    const ShutterTerms read = parse_camera_list(text, "c.json")[1].camera.shutter;
    EXPECT_TRUE(read.active);
    EXPECT_EQ(read.turn, view.camera.shutter.turn);
    EXPECT_EQ(read.move, view.camera.shutter.move);
    std::string broken = text;
    broken.replace(broken.find("\"turn\""), 6, "\"trun\"");
    EXPECT_NE(error_of([&] { parse_camera_list(broken, "c.json"); }).find("turn"),
              std::string::npos);
}

TEST(CameraList, names_that_are_no_utf_8_are_written) {
    std::vector<View> views = parse_camera_list(kOne, "cameras.json");
    views[0].name = "f\xfcr.jpg";
    EXPECT_EQ(parse_camera_list(format_camera_list(views), "c.json").at(0).name,
              "f\xef\xbf\xbdr.jpg");
}

TEST(CameraList, every_error_comes_with_a_remedy) {
    const std::pair<const char*, const char*> cases[] = {{"60", "\"60\""},
                                                         {"40", "0"},
                                                         {"\"a\"", "5"},
                                                         {"[1, 2, 3]", "[1, 2]"},
                                                         {"rotation", "turn"}};
    for (const auto& one : cases) {
        const std::string error =
            error_of([&] { parse_camera_list(replaced(kOne, one.first, one.second), "c.json"); });
        EXPECT_NE(error.find("\n  "), std::string::npos) << error;
    }
    EXPECT_NE(error_of([] { parse_camera_list("[1]", "c.json"); }).find("\n  "), std::string::npos);
}

TEST(CameraList, capitals_of_the_extension_do_not_matter) {
    const auto path = test_folder() / "CAMERAS.JSON";
    write_file_atomic(path, kOne);
    EXPECT_EQ(load_cameras(path).size(), 1u);
}

TEST(CameraList, bad_records_are_errors_that_name_them) {
    const auto error = [](const std::string& text) {
        return error_of([&] { parse_camera_list(text, "c.json"); });
    };
    EXPECT_NE(error("[").find("JSON"), std::string::npos);
    EXPECT_NE(error("[]").find("no list"), std::string::npos);
    EXPECT_NE(error("[1]").find("camera 1 of 1"), std::string::npos);
    EXPECT_NE(error(replaced(kOne, "60", "0")).find("focal"), std::string::npos);
    EXPECT_NE(error(replaced(kOne, "60", "-1")).find("focal"), std::string::npos);
    EXPECT_NE(error(replaced(kOne, "[0, 0, 1]", "[0, 0, 2]")).find("orthonormal"),
              std::string::npos);
    EXPECT_NE(error(replaced(kOne, "[0, 0, 1]", "[0, 0, -1]")).find("mirrors"), std::string::npos);
    EXPECT_NE(error(replaced(kOne, "[1, 2, 3]", "[1, 2]")).find("position"), std::string::npos);
    EXPECT_NE(error(replaced(kOne, "\"width\": 40", "\"width\": 0")).find("width"),
              std::string::npos);
}

TEST(CameraList, truncated_anywhere_is_an_error) {
    const std::string text(kOne);
    const size_t end = text.find_last_not_of(" \n");
    for (size_t length = 0; length < end; ++length)
        EXPECT_FALSE(error_of([&] { parse_camera_list(text.substr(0, length), "c.json"); }).empty())
            << length;
}

TEST(CameraList, original_list_of_3dgs_sees_its_points) {
    const auto folder = test_data() / "fixtures" / "inria_miku_output";
    DARB_NEED_DATA(folder);
    const std::vector<View> views = load_cameras(folder / "cameras.json");
    EXPECT_EQ(views.size(), 97u);
    std::size_t dropped = 0, seen = 0;
    const auto file = folder / "sparse_0_points3D.bin";
    const PointCloud points = parse_colmap_points(read_file(file), file.string(), dropped);
    EXPECT_EQ(points.size(), 25784u);
    const Camera& camera = views[0].camera;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double* at = &points.position[i * 3];
        const glm::dvec3 p = camera.rotation * glm::dvec3(at[0], at[1], at[2]) + camera.translation;
        const double x = camera.fx * p.x / p.z + camera.cx, y = camera.fy * p.y / p.z + camera.cy;
        if (p.z > 0 && x > 0 && y > 0 && x < camera.width && y < camera.height) ++seen;
    }
    EXPECT_GT(seen, points.size() / 5);
}

TEST(LoadCameras, data_sets_need_no_photos) {
    const auto model = test_data() / "fixtures" / "colmap_bonsai_3img";
    DARB_NEED_DATA(model);
    EXPECT_EQ(load_cameras(model).size(), 3u);
    EXPECT_EQ(load_cameras(test_data() / "lego_nerf_synthetic_200_tiny").size(), 37u);
    EXPECT_EQ(
        load_cameras(test_data() / "fox_800" / "transforms_instantngp_original_67.json").size(),
        67u);
}

}  // namespace
}  // namespace darb
