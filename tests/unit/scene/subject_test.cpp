// SPDX-License-Identifier: MIT
// The subject of a scene, with synthetic rigs of cameras.
#include "engine/scene/subject.h"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "engine/core/rng.h"
#include "engine/scene/splat_file.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

constexpr double kWholeTurn = 2 * std::numbers::pi;

/// Splats on a sphere.
void add_shell(const glm::dvec3& centre, double radius, int count, SplatModel& m) {
    Pcg32 rng(static_cast<std::uint64_t>(count));
    for (int i = 0; i < count; ++i) {
        const glm::dvec3 way(rng.normal(), rng.normal(), rng.normal());
        append_splat(centre + radius * glm::normalize(way),
                     glm::dvec3(2 * radius / std::sqrt(count)), 3, m);
    }
}

/// A wall or a floor, given by a corner and two sides.
void add_plane(const glm::dvec3& from, const glm::dvec3& a, const glm::dvec3& b, int count,
               SplatModel& m) {
    Pcg32 rng(7);
    const double size = std::sqrt(glm::length(a) * glm::length(b) / count);
    for (int i = 0; i < count; ++i) {
        const double u = rng.uniform(), v = rng.uniform();
        append_splat(from + u * a + v * b, glm::dvec3(size), 3, m);
    }
}

/// y is down.
Camera camera_at(const glm::dvec3& eye, const glm::dvec3& forward, double fov = 0.9) {
    Camera c;
    c.width = 300;
    c.height = 200;
    c.fx = c.fy = 0.5 * c.width / std::tan(fov / 2);
    c.cx = 150;
    c.cy = 100;
    const glm::dvec3 z = glm::normalize(forward);
    const glm::dvec3 down = std::abs(z.y) > 0.99 ? glm::dvec3(0, 0, -1) : glm::dvec3(0, 1, 0);
    const glm::dvec3 x = glm::normalize(glm::cross(down, z));
    c.rotation = glm::transpose(glm::dmat3(x, glm::cross(z, x), z));
    c.translation = -(c.rotation * eye);
    return c;
}

glm::dvec3 on_circle(int i, int count, double radius, double y = 0) {
    return {radius * std::sin(kWholeTurn * i / count), y,
            radius * std::cos(kWholeTurn * i / count)};
}

const glm::dvec3 kMiddle(3, -1, 2);

/// An object of radius 1 before a background of radius 40.
SplatModel object_and_background() {
    SplatModel m;
    add_shell(kMiddle, 1, 3000, m);
    add_shell(kMiddle, 40, 9000, m);
    return m;
}

std::vector<Camera> ring_around(const glm::dvec3& centre, int count, double radius = 4) {
    std::vector<Camera> cameras;
    for (int i = 0; i < count; ++i) {
        const glm::dvec3 from = on_circle(i, count, radius, -1);
        cameras.push_back(camera_at(centre + from, -from));
    }
    return cameras;
}

void expect_near(const glm::dvec3& a, const glm::dvec3& b, double within) {
    EXPECT_LT(glm::distance(a, b), within)
        << a.x << ' ' << a.y << ' ' << a.z << ", not " << b.x << ' ' << b.y << ' ' << b.z;
}

TEST(Subject, of_a_ring_is_the_object_and_not_the_background) {
    SplatModel m = object_and_background();
    m.origin = {1000, 0, -500};
    std::vector<Camera> cameras = ring_around(kMiddle + m.origin, 30);
    const Subject subject = subject_of(m, cameras);
    expect_near(subject.centre, kMiddle + m.origin, 0.05);
    EXPECT_FALSE(subject.around);
    EXPECT_GT(subject.radius, 0.9);
    EXPECT_LT(subject.radius, 2.5);
    EXPECT_NEAR(pivot_depth(subject, m, cameras[3]), std::hypot(4, 1), 0.05);
}

TEST(Subject, is_not_moved_by_outlying_cameras) {
    const SplatModel m = object_and_background();
    std::vector<Camera> cameras = ring_around(kMiddle, 20);
    for (int i = 0; i < 4; ++i) {
        cameras.push_back(camera_at(kMiddle + on_circle(i, 4, 4), {0.3 * i, 1, 2.0 - i}));
        cameras.push_back(camera_at(on_circle(i, 4, 1e6), {1, 0.2, 0.1 * i}));
    }
    const Subject subject = subject_of(m, cameras);
    expect_near(subject.centre, kMiddle, 0.3);
    EXPECT_LT(subject.radius, 4);
}

