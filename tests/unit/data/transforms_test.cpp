// SPDX-License-Identifier: MIT
#include "engine/data/transforms.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/core/files.h"
#include "engine/data/camera_list.h"
#include "engine/data/colmap.h"
#include "engine/data/image_io.h"
#include "engine/data/lens_model.h"
#include "tests/unit/data/data_files.h"

namespace darb {
namespace {

/// Camera at (1, 2, 3), OpenGL axes equal to the world's.
constexpr const char* kPose = R"("transform_matrix": [[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]])";

std::string frame(const std::string& path, const std::string& more = "") {
    return R"({"file_path": ")" + path + "\", " + more + kPose + "}";
}

std::string file(const std::string& head, const std::string& frames) {
    return "{" + head + R"("frames": [)" + frames + "]}";
}

LensModel lens_of(const std::string& head, const std::string& of_frame = "") {
    const TransformsFile parsed = parse_transforms(file(head, frame("a", of_frame)), "t.json");
    return lens_from_transforms(parsed.frames.at(0).intrinsics, 80, 60, "t.json");
}

std::string parse_error(const std::string& text) {
    return error_of([&] { parse_transforms(text, "t.json"); });
}

TEST(Transforms, opengl_axes_become_those_of_colmap) {
    const TransformsFile parsed = parse_transforms(file("", frame("a.png")), "t.json");
    const TransformsFrame& only = parsed.frames.at(0);
    // A point 5 before the OpenGL camera (down -z), 1 to the right, 2 up.
    const glm::dvec3 p = only.rotation * glm::dvec3(1 + 1, 2 + 2, 3 - 5) + only.translation;
    EXPECT_NEAR(glm::length(p - glm::dvec3(1, -2, 5)), 0, 1e-12);
}

TEST(Transforms, intrinsics_of_every_dialect) {
    const LensModel angle = lens_of(R"("camera_angle_x": 1.5707963267948966, )");
    EXPECT_EQ(angle.model, "PINHOLE");
    EXPECT_NEAR(angle.parameters[0], 40, 1e-12);
    EXPECT_NEAR(angle.parameters[1], 40, 1e-12);
    EXPECT_EQ(angle.parameters[2], 40);
    EXPECT_EQ(angle.parameters[3], 30);

    const LensModel ngp = lens_of(
        R"("w": 1080.0, "h": 1920, "fl_x": 1375, "fl_y": 1374, "cx": 554, "cy": 965, "camera_angle_x": 9,
           "k1": 0.05, "k2": -0.08, "p1": -0.001, "p2": 0.0002, )");
    EXPECT_EQ(ngp.model, "OPENCV");
    EXPECT_EQ(ngp.width, 1080);
    EXPECT_EQ(ngp.parameters,
              (std::vector<double>{1375, 1374, 554, 965, 0.05, -0.08, -0.001, 0.0002}));

    const std::string fisheye = R"("fl_x": 50, "k1": 1, "k2": 2, "k3": 3, "k4": 4, )";
    EXPECT_EQ(lens_of(fisheye + R"("camera_model": "OPENCV_FISHEYE", )").parameters,
              (std::vector<double>{50, 50, 40, 30, 1, 2, 3, 4}));
    EXPECT_EQ(lens_of(fisheye + R"("is_fisheye": true, )").model, "OPENCV_FISHEYE");
    EXPECT_EQ(lens_of(fisheye + R"("is_fisheye": 1, )").model, "OPENCV_FISHEYE");
    EXPECT_EQ(lens_of(R"("fl_x": 50, "is_fisheye": 0, )").model, "PINHOLE");
    EXPECT_NE(error_of([] { lens_of(R"("fl_x": 50, "is_fisheye": "yes", )"); }).find("is_fisheye"),
              std::string::npos);
    EXPECT_EQ(lens_of(R"("fl_x": 50, "k1": 1, "k3": 3, )").parameters,
              (std::vector<double>{50, 50, 40, 30, 1, 0, 0, 0, 3, 0, 0, 0}));
}

TEST(Transforms, frames_override_the_file) {
    const LensModel lens =
        lens_of(R"("fl_x": 50, "fl_y": 51, "cx": 1, "w": 80, "h": 60, "k1": 1, )",
                R"("fl_x": 70, "w": 100, "k1": 0, )");
    EXPECT_EQ(lens.model, "PINHOLE");
    EXPECT_EQ(lens.width, 100);
    EXPECT_EQ(lens.parameters, (std::vector<double>{70, 70, 1, 30}));
}

TEST(Transforms, a_frames_own_angle_outranks_the_files_focal_length) {
    const LensModel lens = lens_of(R"("fl_x": 50, "fl_y": 51, "camera_angle_y": 1, )",
                                   R"("camera_angle_x": 1.5707963267948966, )");
    EXPECT_NEAR(lens.parameters[0], 40, 1e-12);
    EXPECT_NEAR(lens.parameters[1], 40, 1e-12);
}

TEST(Transforms, k4_is_the_denominators_where_the_camera_is_full_opencv_alone) {
    const std::string k = R"("fl_x": 50, "k1": 1, "k2": 2, "k3": 3, "k4": 4, "p1": 5, )";
    const LensModel nerfstudio = lens_of(k + R"("camera_model": "OPENCV", )");
    EXPECT_EQ(nerfstudio.model, kFourRadial);
    EXPECT_EQ(nerfstudio.parameters, (std::vector<double>{50, 50, 40, 30, 1, 2, 5, 0, 3, 4}));
    const std::vector<double> rational{50, 50, 40, 30, 1, 2, 5, 0, 3, 4, 0, 0};
    EXPECT_EQ(lens_of(k + R"("camera_model": "FULL_OPENCV", )").parameters, rational);
    EXPECT_EQ(lens_of(k + R"("k6": 6, )").model, "FULL_OPENCV");
}

TEST(Transforms, numbers_may_be_strings) {
    const LensModel lens =
        lens_of(R"("fl_x": "50.5", "w": "100", "h": 60, "k1": "-1e-2", "k2": "0", )");
    EXPECT_EQ(lens.width, 100);
    EXPECT_EQ(lens.parameters, (std::vector<double>{50.5, 50.5, 50, 30, -0.01, 0, 0, 0}));
    for (const char* bad : {"", "5px", " 5", "five"})
        EXPECT_NE(error_of([&] {
                      lens_of(R"("fl_x": ")" + std::string(bad) + R"(", )");
                  }).find("fl_x is not a number"),
                  std::string::npos)
            << bad;
}

TEST(Transforms, camera_models_may_be_in_lower_case) {
    EXPECT_EQ(lens_of(R"("fl_x": 50, "k1": 1, "camera_model": "opencv", )").model, "OPENCV");
    EXPECT_EQ(lens_of(R"("fl_x": 50, "camera_model": "OpenCV_fisheye", )").model, "OPENCV_FISHEYE");
}

TEST(Transforms, poses_with_a_uniform_scale_are_divided_by_it) {
    const auto parsed = [](const std::string& rows) {
        return parse_transforms(file("", R"({"file_path": "a", "transform_matrix": [)" + rows +
                                             R"(,[0,0,0,1]]},)" + frame("b")),
                                "t.json");
    };
    const TransformsFile half = parsed("[0,-0.5,0,1],[0.5,0,0,2],[0,0,0.5,3]");
    const TransformsFile whole = parsed("[0,-1,0,1],[1,0,0,2],[0,0,1,3]");
    EXPECT_EQ(half.scaled_poses, 1u);
    EXPECT_EQ(whole.scaled_poses, 0u);
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(glm::length(half.frames[0].rotation[c] - whole.frames[0].rotation[c]), 0,
                    1e-12);
    EXPECT_NEAR(glm::length(half.frames[0].translation - whole.frames[0].translation), 0, 1e-12);
    for (const char* bad :
         {"[0.5,0.2,0,1],[0,0.5,0,2],[0,0,0.5,3]", "[0.5,0,0,1],[0,0.6,0,2],[0,0,0.5,3]",
          "[-0.5,0,0,1],[0,0.5,0,2],[0,0,0.5,3]", "[0,0,0,1],[0,0,0,2],[0,0,0,3]"})
        EXPECT_FALSE(error_of([&] { parsed(bad); }).empty()) << bad;
}

TEST(Transforms, a_reconstruction_of_opensfm_is_named_as_what_it_is) {
    const auto folder = test_folder();
    write_file_atomic(folder / "reconstruction.json",
                      std::string(R"([{"cameras": {}, "shots": {}, "points": {}}])"));
    for (const auto& path : {folder, folder / "reconstruction.json"}) {
        const std::string error = error_of([&] { load_dataset(path); });
        EXPECT_NE(error.find("OpenSfM"), std::string::npos) << error;
        EXPECT_NE(error.find("export_colmap"), std::string::npos) << error;
    }
}

TEST(Transforms, val_filenames_are_the_test_set_where_there_is_no_other) {
    const auto names = [](const std::string& head) {
        return parse_transforms(file(head, frame("a")), "t.json").test_filenames;
    };
    const std::string val = R"("val_filenames": ["b"], )";
    EXPECT_EQ(names(val), std::vector<std::string>{"b"});
    EXPECT_EQ(names(R"("test_filenames": [], )" + val), std::vector<std::string>{"b"});
    EXPECT_EQ(names(R"("test_filenames": ["c"], )" + val), std::vector<std::string>{"c"});
}

/// All notes of a file in one text.
std::string notes_of(const std::string& head, const std::string& frames) {
    std::string all;
    for (const std::string& note : parse_transforms(file(head, frames), "t.json").notes)
        all += note + "\n";
    return all;
}

TEST(Transforms, keys_that_are_not_read_but_matter_are_named_and_harmless_ones_are_not) {
    const std::string harmless =
        R"("aabb_scale": 16, "scale": 0.5, "offset": [0.5, 0.5, 0.5], "orientation_override": "up",
           "applied_transform": [[1,0,0,0],[0,1,0,0],[0,0,1,0]], "rolling_shutter": [0, 0, 0, 0],
           "white_transparent": false, "skew": 0, )";
    EXPECT_EQ(notes_of(harmless, frame("a", R"("sharpness": 50, "colmap_im_id": 3, )")), "");
    for (const char* key : {R"("rolling_shutter": [0, 0, 0, 0.02], )", R"("mask_color": "red", )",
                            R"("enable_ray_loading": true, )", R"("s1": 0.01, )",
                            R"("depth_max": 5, )", R"("alpha_path": "x", )"}) {
        const std::string name = std::string(key).substr(1, std::string(key).find('"', 1) - 1);
        EXPECT_NE(notes_of(key, frame("a")).find(name), std::string::npos) << key;
        EXPECT_NE(notes_of("", frame("a") + "," + frame("b", key)).find(name), std::string::npos);
    }
    for (const auto& [key, meant] : std::vector<std::pair<std::string, std::string>>{
             {"maskPath", "mask_path"},
             {"mask_pth", "mask_path"},
             {"FL_X", "fl_x"},
             {"depth_filepath", "depth_file_path"},
             {"camera-model", "camera_model"},
             {"integer_depth_scales", "integer_depth_scale"}}) {
        const std::string note = notes_of("", frame("a", "\"" + key + "\": \"x\", "));
        EXPECT_NE(note.find(key + " (is " + meant + " meant?)"), std::string::npos) << note;
    }
    for (const char* lens : {R"("ftheta_p0": 1, )", R"("latlong": true, )"})
        EXPECT_NE(parse_error(file(lens, frame("a"))).find("lens that is not read"),
                  std::string::npos);
    EXPECT_NE(notes_of("", frame("a", R"("time": 0.1, )") + "," + frame("b", R"("time": 0.2, )"))
                  .find("2 different times"),
              std::string::npos);
    EXPECT_EQ(notes_of("", frame("a", R"("time": 0.1, )") + "," + frame("b", R"("time": 0.1, )")),
              "");
}

