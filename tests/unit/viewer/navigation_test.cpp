// SPDX-License-Identifier: MIT
// Where the camera goes when mouse and keys move it.
#include "viewer/navigation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/core/error.h"
#include "engine/scene/subject.h"

namespace darb {
namespace {

constexpr double kTight = 1e-9;  // a handful of double operations on values near 1

// A camera that looks somewhere oblique, with -y up.
Navigation oblique() {
    Navigation n;
    n.eye = {1, -2, 0.5};
    n.distance = 4;
    n.look(0.7, 0.3);
    return n;
}

// Pixel of a world point; depth in z.
glm::dvec3 project(const Navigation& n, const glm::dvec3& world) {
    const Camera c = n.camera(640, 480);
    const glm::dvec3 p = c.rotation * world + c.translation;
    return {c.fx * p.x / p.z + c.cx, c.fy * p.y / p.z + c.cy, p.z};
}

void expect_near(const glm::dvec3& got, const glm::dvec3& expected, double tolerance = kTight) {
    EXPECT_NEAR(got.x, expected.x, tolerance);
    EXPECT_NEAR(got.y, expected.y, tolerance);
    EXPECT_NEAR(got.z, expected.z, tolerance);
}

TEST(Navigation, Fly_ahead_goes_where_one_looks) {
    Navigation n = oblique();
    const glm::dvec3 before = n.eye, looked_at = n.eye + 10.0 * n.forward();
    n.fly({0, 0, 3});
    expect_near(n.eye, before + 3.0 * glm::normalize(looked_at - before));
    const glm::dvec3 centre = project(n, looked_at);
    EXPECT_NEAR(centre.x, 320, 1e-6);
    EXPECT_NEAR(centre.y, 240, 1e-6);
    EXPECT_NEAR(centre.z, 7, 1e-9);
}

TEST(Navigation, Fly_right_and_up_moves_the_scene_left_and_down) {
    Navigation n = oblique();
    const glm::dvec3 point = n.pivot();
    n.fly({0.5, 0.25, 0});
    const glm::dvec3 at = project(n, point);
    EXPECT_LT(at.x, 320);
    EXPECT_GT(at.y, 240);
}

TEST(Navigation, Orbit_keeps_pivot_and_distance) {
    Navigation n = oblique();
    const glm::dvec3 pivot = n.pivot();
    for (int i = 0; i < 1000; ++i) n.orbit(0.013, 0.007 * (i % 7 - 3));
    expect_near(n.pivot(), pivot);
    EXPECT_NEAR(glm::distance(n.eye, pivot), 4, kTight);
    EXPECT_NEAR(glm::determinant(n.axes), 1, kTight);
}

TEST(Navigation, Orbit_near_side_follows_the_hand) {
    Navigation n = oblique();
    n.level();
    const glm::dvec3 near_side = n.pivot() - n.forward();
    n.orbit(0.1, 0);
    EXPECT_GT(project(n, near_side).x, 320);
    n = oblique();
    n.orbit(0, 0.1);
    EXPECT_GT(project(n, near_side).y, 240);
}

TEST(Navigation, Orbit_stops_before_the_poles) {
    Navigation n;
    for (int i = 0; i < 100; ++i) n.orbit(0, 0.1);
    EXPECT_NEAR(std::acos(glm::dot(n.forward(), n.up)), glm::radians(179.0), 1e-6);
    EXPECT_GT(glm::dot(-n.down(), n.up), 0);
    for (int i = 0; i < 200; ++i) n.orbit(0, -0.1);
    EXPECT_NEAR(std::acos(glm::dot(n.forward(), n.up)), glm::radians(1.0), 1e-6);
}

TEST(Navigation, Look_turns_the_head_and_keeps_the_eye) {
    Navigation n;
    const glm::dvec3 eye = n.eye, ahead = n.pivot();
    n.look(0.2, 0.1);
    expect_near(n.eye, eye);
    EXPECT_LT(project(n, ahead).x, 320);  // turned right: the scene goes left
    EXPECT_LT(project(n, ahead).y, 240);  // turned down: the scene goes up
}

TEST(Navigation, Pan_what_is_at_the_pivot_follows_the_pointer) {
    Navigation n = oblique();
    const glm::dvec3 pivot = n.pivot();
    n.pan(30, -12, 480);
    const glm::dvec3 at = project(n, pivot);
    EXPECT_NEAR(at.x, 350, 1e-6);
    EXPECT_NEAR(at.y, 228, 1e-6);
}

TEST(Navigation, Zoom_keeps_the_pivot) {
    Navigation n = oblique();
    const glm::dvec3 pivot = n.pivot();
    n.zoom(0.5);
    expect_near(n.pivot(), pivot);
    EXPECT_NEAR(n.distance, 2, kTight);
}

TEST(Navigation, Frame_sphere_touches_the_smaller_side) {
    for (const double aspect : {0.5, 640.0 / 480}) {
        Navigation n = oblique();
        n.frame({5, 6, 7}, 2, aspect);
        expect_near(n.pivot(), {5, 6, 7});
        const double fov_x = 2 * std::atan(std::tan(n.fov_y / 2) * aspect);
        EXPECT_NEAR(n.distance * std::sin(std::min(fov_x, n.fov_y) / 2), 2, kTight);
    }
}

TEST(Navigation, Set_up_levels_the_horizon) {
    Navigation n = oblique();
    n.set_up({0, 0, 1});
    EXPECT_NEAR(glm::dot(n.right(), n.up), 0, kTight);
    EXPECT_GT(glm::dot(-n.down(), n.up), 0);
    EXPECT_NEAR(glm::determinant(n.axes), 1, kTight);
}

TEST(Navigation, A_new_up_keeps_the_pivot_and_the_height_above_the_horizon) {
    for (const char* name : {"y", "z", "-z", "x"}) {  // y: a flip
        Navigation n = oblique();
        const glm::dvec3 pivot = n.pivot();
        const double height = glm::dot(n.forward(), n.up);
        n.set_up(up_from_name(name));
        expect_near(n.pivot(), pivot);
        EXPECT_NEAR(glm::dot(n.forward(), n.up), height, kTight) << name;
        EXPECT_NEAR(glm::dot(n.right(), n.up), 0, kTight) << name;
        EXPECT_GT(glm::dot(-n.down(), n.up), 0) << name;
    }
}

TEST(Navigation, Take_gives_the_camera_back) {
    const Navigation n = oblique();
    const Camera c = n.camera(640, 480);
    Navigation other;
    other.take(c);
    expect_near(other.eye, n.eye);
    EXPECT_NEAR(other.fov_y, n.fov_y, kTight);
    for (int i = 0; i < 3; ++i) expect_near(other.axes[i], n.axes[i]);
}

TEST(Navigation, Up_names_round_trip_and_others_are_errors) {
    for (const char* name : {"x", "-x", "y", "-y", "z", "-z"})
        EXPECT_EQ(up_name(up_from_name(name)), name);
    for (const char* name : {"", "-", "w", "xy", "--z"}) EXPECT_THROW(up_from_name(name), Error);
}

}  // namespace
}  // namespace darb