TEST(Subject, of_an_object_alone_is_no_larger_than_it) {
    SplatModel m;
    add_shell(kMiddle, 0.5, 3000, m);
    const Subject subject = subject_of(m, ring_around(kMiddle, 12));
    expect_near(subject.centre, kMiddle, 0.05);
    EXPECT_NEAR(subject.radius, 0.5, 0.05);
}

TEST(Subject, of_a_front_is_at_the_depth_that_is_seen) {
    SplatModel m;  // a facade, and sky far behind
    add_plane({-6, -3, 10}, {12, 0, 0}, {0, 6, 0}, 8000, m);
    add_shell({0, 0, 0}, 300, 5000, m);
    std::vector<Camera> in_line;
    for (int i = -5; i <= 5; ++i) in_line.push_back(camera_at({0.8 * i, 0, 0}, {0, 0, 1}));
    const Subject subject = subject_of(m, in_line);
    expect_near(subject.centre, {0, 0, 10}, 0.3);
    EXPECT_GT(subject.radius, 5) << "all that they look at";
    EXPECT_LT(subject.radius, 12);
    for (int i = 0; i < 11; ++i)  // all but parallel: they meet far behind the facade
        in_line[static_cast<std::size_t>(i)] =
            camera_at({0.8 * (i - 5), 0, 0}, {-0.008 * (i - 5), 0, 1});
    expect_near(subject_of(m, in_line).centre, {0, 0, 10}, 3);
    const Subject of_one = subject_of(m, std::vector<Camera>{camera_at({2, 1, 0}, {0, 0, 1})});
    expect_near(of_one.centre, {2, 1, 10}, 0.3);
}

TEST(Subject, of_a_map_is_the_ground) {
    SplatModel m;
    add_plane({-100, 0, -60}, {200, 0, 0}, {0, 0, 120}, 20000, m);
    std::vector<Camera> cameras;
    for (int x = -4; x <= 4; ++x)
        for (int z = -2; z <= 2; ++z)
            cameras.push_back(camera_at({20.0 * x, -50, 20.0 * z}, {0, 1, 0}));
    const Subject subject = subject_of(m, cameras);
    expect_near(subject.centre, {0, 0, 0}, 3);
    EXPECT_GT(subject.radius, 60) << "the whole map, not what one camera sees";
    EXPECT_NEAR(pivot_depth(subject, m, cameras[0]), 50, 5) << "far from the map's middle, too";
}

TEST(Subject, of_a_room_is_where_the_cameras_stand_and_no_pivot_is_behind) {
    SplatModel m;
    add_shell({0, 0, 0}, 5, 20000, m);
    const std::function<glm::dvec3(int)> places[] = {
        [](int) { return glm::dvec3(0.2, 0, 0.1); },           // a panorama
        [](int i) { return on_circle(i, 24, 1); },             // outwards, from a ring
        [](int i) { return on_circle(7 * i % 24, 24, 1.5); },  // here and there
    };
    for (const auto& place : places) {
        std::vector<Camera> cameras;
        for (int i = 0; i < 24; ++i)
            cameras.push_back(camera_at(place(i), on_circle(i, 24, 1, 0.1)));
        const Subject subject = subject_of(m, cameras);
        EXPECT_TRUE(subject.around);
        expect_near(subject.centre, {0, 0, 0}, 0.5);
        EXPECT_NEAR(subject.radius, 5, 1.5);
        for (const Camera& camera : cameras) {
            const double depth = pivot_depth(subject, m, camera);
            const glm::dvec3 at = camera.centre() + depth * glm::transpose(camera.rotation)[2];
            EXPECT_NEAR(glm::length(at), 5, 0.8) << "the wall";
        }
    }
    std::vector<Camera> fan;  // a third of a turn, from one place: something is ahead
    for (int i = -4; i <= 4; ++i) fan.push_back(camera_at({0, 0, 0}, on_circle(i, 24, 1)));
    const Subject ahead = subject_of(m, fan);
    EXPECT_FALSE(ahead.around);
    EXPECT_GT(ahead.centre.z, 3);
}