TEST(Transforms, keys_of_other_dialects_are_read) {
    EXPECT_NEAR(lens_of(R"("x_fov": 90, )").parameters[0], 40, 1e-12);
    EXPECT_NEAR(lens_of(R"("fl_x": 50, )", R"("x_fov": 90, )").parameters[1], 40, 1e-12);
    EXPECT_NEAR(lens_of(R"("x_fov": 90, "y_fov": 90, )").parameters[1], 30, 1e-12);
    EXPECT_EQ(lens_of(R"("fl_x": 50, "distortion_params": [1, 2, 0, 0, 5, 6], )").parameters,
              (std::vector<double>{50, 50, 40, 30, 1, 2, 5, 6}));
    EXPECT_EQ(lens_of(R"("fl_x": 50, "k1": 1, "camera_model": "SIMPLE_RADIAL_FISHEYE", )").model,
              "OPENCV_FISHEYE");
    // Mitsuba's camera looks along +z with x to the left: half a turn about y of OpenGL's.
    const std::string turned =
        R"({"file_path": "a", "transform_matrix": [[-1,0,0,1],[0,1,0,2],[0,0,-1,3]]})";
    const auto mitsuba = parse_transforms(file(R"("from_mitsuba": true, )", turned), "t.json");
    const auto opengl = parse_transforms(file("", frame("a")), "t.json");
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(glm::length(mitsuba.frames[0].rotation[c] - opengl.frames[0].rotation[c]), 0,
                    1e-12);
    // The start and the end of an exposure: halfway.
    const std::string exposed =
        R"({"file_path": "a", "transform_matrix_start": [[1,0,0,1],[0,1,0,2],[0,0,1,3]],
            "transform_matrix_end": [[0,-1,0,3],[1,0,0,2],[0,0,1,3]]})";
    const TransformsFile halfway = parse_transforms(file("", exposed), "t.json");
    const glm::dmat3 to_world = glm::transpose(halfway.frames[0].rotation);
    EXPECT_NEAR(glm::length(to_world[0] - glm::dvec3(1, 1, 0) / std::sqrt(2.0)), 0, 1e-12);
    EXPECT_NEAR(glm::length(-(to_world * halfway.frames[0].translation) - glm::dvec3(2, 2, 3)), 0,
                1e-12);
    ASSERT_EQ(halfway.notes.size(), 1u);
    EXPECT_NE(halfway.notes[0].find("1 of them move"), std::string::npos) << halfway.notes[0];
}

