// SPDX-License-Identifier: MIT
#include "engine/data/lens_model.h"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>

#include "engine/core/files.h"
#include "engine/data/image_io.h"
#include "tests/unit/data/data_files.h"

namespace darb {
namespace {

LensModel make(std::string model, std::vector<double> parameters) {
    return {std::move(model), std::move(parameters), 640, 480};
}

/// One lens of each model, as strong as those of consumer and action cameras.
std::vector<LensModel> all_models() {
    return {
        make("SIMPLE_PINHOLE", {500, 321, 239}),
        make("PINHOLE", {500, 510, 321, 239}),
        make("SIMPLE_RADIAL", {500, 321, 239, -0.1}),
        make("RADIAL", {500, 321, 239, -0.1, 0.02}),
        make("OPENCV", {500, 510, 321, 239, -0.25, 0.28, 0.0015, -0.0037}),
        make("OPENCV_FISHEYE", {300, 305, 321, 239, 0.02, -0.01, 0.003, -0.0005}),
        make("FULL_OPENCV", {500, 510, 321, 239, 0.1, 0.05, 0.001, -0.002, 0.01, 0.2, 0.01, 0.002}),
        make("FOV", {350, 355, 321, 239, 0.9}),
        make("SIMPLE_RADIAL_FISHEYE", {300, 321, 239, -0.02}),
        make("RADIAL_FISHEYE", {300, 321, 239, -0.02, 0.003}),
        make("THIN_PRISM_FISHEYE",
             {300, 305, 321, 239, 0.01, -0.002, 0.001, -0.001, 0.0005, 0.0001, 0.002, -0.002}),
        make("RAD_TAN_THIN_PRISM_FISHEYE",
             {300, 305, 321, 239, 0.03, -0.02, 0.01, -0.005, 0.002, -0.0003, 0.0008, -0.0006,
              -0.0005, 0.0002, 0.001, -0.0003}),
        make("SIMPLE_DIVISION", {500, 321, 239, -0.2}),
        make("DIVISION", {500, 510, 321, 239, 0.15}),
        make("SIMPLE_FISHEYE", {300, 321, 239}),
        make("FISHEYE", {300, 305, 321, 239}),
        make("EUCM", {300, 305, 321, 239, 0.62, 1.1})};
}

// Cameras around a scene have taken no photo, and plans ask every view.
TEST(Lens, of_no_photo_is_straight) {
    EXPECT_FALSE(LensModel().distorted());
    EXPECT_FALSE(too_wide_to_undistort(LensModel()));
}

TEST(Lens, four_radial_terms_stand_in_the_numerator) {
    const LensModel model =
        make(std::string(kFourRadial), {500, 510, 321, 239, 0.1, 0.05, 0, 0, 0.02, 0.01});
    EXPECT_NO_THROW(check_lens(model, "test"));
    EXPECT_TRUE(model.distorted());
    const glm::dvec2 at = Lens(model).project({0.5, 0}), back = *Lens(model).unproject(at);
    const double r2 = 0.25;
    const double factor = 1 + r2 * (0.1 + r2 * (0.05 + r2 * (0.02 + r2 * 0.01)));
    EXPECT_NEAR(at.x, 500 * 0.5 * factor + 321, 1e-9);
    EXPECT_NEAR(back.x, 0.5, 1e-9);
}

TEST(Lens, every_model_of_colmap_is_known_by_id_and_name) {
    const std::vector<LensModel> models = all_models();
    for (int id = 0, next = 0; id < 18; ++id) {
        const std::string name(lens_model_name(id));
        if (id == 17) {  // a photo of all directions, which no Lens describes
            EXPECT_EQ(name, kPanorama);
            EXPECT_NO_THROW(check_lens({name, {640, 320}, 640, 320}, "test"));
            EXPECT_THROW(Lens({name, {640, 320}, 640, 320}), Error);
            continue;
        }
        const LensModel& lens = models.at(static_cast<std::size_t>(next++));
        EXPECT_EQ(name, lens.model);
        EXPECT_NO_THROW(check_lens(lens, "test")) << lens.model;
        EXPECT_EQ(lens.distorted(), id >= 2) << lens.model;
    }
    EXPECT_TRUE(lens_model_name(-1).empty());
    EXPECT_TRUE(lens_model_name(18).empty());
}

TEST(Lens, equidistant_lenses_are_fisheyes_without_terms) {
    const glm::dvec2 ray(0.3, 0.4);
    const glm::dvec2 expected =
        Lens(make("OPENCV_FISHEYE", {300, 305, 321, 239, 0, 0, 0, 0})).project(ray);
    const glm::dvec2 two = Lens(make("FISHEYE", {300, 305, 321, 239})).project(ray);
    const glm::dvec2 one = Lens(make("SIMPLE_FISHEYE", {300, 321, 239})).project(ray);
    EXPECT_EQ(two, expected);
    EXPECT_EQ(one.x, expected.x);
    EXPECT_NEAR(one.y, 239 + 300 * std::atan(0.5) * 0.8, 1e-9);
}

TEST(Lens, unproject_inverts_project_for_every_model) {
    for (const LensModel& model : all_models()) {
        const Lens lens(model);
        for (double y = 0.5; y < 480; y += 23.5)
            for (double x = 0.5; x < 640; x += 31.5) {
                const auto ray = lens.unproject({x, y});
                ASSERT_TRUE(ray) << model.model << " at " << x << ", " << y;
                EXPECT_TRUE(lens.valid(*ray));
                const glm::dvec2 again = lens.project(*ray);
                EXPECT_NEAR(again.x, x, 1e-6) << model.model;
                EXPECT_NEAR(again.y, y, 1e-6) << model.model;
            }
    }
}

TEST(Lens, known_values_by_hand) {
    const glm::dvec2 ray(0.3, 0.4);  // r = 0.5
    const auto expect = [&](const LensModel& model, double x, double y) {
        const glm::dvec2 pixel = Lens(model).project(ray);
        EXPECT_NEAR(pixel.x, x, 1e-9) << model.model;
        EXPECT_NEAR(pixel.y, y, 1e-9) << model.model;
    };
    expect(make("SIMPLE_RADIAL", {100, 0, 0, 0.4}), 33, 44);  // 1 + 0.4 * 0.25
    expect(make("RADIAL", {100, 0, 0, 0.4, 1.6}), 36, 48);
    // Tangential: 2 p1 xy + p2 (r^2 + 2 x^2) and 2 p2 xy + p1 (r^2 + 2 y^2).
    expect(make("OPENCV", {100, 100, 0, 0, 0, 0, 0.1, 0}), 32.4, 45.7);
    expect(make("OPENCV", {100, 100, 0, 0, 0, 0, 0, 0.1}), 34.3, 42.4);
    expect(make("FULL_OPENCV", {100, 100, 0, 0, 0, 0, 0, 0, 0, 4, 0, 0}), 15, 20);  // / (1 + 4 r^2)
    // The undistorted point is the distorted one over 1 + k r^2: 40 / (1 + 0.75 * 4 / 9) = 30.
    expect(make("SIMPLE_DIVISION", {100, 0, 0, 0.75}), 40, 160.0 / 3);
    expect(make("DIVISION", {100, 50, 0, 0, 0.75}), 40, 80.0 / 3);
    expect(make("EUCM", {100, 100, 0, 0, 0.5, 5}), 24, 32);  // 1 / (0.5 * 1.5 + 0.5)
    const double theta = std::atan(0.5);
    expect(make("OPENCV_FISHEYE", {100, 100, 0, 0, 0, 0, 0, 0}), 60 * theta, 80 * theta);
    const double bent = theta * (1 + 0.1 * theta * theta);
    expect(make("SIMPLE_RADIAL_FISHEYE", {100, 0, 0, 0.1}), 60 * bent, 80 * bent);
    const double fov = std::atan(2 * 0.5 * std::tan(0.45)) / 0.9;
    expect(make("FOV", {100, 100, 0, 0, 0.9}), 60 * fov, 80 * fov);
    expect(make("THIN_PRISM_FISHEYE", {100, 100, 0, 0, 0, 0, 0, 0, 0, 0, 0.2, 0}),
           60 * theta + 20 * theta * theta, 80 * theta);
    // After the radial factor: p0 with x, p1 with y, and prisms of the second and fourth power.
    const double r = theta * (1 + 0.5 * std::pow(theta, 12)), x = 0.6 * r, y = 0.8 * r;
    expect(
        make("RAD_TAN_THIN_PRISM_FISHEYE",
             {100, 100, 0, 0, 0, 0, 0, 0, 0, 0.5, 0.1, 0.2, 0.3, 0.4, 0.6, 0.7}),
        100 * (x + 0.1 * (r * r + 2 * x * x) + 0.4 * x * y + 0.3 * r * r + 0.4 * std::pow(r, 4)),
        100 * (y + 0.2 * (r * r + 2 * y * y) + 0.2 * x * y + 0.6 * r * r + 0.7 * std::pow(r, 4)));
}

TEST(Lens, rays_beyond_the_fold_are_not_valid) {
    // r (1 - 0.3 r^2) turns back at r = 1.054, where it is 0.703.
    const Lens lens(make("SIMPLE_RADIAL", {100, 0, 0, -0.3}));
    EXPECT_TRUE(lens.valid({1.0, 0}));
    EXPECT_FALSE(lens.valid({1.1, 0}));
    EXPECT_TRUE(lens.unproject({69, 0}));
    EXPECT_FALSE(lens.unproject({71, 0}));
}

TEST(Lens, fisheye_beyond_ninety_degrees_has_no_ray) {
    const Lens lens(make("OPENCV_FISHEYE", {100, 100, 0, 0, 0, 0, 0, 0}));
    EXPECT_TRUE(lens.unproject({156, 0}));
    EXPECT_FALSE(lens.unproject({158, 0}));
}

TEST(Lens, bad_parameters_are_errors) {
    const auto error = [](const LensModel& lens) {
        return error_of([&] { check_lens(lens, "camera 1"); });
    };
    EXPECT_NE(error(make("SPHERE", {1})).find("SPHERE"), std::string::npos);
    EXPECT_NE(error(make("PINHOLE", {1, 2, 3})).find("4 parameters"), std::string::npos);
    EXPECT_NE(error(make("PINHOLE", {500, 0, 1, 1})).find("focal"), std::string::npos);
    EXPECT_NE(error(make("PINHOLE", {500, 1e300 * 1e300, 1, 1})).find("fy, is not finite"),
              std::string::npos);
    EXPECT_NE(error(make("SIMPLE_RADIAL", {500, 1, 1, 1e300 * 1e300})).find("distortion"),
              std::string::npos);
    for (const LensModel& bad : {make("PINHOLE", {1, 2, 3}), make("PINHOLE", {1, 1, NAN, 1}),
                                 LensModel{"PINHOLE", {1, 1, 1, 1}, 0, 8}})
        EXPECT_NE(error(bad).find("\n  "), std::string::npos) << "no remedy";
}

TEST(Undistort, frame_of_ordinary_lenses_has_no_gaps_and_keeps_the_focal_length) {
    for (const LensModel& model : all_models()) {
        const UndistortedFrame frame = undistorted_frame(model, "test");
        EXPECT_FALSE(frame.has_gaps) << model.model;
        EXPECT_EQ(frame.camera.fx, model.parameters[0]) << model.model;
        EXPECT_GT(frame.camera.width, 300) << model.model;
        EXPECT_LT(frame.camera.width, 1290) << model.model;
        ImageU8 white(640, 480, 4);
        std::fill(white.data.begin(), white.data.end(), std::uint8_t{255});
        for (const std::uint8_t value : undistort(white, model, frame.camera).data)
            ASSERT_EQ(value, 255) << model.model;
    }
}

TEST(Undistort, photo_of_a_pattern_becomes_the_pinhole_view_of_it) {
    const auto pattern = [](glm::dvec2 ray) {
        return 127 + 100 * std::sin(9 * ray.x) * std::cos(7 * ray.y);
    };
    for (const LensModel& model : all_models()) {
        const Lens lens(model);
        ImageU8 photo(640, 480, 4);
        for (int y = 0; y < 480; ++y)
            for (int x = 0; x < 640; ++x) {
                const auto ray = lens.unproject({x + 0.5, y + 0.5});
                const auto value = static_cast<std::uint8_t>(pattern(ray.value()) + 0.5);
                for (int c = 0; c < 3; ++c) photo.at(x, y, c) = value;
                photo.at(x, y, 3) = 255;
            }
        const Camera camera = undistorted_frame(model, "test").camera;
        const ImageU8 flat = undistort(photo, model, camera);
        double worst = 0;
        for (int y = 0; y < camera.height; ++y)
            for (int x = 0; x < camera.width; ++x) {
                const glm::dvec2 ray((x + 0.5 - camera.cx) / camera.fx,
                                     (y + 0.5 - camera.cy) / camera.fy);
                worst = std::max(worst, std::abs(pattern(ray) - flat.at(x, y, 1)));
            }
        EXPECT_LT(worst, 2.0) << model.model;
    }
}

TEST(Undistort, strong_fisheye_is_capped_at_sixty_degrees) {
    const LensModel model{"OPENCV_FISHEYE", {150, 150, 320, 240, 0, 0, 0, 0}, 640, 480};
    const UndistortedFrame frame = undistorted_frame(model, "test");
    EXPECT_NEAR(frame.camera.width, 2 * std::sqrt(3.0) * 150, 2);
    EXPECT_NEAR(frame.camera.height, 2 * std::sqrt(3.0) * 150, 2);
    EXPECT_FALSE(frame.has_gaps);
}

TEST(Undistort, only_a_fisheye_that_sees_more_than_sixty_degrees_to_a_side_is_too_wide) {
    const auto fisheye = [](double focal) {
        return LensModel{"OPENCV_FISHEYE", {focal, focal, 320, 240, 0, 0, 0, 0}, 640, 480};
    };
    const double limit = 319.5 / 1.0471975511965976;   // the border's pixel centre at 60 degrees
    EXPECT_TRUE(too_wide_to_undistort(fisheye(150)));  // 122 degrees: no ray at all
    EXPECT_TRUE(too_wide_to_undistort(fisheye(limit * 0.99)));
    EXPECT_FALSE(too_wide_to_undistort(fisheye(limit * 1.01)));
    EXPECT_FALSE(too_wide_to_undistort(make("FOV", {350, 355, 321, 239, 0.9})));
    EXPECT_TRUE(too_wide_to_undistort(make("FOV", {250, 250, 320, 240, 1.2})));
    for (const char* model : {"PINHOLE", "OPENCV"}) {  // wide, but flat already or nearly so
        std::vector<double> parameters = {100, 100, 320, 240};
        if (std::string(model) == "OPENCV") parameters.insert(parameters.end(), {0.01, 0, 0, 0});
        EXPECT_FALSE(too_wide_to_undistort(make(model, parameters))) << model;
    }
}

TEST(Undistort, a_fisheye_too_wide_keeps_its_lens_where_that_is_asked_for) {
    const auto load = [](double focal, DatasetOptions options) {
        const auto folder = test_folder();
        write_file_atomic(
            folder / "transforms.json",
            fmt::format(R"({{"is_fisheye": true, "w": 640, "h": 480, "fl_x": {}, "k1": 0,
                "frames": [{{"file_path": "a.png", "transform_matrix":
                [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}}]}})",
                        focal));
        options.require_photos = false;
        return load_dataset(folder, options);
    };
    const Dataset wide = load(150, {.original_where_wide = true});
    EXPECT_TRUE(wide.views[0].camera.lens.active);
    EXPECT_EQ(wide.views[0].camera.width, 640);
    ASSERT_FALSE(wide.notes.empty());
    EXPECT_NE(wide.notes.back().find("fisheye"), std::string::npos) << wide.notes.back();
    EXPECT_FALSE(load(150, {}).views[0].camera.lens.active);
    EXPECT_FALSE(load(400, {.original_where_wide = true}).views[0].camera.lens.active);
    EXPECT_TRUE(load(400, {.original_lens = true}).views[0].camera.lens.active);
}

