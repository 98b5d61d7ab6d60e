// SPDX-License-Identifier: MIT
#include "viewer/camera_path.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>

#include "engine/core/error.h"
#include "engine/core/files.h"

namespace darb {
namespace {

CameraPath curved() {
    CameraPath path;
    Navigation n;
    for (int i = 0; i < 5; ++i) {
        n.look(0.6, i % 2 == 0 ? 0.2 : -0.3);
        n.fly({0.3 * i, -0.1, 1.0});
        n.fov_y = 0.8 + 0.05 * i;
        path.add(n, 1.0 + 0.5 * i);
    }
    return path;
}

double turned(const KeyFrame& a, const KeyFrame& b) {
    return std::abs(glm::dot(a.orientation, b.orientation));
}

TEST(CameraPath, Sample_at_a_key_is_the_key) {
    const CameraPath path = curved();
    for (const KeyFrame& key : path.keys) {
        const KeyFrame got = path.sample(key.seconds);
        EXPECT_NEAR(glm::distance(got.eye, key.eye), 0, 1e-12);
        EXPECT_NEAR(turned(got, key), 1, 1e-12);
        EXPECT_NEAR(got.fov_y, key.fov_y, 1e-12);
    }
}

TEST(CameraPath, Sample_outside_stays_at_the_ends) {
    const CameraPath path = curved();
    EXPECT_EQ(path.sample(-1).eye, path.keys.front().eye);
    EXPECT_EQ(path.sample(99).eye, path.keys.back().eye);
}

// Velocity just before and just after a key: a kink would differ by the size of the velocity.
TEST(CameraPath, Sample_has_no_kink_at_the_keys) {
    const CameraPath path = curved();
    constexpr double h = 1e-5;
    for (size_t k = 1; k + 1 < path.keys.size(); ++k) {
        const double t = path.keys[k].seconds;
        const glm::dvec3 before = (path.sample(t).eye - path.sample(t - h).eye) / h;
        const glm::dvec3 after = (path.sample(t + h).eye - path.sample(t).eye) / h;
        EXPECT_NEAR(glm::distance(before, after), 0, 1e-3 * (1 + glm::length(before))) << k;
        const glm::dquat a = path.sample(t - h).orientation, b = path.sample(t).orientation,
                         c = path.sample(t + h).orientation;
        const double first = 2 * std::acos(std::min(1.0, std::abs(glm::dot(a, b)))) / h;
        const double second = 2 * std::acos(std::min(1.0, std::abs(glm::dot(b, c)))) / h;
        EXPECT_NEAR(first, second, 0.02 * (1 + first)) << k;
    }
}

TEST(CameraPath, Sample_takes_the_short_way_for_either_sign_of_a_quaternion) {
    CameraPath path = curved();
    const KeyFrame middle = path.sample(1.3);
    path.keys[1].orientation = -path.keys[1].orientation;
    path.keys[2].orientation = -path.keys[2].orientation;
    EXPECT_NEAR(turned(path.sample(1.3), middle), 1, 1e-12);
}

TEST(CameraPath, Straight_even_keys_give_even_speed) {
    CameraPath path;
    Navigation n;
    for (int i = 0; i < 4; ++i, n.eye.x += 1) path.add(n, 2);
    for (double t = 0; t <= 6; t += 0.25) EXPECT_NEAR(path.sample(t).eye.x, t / 2, 1e-12);
}

// A cubic through these angles themselves falls below zero between the two small ones.
TEST(CameraPath, Field_of_view_stays_one_between_keys) {
    CameraPath path;
    Navigation n;
    for (const double fov : {2.5, 0.02, 0.02, 2.5, 3.1, 3.1, 0.5}) {
        n.fov_y = fov;
        path.add(n, 2);
    }
    for (double t = 0; t <= path.duration(); t += 0.05) {
        EXPECT_GT(path.sample(t).fov_y, 0) << t;
        EXPECT_LT(path.sample(t).fov_y, glm::pi<double>()) << t;
    }
}

TEST(CameraPath, Sample_at_no_time_is_the_first_key) {
    const CameraPath path = curved();
    EXPECT_EQ(path.sample(std::nan("")).eye, path.keys.front().eye);
}

class CameraPathFile : public ::testing::Test {
  protected:
    std::filesystem::path file_ = std::filesystem::temp_directory_path() /
                                  ("camera_path_" + std::to_string(::getpid()) + ".json");
    void TearDown() override { std::filesystem::remove(file_); }
};

TEST_F(CameraPathFile, Round_trip_is_exact) {
    const CameraPath path = curved();
    write_camera_path(file_, path);
    const CameraPath got = read_camera_path(file_);
    ASSERT_EQ(got.keys.size(), path.keys.size());
    for (size_t k = 0; k < path.keys.size(); ++k) {
        EXPECT_EQ(got.keys[k].eye, path.keys[k].eye);
        EXPECT_EQ(got.keys[k].seconds, path.keys[k].seconds);
        EXPECT_NEAR(got.keys[k].fov_y, path.keys[k].fov_y, 1e-12);
        EXPECT_NEAR(turned(got.keys[k], path.keys[k]), 1, 1e-12);
    }
}

TEST_F(CameraPathFile, A_path_of_nerfstudio_has_a_key_a_frame) {
    write_file_atomic(file_, std::string(R"({"camera_type": "perspective", "render_height": 120,
        "render_width": 160, "fps": 24, "camera_path": [
        {"camera_to_world": [1,0,0,5, 0,1,0,6, 0,0,1,7, 0,0,0,1], "fov": 90},
        {"camera_to_world": [1,0,0,6, 0,1,0,6, 0,0,1,7, 0,0,0,1], "fov": 60}]})"));
    const CameraPath path = read_camera_path(file_);
    ASSERT_EQ(path.keys.size(), 2u);
    EXPECT_EQ(path.width, 160);
    EXPECT_EQ(path.height, 120);
    EXPECT_EQ(path.fps, 24);
    EXPECT_NEAR(path.keys[1].seconds, 1 / 24.0, 1e-12);
    EXPECT_NEAR(path.keys[0].fov_y, glm::radians(90.0), 1e-12);
    EXPECT_NEAR(glm::length(path.keys[1].eye - glm::dvec3(6, 6, 7)), 0, 1e-12);
    // Forward is the third axis.
    const glm::dvec3 forward = glm::mat3_cast(path.keys[0].orientation)[2];
    EXPECT_NEAR(glm::length(forward - glm::dvec3(0, 0, -1)), 0, 1e-12);
}

TEST_F(CameraPathFile, Broken_files_are_errors_that_name_the_file) {
    const std::string key =
        R"({"seconds":0,"eye":[0,0,0],"orientation":[1,0,0,0],"fov_y_degrees":50})";
    for (const std::string& text :
         {std::string("{"), std::string("[]"), std::string(R"({"key_frames":[]})"),
          R"({"key_frames":[)" + key + "," + key + "]}",  // no time passes
          std::string(R"({"key_frames":[{"seconds":1700000000,"eye":[0,0,0],)"
                      R"("orientation":[1,0,0,0],"fov_y_degrees":50}]})"),
          std::string(R"({"key_frames":[{"seconds":-1,"eye":[0,0,0],)"
                      R"("orientation":[1,0,0,0],"fov_y_degrees":50}]})"),
          std::string(R"({"key_frames":[{"seconds":0,"eye":[0,0],"orientation":[1,0,0,0],)"
                      R"("fov_y_degrees":50}]})"),
          std::string(R"({"key_frames":[{"seconds":0,"eye":[0,0,0],"orientation":[0,0,0,0],)"
                      R"("fov_y_degrees":50}]})"),
          std::string(R"({"key_frames":[{"seconds":0,"eye":[0,0,0],"orientation":[1,0,0,0],)"
                      R"("fov_y_degrees":180}]})")}) {
        write_file_atomic(file_, text);
        try {
            read_camera_path(file_);
            FAIL() << "taken: " << text;
        } catch (const Error& e) {
            EXPECT_NE(std::string(e.what()).find(file_.string()), std::string::npos) << e.what();
            EXPECT_EQ(std::string(e.what()).find("json.exception"), std::string::npos) << e.what();
        }
    }
}

// A bar of splats along x: it is seen whole from every side, from above, and the turn closes.
TEST(Turntable, The_whole_scene_is_seen_from_every_side) {
    SplatModel m;
    m.resize(500);
    for (size_t i = 0; i < m.size(); ++i) {
        m.position[3 * i] = 0.01f * static_cast<float>(i);
        m.rotation[4 * i] = 1;
        m.opacity_logit[i] = 4;
    }
    for (const glm::dvec3& up : {glm::dvec3(0, -1, 0), glm::dvec3(0, 0, 1)}) {
        TurntableOptions options;
        options.seconds = 2;
        options.fps = 12;
        options.up = up;
        const CameraPath path = turntable(m, options);
        ASSERT_EQ(path.keys.size(), 24U);
        EXPECT_NEAR(path.duration(), 23.0 / 12, 1e-9);
        for (const KeyFrame& key : path.keys) {
            Navigation at;
            apply(key, at);
            EXPECT_GT(glm::dot(key.eye - glm::dvec3(2.5, 0, 0), up), 0.1);
            EXPECT_NEAR(glm::dot(at.right(), up), 0, 1e-9);
            const Camera c = at.camera(options.width, options.height);
            for (const double x : {0.05, 4.94}) {
                const glm::dvec3 p = c.rotation * glm::dvec3(x, 0, 0) + c.translation;
                ASSERT_GT(p.z, 0);
                EXPECT_LT(std::abs(c.fx * p.x / p.z), options.width / 2.0);
                EXPECT_LT(std::abs(c.fy * p.y / p.z), options.height / 2.0);
            }
        }
        const double step = glm::distance(path.keys[0].eye, path.keys[1].eye);
        EXPECT_NEAR(glm::distance(path.keys[23].eye, path.keys[0].eye), step, 1e-6);
    }
}

// A ball before a wall that is far away, and cameras on a circle or on a part of it.
TEST(Turntable, Goes_where_the_cameras_were_around_what_they_look_at) {
    SplatModel m;
    m.resize(4000);
    for (size_t i = 0; i < m.size(); ++i) {
        const double a = 0.7 * static_cast<double>(i), z = 1 - static_cast<double>(i % 1000) / 500;
        const double r = std::sqrt(1 - z * z), far = i < 2000 ? 1 : 50;
        for (size_t c = 0; c < 3; ++c) m.log_scale[3 * i + c] = i < 2000 ? -2.5f : 1.0f;
        m.position[3 * i] = static_cast<float>(far * r * std::cos(a));
        m.position[3 * i + 1] = static_cast<float>(far * z);
        m.position[3 * i + 2] = static_cast<float>(far * r * std::sin(a));
        m.rotation[4 * i] = 1;
        m.opacity_logit[i] = 4;
    }
    for (const double arc : {360.0, 90.0}) {
        TurntableOptions options;
        options.seconds = 2;
        options.fps = 12;
        for (int i = 0; i < 24; ++i) {
            Navigation at;
            at.orbit(glm::radians(40 + arc * i / 24), glm::radians(30.0));
            at.look_from({0, 0, 0}, 5);
            options.cameras.push_back(at.camera(400, 300));
        }
        const CameraPath path = turntable(m, options);
        double farthest = 0;
        for (const KeyFrame& key : path.keys) {
            EXPECT_LT(glm::length(key.eye), 1.3 * 5) << "not behind the cameras";
            EXPECT_GT(glm::length(key.eye), 2);
            EXPECT_NEAR(-key.eye.y / glm::length(key.eye), 0.5, 0.05) << "as high as they are";
            double nearest = HUGE_VAL;
            for (const Camera& c : options.cameras)
                nearest = std::min(
                    nearest, glm::distance(glm::normalize(c.centre()), glm::normalize(key.eye)));
            farthest = std::max(farthest, nearest);
        }
        EXPECT_LT(farthest, 0.3) << arc;
        const double step = glm::distance(path.keys[0].eye, path.keys[1].eye);
        EXPECT_LT(glm::distance(path.keys[23].eye, path.keys[0].eye), 2 * step + 1e-6) << "a loop";
    }
}

TEST(Turntable, Turns_its_head_where_the_cameras_look_outwards) {
    SplatModel m;
    m.resize(4000);
    TurntableOptions options;
    options.seconds = 1;
    for (size_t i = 0; i < m.size(); ++i) {
        const double a = 0.7 * static_cast<double>(i), z = 1 - static_cast<double>(i) / 2000;
        const double r = std::sqrt(std::max(1 - z * z, 0.0));
        for (size_t c = 0; c < 3; ++c) m.log_scale[3 * i + c] = -1.5f;
        m.position[3 * i] = static_cast<float>(4 * r * std::cos(a));
        m.position[3 * i + 1] = static_cast<float>(4 * z);
        m.position[3 * i + 2] = static_cast<float>(4 * r * std::sin(a));
        m.rotation[4 * i] = 1;
        m.opacity_logit[i] = 4;
    }
    for (int i = 0; i < 12; ++i) {
        Navigation at;
        at.eye = {0.1, 0, 0};
        at.look(glm::radians(30.0 * i), glm::radians(10.0));
        options.cameras.push_back(at.camera(400, 300));
    }
    for (const KeyFrame& key : turntable(m, options).keys) {
        EXPECT_LT(glm::length(key.eye), 0.5);
        EXPECT_NEAR(glm::mat3_cast(key.orientation)[2].y, std::sin(glm::radians(10.0)), 0.02);
    }
}

}  // namespace
}  // namespace darb