// The camera of half a read-out later is where the file's velocities take it, by the file's own
// axes, and for instant-ngp on its way from start to end.
TEST(Transforms, rolling_shutters_are_read_in_both_forms) {
    const std::string rolling = frame(
        "a", R"("camera_linear_velocity": [1, 2, 3], "camera_angular_velocity": [0, 0, 10], )");
    const TransformsFile file_of = parse_transforms(
        file(R"("rolling_shutter_time": 0.02, "exposure_time": 0.001, )", rolling), "t.json");
    const TransformsFrame& f = file_of.frames[0];
    ASSERT_TRUE(f.shutter.active);
    Camera camera;
    camera.rotation = f.rotation;
    camera.translation = f.translation;
    camera.shutter = f.shutter;
    const Camera last = camera_at_row(camera, 0.5);
    // Camera to world of the file: turned by exp(0.1 z) about its own axis z, moved by (1, 2, 3).
    glm::dmat3 axes = glm::transpose(camera.rotation);
    axes[1] = -axes[1], axes[2] = -axes[2];
    const glm::dmat3 turned = axes * exp_rotation({0, 0, 0.1});
    const glm::dvec3 moved = camera.centre() + axes * glm::dvec3(0.01, 0.02, 0.03);
    glm::dmat3 got = glm::transpose(last.rotation);
    got[1] = -got[1], got[2] = -got[2];
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(glm::length(got[c] - turned[c]), 0, 1e-12);
    EXPECT_NEAR(glm::length(last.centre() - moved), 0, 1e-12);
    ASSERT_EQ(file_of.notes.size(), 1u);
    EXPECT_NE(file_of.notes[0].find("1 of 1 frames have a rolling shutter"), std::string::npos);

    const std::string way =
        R"({"file_path": "a", "transform_matrix_start": [[1,0,0,1],[0,1,0,2],[0,0,1,3]],
            "transform_matrix_end": [[0,-1,0,3],[1,0,0,2],[0,0,1,3]]})";
    const TransformsFile ngp =
        parse_transforms(file(R"("rolling_shutter": [0.25, 0, 0.5], )", way), "t.json");
    Camera c;
    c.rotation = ngp.frames[0].rotation;
    c.translation = ngp.frames[0].translation;
    c.shutter = ngp.frames[0].shutter;
    for (const auto& [time, x, degrees] : {std::tuple{-0.5, 1.5, 22.5}, {0.5, 2.5, 67.5}}) {
        const Camera row = camera_at_row(c, time);
        EXPECT_NEAR(glm::length(row.centre() - glm::dvec3(x, 2, 3)), 0, 1e-12) << time;
        const glm::dvec3 right = glm::transpose(row.rotation)[0];
        EXPECT_NEAR(glm::degrees(std::atan2(right.y, right.x)), degrees, 1e-9) << time;
    }
    for (const char* wrong : {R"("rolling_shutter": [0, 0], )", R"("rolling_shutter": [0, 1, 0], )",
                              R"("rolling_shutter": [0, 0, "x"], )"})
        EXPECT_NE(parse_error(file(wrong, way)).find("rolling_shutter"), std::string::npos);
    EXPECT_NE(notes_of(R"("rolling_shutter_time": 0.02, )", frame("a")).find("no frame says how"),
              std::string::npos);
}