TEST(ScaledViews, are_of_the_straightened_photo_or_of_the_original) {
    View view;
    view.name = "a.png";
    view.lens = {"OPENCV", {400, 400, 320, 240, -0.1, 0, 0, 0}, 640, 480};
    const Camera flat = undistorted_frame(view.lens, "test").camera;
    ASSERT_NE(flat.width, 640);
    const auto quarter = [](Camera full) {
        full.fx /= 4, full.fy /= 4, full.cx /= 4, full.cy /= 4;
        full.width = (full.width + 2) / 4, full.height = (full.height + 2) / 4;
        return full;
    };
    view.camera = quarter(flat);
    const Camera whole = scaled_views({view}, 4)[0].camera;
    EXPECT_EQ(whole.width, flat.width);
    EXPECT_EQ(whole.height, flat.height);
    EXPECT_NEAR(whole.fx, flat.fx, 1 + flat.fx / flat.width);
    EXPECT_THROW(scaled_views({view}, 4.2), Error);
    view.camera = quarter(pinhole_camera(view.lens));
    view.camera.lens.active = true;
    EXPECT_EQ(scaled_views({view}, 4)[0].camera.width, 640);
    EXPECT_TRUE(scaled_views({view}, 4)[0].camera.lens.active);
}

TEST(Undistort, pixels_beyond_the_fold_are_transparent) {
    const LensModel model = make("SIMPLE_RADIAL", {100, 320, 240, -0.3});
    const UndistortedFrame frame = undistorted_frame(model, "test");
    EXPECT_TRUE(frame.has_gaps);
    ImageU8 white(640, 480, 4);
    std::fill(white.data.begin(), white.data.end(), std::uint8_t{255});
    const ImageU8 flat = undistort(white, model, frame.camera);
    EXPECT_EQ(flat.at(0, 0, 3), 0);
    EXPECT_EQ(flat.at(flat.width / 2, flat.height / 2, 3), 255);
}

}  // namespace
}  // namespace darb