TEST(Subject, of_a_path_through_a_street_is_ahead_of_most) {
    SplatModel m;
    for (const double side : {-4.0, 4.0}) add_plane({side, -4, 0}, {0, 0, 60}, {0, 6, 0}, 6000, m);
    add_plane({-4, 2, 0}, {8, 0, 0}, {0, 0, 60}, 6000, m);
    std::vector<Camera> cameras;
    for (int i = 0; i < 20; ++i) cameras.push_back(camera_at({0, 0, 2.0 * i}, {0, 0.05, 1}));
    const Subject subject = subject_of(m, cameras);
    for (const Camera& camera : cameras) {
        const double depth = pivot_depth(subject, m, camera);
        EXPECT_GT(depth, 1);
        EXPECT_LT(depth, 60);
    }
    EXPECT_LT(std::abs(subject.centre.x), 1);
}

TEST(Subject, without_cameras_is_what_is_dense) {
    SplatModel m;
    Pcg32 rng(5);
    for (int i = 0; i < 6000; ++i) {  // denser and denser towards the middle
        const glm::dvec3 way(rng.normal(), rng.normal(), rng.normal());
        append_splat(kMiddle + glm::normalize(way) * std::exp(4.0 * i / 6000 - 2), glm::dvec3(0.05),
                     3, m);
    }
    add_shell({0, 0, 0}, 200, 3000, m);
    const Bounds dense = dense_bounds(m);
    expect_near(dense.centre, kMiddle, 1);
    EXPECT_LT(dense.radius, 6);
    SplatModel alone;
    add_shell(kMiddle, 2, 4000, alone);
    expect_near(dense_bounds(alone).centre, kMiddle, 0.1);
    EXPECT_NEAR(dense_bounds(alone).radius, 2, 0.1);
    EXPECT_EQ(subject_of(alone).radius, dense_bounds(alone).radius);
}

TEST(Subject, of_nothing_is_finite) {
    const std::vector<Camera> cameras = ring_around({0, 0, 0}, 5);
    for (const std::size_t count : {0u, 1u, 2u}) {
        SplatModel m = sample_model(0, count);
        for (const std::span<const Camera> rig : {std::span<const Camera>(), std::span(cameras)}) {
            const Subject subject = subject_of(m, rig);
            EXPECT_TRUE(std::isfinite(glm::length(subject.centre)));
            EXPECT_GT(subject.radius, 0);
            EXPECT_GT(pivot_depth(subject, m, cameras[0]), 0);
        }
    }
}

TEST(Enclosing, holds_both_balls) {
    const Bounds a{{0, 0, 0}, 1}, far{{10, 0, 0}, 2}, inside{{0.2, 0, 0}, 0.3};
    const Bounds both = enclosing(a, far);
    EXPECT_NEAR(both.radius, 6.5, 1e-12);
    expect_near(both.centre, {5.5, 0, 0}, 1e-12);
    EXPECT_EQ(enclosing(a, inside).radius, 1);
    EXPECT_EQ(enclosing(inside, a).centre, a.centre);
}

TEST(SceneName, is_that_of_the_run_folder_or_file) {
    const std::filesystem::path file = "a/fox/point_cloud/iteration_7/point_cloud.ply";
    EXPECT_EQ(scene_name(file), "fox");
    EXPECT_EQ(scene_name(file, true), "fox");
    EXPECT_EQ(run_of_scene(file), std::filesystem::absolute("a/fox"));
    EXPECT_EQ(scene_name("a/toy.compressed.ply"), "toy");
    EXPECT_EQ(scene_name("a/toy.compressed.ply", true), "toy.compressed.ply");
    EXPECT_EQ(scene_name("a/point_cloud.ply"), "point_cloud");
    EXPECT_EQ(run_of_scene("a/point_cloud.ply"), "");
    EXPECT_EQ(scene_name("a/robot/meta.json"), "robot");
    const auto here = std::filesystem::current_path().filename().string();
    EXPECT_EQ(scene_name("."), here);
    EXPECT_EQ(scene_name("./"), here);
}

TEST(UpOfCameras, is_how_they_were_held) {
    const auto up = up_of_cameras(ring_around({0, 0, 0}, 8));
    ASSERT_TRUE(up);
    expect_near(*up, {0, -1, 0}, 0.01);
    std::vector<Camera> map;  // to and fro
    for (int i = 0; i < 6; ++i) {
        map.push_back(camera_at({0, -50, 20.0 * i}, {0, 1, 0}));
        if (i % 2 == 1)
            map.back().rotation = glm::dmat3(-1, 0, 0, 0, -1, 0, 0, 0, 1) * map.back().rotation;
    }
    ASSERT_TRUE(up_of_cameras(map));
    expect_near(*up_of_cameras(map), {0, -1, 0}, 0.01);
    EXPECT_FALSE(up_of_cameras({}));
}

}  // namespace
}  // namespace darb::test