TEST(Transforms, two_keys_for_one_fact_are_compared) {
    const auto refused = [](const std::string& error) {
        EXPECT_NE(error.find("but"), std::string::npos) << error;
        EXPECT_NE(error.find("Remove the one that is wrong"), std::string::npos) << error;
    };
    refused(parse_error(
        file(R"("depth_unit_scale_factor": 0.001, "integer_depth_scale": 0.0001, )", frame("a"))));
    refused(parse_error(
        file("", frame("a", R"("depth_path": "x.png", "depth_file_path": "y.png", )"))));
    const std::string focal = R"("fl_x": 50, )";
    refused(
        error_of([&] { lens_of(focal + R"("is_fisheye": true, "camera_model": "OPENCV", )"); }));
    refused(error_of(
        [&] { lens_of(focal + R"("is_fisheye": false, "camera_model": "OPENCV_FISHEYE", )"); }));
    EXPECT_EQ(lens_of(focal + R"("is_fisheye": false, "camera_model": "OPENCV", )").model,
              "PINHOLE");
    const std::string steps = parse_error(file(R"("integer_depth_scale": 1000, )", frame("a")));
    EXPECT_NE(steps.find("0.001"), std::string::npos) << steps;
    const std::string size = R"("w": 80, "h": 60, "fl_x": 40, )";
    EXPECT_EQ(notes_of(size + R"("camera_angle_x": 1.5707963, )", frame("a")), "");
    EXPECT_NE(notes_of(size + R"("camera_angle_x": 0.8, )", frame("a")).find("camera_angle_x"),
              std::string::npos);
}

TEST(Transforms, every_error_comes_with_a_remedy) {
    for (const std::string& text :
         {file(R"("fl_x": "50 px", )", frame("a")), file(R"("camera_model": 5, )", frame("a")),
          file("", frame("a") + ",5"), file("", frame("a") + ",{}"),
          file("", R"({"file_path": "a"})"),
          file("", R"({"file_path": "a", "transform_matrix": [[1],[1],[1]]})")})
        EXPECT_NE(parse_error(text).find("\n  "), std::string::npos) << parse_error(text);
    EXPECT_NE(error_of([&] { lens_of(R"("fl_x": 5, "w": 1e300, )"); }).find("\n  "),
              std::string::npos);
}

TEST(Transforms, bad_files_are_errors_that_name_the_frame) {
    EXPECT_NE(parse_error("{").find("JSON"), std::string::npos);
    EXPECT_NE(parse_error("[]").find("cameras.json"), std::string::npos);
    EXPECT_NE(parse_error("{}").find("frames"), std::string::npos);
    EXPECT_NE(parse_error(file("", frame("a") + ",{}")).find("frame 2 of 2"), std::string::npos);
    EXPECT_NE(parse_error(file("", R"({"file_path": "a"})")).find("transform_matrix"),
              std::string::npos);
    EXPECT_NE(parse_error(file(R"("fl_x": "50 px", )", frame("a"))).find("fl_x"),
              std::string::npos);
    const auto with = [](const std::string& row) {
        return file("", R"({"file_path": "b.png", "transform_matrix": [)" + row +
                            ",[0,1,0,2],[0,0,1,3],[0,0,0,1]]}");
    };
    EXPECT_NE(parse_error(with("[2,0,0,1]")).find("orthonormal"), std::string::npos);
    EXPECT_NE(parse_error(with("[-1,0,0,1]")).find("mirrors"), std::string::npos);
    EXPECT_NE(parse_error(with("[null,0,0,1]")).find("NaN"), std::string::npos);
    EXPECT_NE(parse_error(with("[1,0,0,1e999]")).find("1e999"), std::string::npos);
    EXPECT_NE(parse_error(with("[1,0,0]")).find("4 numbers"), std::string::npos);
    for (const char* head : {R"("fl_x": 0, )", R"("fl_x": -5, )", R"("camera_angle_x": -1, )"})
        EXPECT_NE(error_of([&] { lens_of(head); }).find("focal"), std::string::npos) << head;
    EXPECT_NE(error_of([&] { lens_of(""); }).find("fl_x"), std::string::npos);
    EXPECT_NE(error_of([&] {
                  lens_of(R"("fl_x": 5, "camera_model": "ORTHOPHOTO", )");
              }).find("EQUIRECTANGULAR"),
              std::string::npos);
    EXPECT_NE(error_of([&] { lens_of(R"("fl_x": 5, "w": 1e300, )"); }).find("size"),
              std::string::npos);
}

TEST(Transforms, truncated_anywhere_is_an_error) {
    const std::string text = file(R"("fl_x": 50, )", frame("a.png"));
    for (std::size_t length = 0; length < text.size(); ++length)
        EXPECT_FALSE(parse_error(text.substr(0, length)).empty()) << length;
}

TEST(TransformsSource, nerfstudio_folder_with_masks_points_and_split) {
    const auto folder = test_folder();
    for (const char* name : {"images/a.png", "images/b.png"})
        write_png(folder / name, ImageU8(8, 6, 3));
    for (const char* name : {"images_2/a.png", "images_2/b.png"})
        write_png(folder / name, ImageU8(4, 3, 3));
    ImageU8 mask(8, 6, 1);
    mask.data[0] = 255;
    write_png(folder / "masks/a.png", mask);
    write_file_atomic(
        folder / "sparse_pc.ply",
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
        "property float z\nproperty uint8 red\nproperty uint8 green\n"
        "property uint8 blue\nend_header\n1000000.25 2 3 4 5 6\nnan 0 0 1 1 1\n");
    write_file_atomic(
        folder / "transforms.json",
        file(R"("w": 8, "h": 6, "fl_x": 10, "fl_y": 10, "cx": 4, "cy": 3, "camera_model": "OPENCV",
                "applied_transform": [[0,1,0,0],[1,0,0,0],[0,0,-1,0]],
                "ply_file_path": "sparse_pc.ply", "test_filenames": ["./images/b.png"], )",
             frame("./images/b.png") + "," +
                 frame("images/a.png", R"("mask_path": "masks/a.png", )") + "," +
                 frame("images/missing.png")));
    const Dataset dataset = load_dataset(folder);
    ASSERT_EQ(dataset.views.size(), 2u);
    EXPECT_EQ(dataset.views[0].name, "images/a.png");
    EXPECT_FALSE(dataset.views[0].is_test);
    EXPECT_TRUE(dataset.views[1].is_test);
    EXPECT_TRUE(dataset.has_alpha);
    const ImageU8 photo = load_photo(dataset.views[0]);
    EXPECT_EQ(photo.data[3], 255);
    EXPECT_EQ(photo.data[7], 0);
    // The frames' matrices and the ply share the file's frame: neither is changed.
    EXPECT_EQ(dataset.points.position, (std::vector<double>{1000000.25, 2, 3}));
    EXPECT_NEAR(glm::length(dataset.views[0].camera.centre() - glm::dvec3(1, 2, 3)), 0, 1e-12);
    EXPECT_EQ(dataset.notes.size(), 2u) << "a missing photo, a dropped point";

    DatasetOptions half;
    half.images_folder = "images_2";
    EXPECT_EQ(load_dataset(folder / "transforms.json", half).views[0].camera.fx, 5);
    std::filesystem::remove_all(folder / "images");
    EXPECT_NE(error_of([&] { load_dataset(folder); }).find("none of its 3 photos"),
              std::string::npos);
}

TEST(TransformsSource, frames_that_the_split_leaves_out_are_left_out_with_a_note) {
    const auto folder = test_folder();
    for (const char* name : {"images/a.png", "images/b.png", "images/c.png"})
        write_png(folder / name, ImageU8(8, 6, 3));
    write_file_atomic(
        folder / "transforms.json",
        file(R"("fl_x": 10, "train_filenames": ["images/a.png"],
                              "test_filenames": ["images/b.png", "c.png"], )",
             frame("images/a.png") + "," + frame("images/b.png") + "," + frame("images/c.png")));
    const Dataset dataset = load_dataset(folder);
    ASSERT_EQ(dataset.views.size(), 2u);
    EXPECT_FALSE(dataset.views[0].is_test);
    EXPECT_TRUE(dataset.views[1].is_test);
    ASSERT_EQ(dataset.notes.size(), 2u);
    EXPECT_NE(dataset.notes[0].find("1 frame that"), std::string::npos) << dataset.notes[0];
    EXPECT_NE(dataset.notes[1].find("1 name that"), std::string::npos) << dataset.notes[1];
}

TEST(TransformsSource, pixels_beyond_a_fisheyes_circle_are_left_out) {
    const auto folder = test_folder();
    write_png(folder / "images/a.png", ImageU8(16, 12, 3));
    write_file_atomic(folder / "transforms.json",
                      file(R"("w": 32, "h": 24, "fl_x": 10, "fisheye_crop_radius": 10, )",
                           frame("images/a.png")));
    const Dataset dataset = load_dataset(folder);
    EXPECT_TRUE(dataset.alpha_is_mask);
    const ImageU8 photo = load_photo(dataset.views[0]);
    int opaque = 0;
    for (std::size_t i = 3; i < photo.data.size(); i += 4) opaque += photo.data[i] == 255 ? 1 : 0;
    EXPECT_NEAR(opaque, 3.14159 * 5 * 5, 6) << "half the size, half the radius";
    EXPECT_NE(dataset.notes.at(0).find("fisheye_crop_radius"), std::string::npos);
}

TEST(TransformsSource, names_of_the_split_are_compared_without_dots_and_backslashes) {
    const auto folder = test_folder();
    for (const char* name : {"images/a.png", "images/b.png", "images/c.png"})
        write_png(folder / name, ImageU8(8, 6, 3));
    write_file_atomic(folder / "transforms.json",
                      file(R"("fl_x": 10, "test_filenames": ["images/a.png", "./images/b.png"], )",
                           frame("./images/a.png") + "," + frame("images/b.png") + "," +
                               frame(R"(images\\c.png)")));
    const Dataset dataset = load_dataset(folder);
    ASSERT_EQ(dataset.views.size(), 3u);
    EXPECT_TRUE(dataset.views[0].is_test);
    EXPECT_TRUE(dataset.views[1].is_test);
    EXPECT_FALSE(dataset.views[2].is_test);
    EXPECT_EQ(dataset.views[2].name, "images/c.png");
}

TEST(TransformsSource, a_folder_of_photos_without_effect_is_a_note) {
    const auto folder = test_folder();
    write_png(folder / "train/r_0.png", ImageU8(8, 8, 3));
    write_file_atomic(folder / "TRANSFORMS.JSON", file(R"("fl_x": 10, )", frame("train/r_0")));
    DatasetOptions options;
    const auto notes = [&] {
        std::string all;
        for (const std::string& note : load_dataset(folder / "TRANSFORMS.JSON", options).notes)
            all += note;
        return all;
    };
    EXPECT_EQ(notes().find("no effect"), std::string::npos);
    options.images_folder = "images_4";
    EXPECT_NE(notes().find("images_4 has no effect"), std::string::npos);
}

TEST(TransformsSource, smaller_photos_may_have_another_extension) {
    const auto folder = test_folder();
    write_png(folder / "images_2/a.png", ImageU8(4, 3, 3));
    write_file_atomic(folder / "transforms.json",
                      file(R"("w": 8, "h": 6, "fl_x": 10, )", frame("images/a.JPG")));
    DatasetOptions options;
    options.images_folder = "images_2/";
    EXPECT_EQ(load_dataset(folder, options).views.at(0).photo, folder / "images_2/a.png");
}

TEST(TransformsSource, it_stands_in_for_a_colmap_model_whose_photos_are_missing) {
    const auto folder = test_folder();
    write_png(folder / "images/a.png", ImageU8(8, 6, 3));
    write_file_atomic(folder / "transforms.json", file(R"("fl_x": 10, )", frame("images/a.png")));
    View view;
    view.camera = {.width = 8, .height = 6, .fx = 20, .fy = 20, .cx = 4, .cy = 3};
    DatasetOptions cameras_only;
    cameras_only.require_photos = false;
    for (const bool same_name : {false, true}) {
        view.name = same_name ? "a.png" : "IMG_1.png";
        write_colmap_binary(folder / "colmap/sparse/0", {view}, {});
        const Dataset dataset = load_dataset(folder);
        EXPECT_EQ(dataset.views.at(0).camera.fx, same_name ? 20 : 10);
        EXPECT_EQ(load_dataset(folder, cameras_only).views.at(0).camera.fx, same_name ? 20 : 10);
        EXPECT_NE(dataset.notes.back().find("was read"), std::string::npos);
    }
    std::filesystem::remove(folder / "images/a.png");
    EXPECT_EQ(load_dataset(folder, cameras_only).views.at(0).camera.fx, 20);
}

// What makes a transforms file say more than the COLMAP model beside it.
TEST(TransformsSource, it_outranks_a_colmap_model_that_lacks_its_masks_split_or_choice) {
    const auto folder = test_folder();
    std::vector<View> views(3);
    for (std::size_t i = 0; i < 3; ++i) {
        views[i].name = std::to_string(i) + ".png";
        views[i].camera = {.width = 8, .height = 6, .fx = 20, .fy = 20, .cx = 4, .cy = 3};
        write_png(folder / "images" / views[i].name, ImageU8(8, 6, 3));
    }
    write_png(folder / "all.png", ImageU8(8, 6, 1));
    write_colmap_binary(folder / "colmap/sparse/0", views, {});
    const std::string head = R"("fl_x": 10, )", split = R"("test_filenames": ["images/1.png"], )";
    const std::string two = frame("./images/0.png") + "," + frame("images/1.png");
    const std::string three = two + "," + frame("images/2.png");
    const std::string masked = two + "," + frame("images/2.png", R"("mask_path": "all.png", )");
    struct Case {
        std::string text, reason;
    };
    for (const Case& c : {Case{file(head, three), ""}, Case{file(head, masked), "masks"},
                          Case{file(head + split, three), "split"},
                          Case{file(head, two), "1 of the model's 3 photos"}}) {
        write_file_atomic(folder / "transforms.json", c.text);
        const Dataset dataset = load_dataset(folder);
        EXPECT_EQ(dataset.views.at(0).camera.fx, c.reason.empty() ? 20 : 10) << c.reason;
        std::string notes;
        for (const std::string& note : dataset.notes) notes += note + "\n";
        EXPECT_NE(notes.find(c.reason.empty() ? "sparse/0 was read" : "transforms.json was read"),
                  std::string::npos)
            << notes;
        EXPECT_NE(notes.find(c.reason), std::string::npos) << notes;
    }
}

TEST(TransformsSource, points_lie_under_the_names_that_other_programs_give_them) {
    for (const char* name : {"points3d.ply", "points3D.ply", "sparse_pc.ply", "pointcloud.ply"}) {
        const auto folder = test_folder();
        write_png(folder / "train/0.png", ImageU8(8, 8, 3));
        write_file_atomic(folder / "transforms_train.json",
                          file(R"("fl_x": 10, )", frame("train/0")));
        write_file_atomic(folder / name,
                          std::string("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
                                      "property float y\nproperty float z\nend_header\n1 2 3\n"));
        const Dataset dataset = load_dataset(folder);
        EXPECT_EQ(dataset.points.size(), 1u) << name;
        ASSERT_EQ(dataset.notes.size(), 2u);  // and that the points have no colours
        EXPECT_NE((dataset.notes[0] + dataset.notes[1]).find(name), std::string::npos);
    }
}

TEST(TransformsSource, smaller_photos_get_the_lens_of_those_that_the_file_names) {
    const auto folder = test_folder();
    const auto write = [&](const std::string& head) {
        write_file_atomic(folder / "transforms.json", file(head, frame("images/a.png")));
    };
    write_png(folder / "images/a.png", ImageU8(8, 6, 3));
    write_png(folder / "images_2/a.png", ImageU8(4, 3, 3));
    write(R"("fl_x": 10, "cx": 4, "cy": 3, )");
    DatasetOptions half;
    half.images_folder = "images_2";
    const Camera camera = load_dataset(folder, half).views.at(0).camera;
    EXPECT_EQ(camera.width, 4);
    EXPECT_EQ(camera.fx, 5);
    EXPECT_EQ(camera.cx, 2);
    std::filesystem::remove_all(folder / "images");
    const std::string error = error_of([&] { load_dataset(folder, half); });
    EXPECT_NE(error.find("images/a.png"), std::string::npos) << error;
    EXPECT_NE(error.find("Add w and h"), std::string::npos) << error;
    EXPECT_NE(error_of([&] { load_dataset(folder); }).find("--images images_2"), std::string::npos);
    write(R"("camera_angle_x": 1.5707963267948966, )");
    EXPECT_NEAR(load_dataset(folder, half).views.at(0).camera.fx, 2, 1e-12);
}

TEST(TransformsSource, cameras_alone_do_without_photos_that_cannot_be_used) {
    const auto folder = test_folder();
    write_file_atomic(folder / "a.webp", std::string("RIFF"));
    write_png(folder / "b.png", ImageU8(8, 8, 3));  // has another aspect ratio
    write_file_atomic(folder / "transforms.json", file(R"("w": 8, "h": 6, "fl_x": 10, )",
                                                       frame("a.webp") + "," + frame("b.png")));
    std::vector<std::string> notes;
    for (const View& view : load_cameras(folder, {}, &notes)) {
        EXPECT_EQ(view.camera.width, 8) << view.name;
        EXPECT_EQ(view.camera.height, 6) << view.name;
    }
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("2 cameras"), std::string::npos) << notes[0];
    EXPECT_NE(notes[0].find("a.webp is no PNG"), std::string::npos) << notes[0];
    EXPECT_NE(error_of([&] { load_dataset(folder); }).find("a.webp"), std::string::npos);
}

TEST(TransformsSource, synthetic_folder_has_train_and_test_and_no_extensions) {
    const auto folder = test_folder();
    write_png(folder / "train/r_0.png", ImageU8(8, 8, 4));
    write_png(folder / "test/r_0.png", ImageU8(8, 8, 4));
    const std::string head = R"("camera_angle_x": 1.5707963267948966, )";
    write_file_atomic(folder / "transforms_train.json", file(head, frame("./train/r_0")));
    write_file_atomic(folder / "transforms_test.json", file(head, frame("./test/r_0")));
    const Dataset dataset = load_dataset(folder);
    ASSERT_EQ(dataset.views.size(), 2u);
    EXPECT_EQ(dataset.views[0].name, "test/r_0");
    EXPECT_TRUE(dataset.views[0].is_test);
    EXPECT_FALSE(dataset.views[1].is_test);
    EXPECT_NEAR(dataset.views[1].camera.fx, 4, 1e-12);
    EXPECT_TRUE(dataset.has_alpha);
}

TEST(TransformsSource, a_file_of_test_views_is_all_test) {
    const auto folder = test_folder();
    write_png(folder / "test/r_0.png", ImageU8(8, 8, 4));
    const std::string head = R"("camera_angle_x": 1.5707963267948966, )";
    write_file_atomic(folder / "transforms_test.json", file(head, frame("./test/r_0")));
    for (const auto& named : {folder, folder / "transforms_test.json"}) {
        const Dataset dataset = load_dataset(named);
        ASSERT_EQ(dataset.views.size(), 1u) << named;
        EXPECT_TRUE(dataset.views[0].is_test) << named;
    }
}

}  // namespace
}  // namespace darb
