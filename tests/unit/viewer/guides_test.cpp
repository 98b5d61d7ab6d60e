// SPDX-License-Identifier: MIT
// Grid, axes and cameras over the picture: where they are and which of them a pointer hits; the
// handles of the gizmo; thumbnails.
#include "viewer/guides.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "viewer/navigation.h"
#include "viewer/thumbnails.h"
#include "viewer/tools.h"
#include "viewer/view_camera.h"

namespace darb {
namespace {

Camera plain_camera() {
    Camera c;
    c.width = 600;
    c.height = 400;
    c.fx = c.fy = 300;
    c.cx = 300;
    c.cy = 200;
    return c;
}

TEST(Grid, lies_on_the_ground_in_round_steps) {
    SplatModel m;
    m.resize(1000);
    for (std::size_t i = 0; i < 1000; ++i)  // heights from 0 to 1 along -y, some far below
        m.position[3 * i + 1] = i < 10 ? 50.0f : -static_cast<float>(i) / 1000;
    const Bounds subject{{0, -0.5, 0}, 1};
    const glm::dvec3 up(0, -1, 0);
    const double ground = ground_height(m, subject, up);
    EXPECT_NEAR(ground, 0.03, 0.005);
    const GroundGrid grid = ground_grid(subject, up, ground, 0);
    EXPECT_DOUBLE_EQ(grid.step, 0.2);
    ASSERT_GT(grid.lines.size(), 20u);
    for (const Segment& line : grid.lines)
        for (const glm::dvec3& end : line) {
            EXPECT_NEAR(end.y, -ground, 1e-12);
            EXPECT_NEAR(std::remainder(end.x, grid.step), 0, 1e-9);
            EXPECT_NEAR(std::remainder(end.z, grid.step), 0, 1e-9);
            EXPECT_GE(std::max(std::abs(end.x), std::abs(end.z)), 1.4);
        }
    // 0.3 m a unit: 0.9 m to 25 cells
    EXPECT_NEAR(ground_grid(subject, up, ground, 0.3).step, 0.05 / 0.3, 1e-12);
    EXPECT_EQ(ground_height(SplatModel(), subject, up), -0.5);
    EXPECT_TRUE(ground_grid({{0, 0, 0}, 0}, up, 0, 0).lines.empty());
}

TEST(Axes, the_ball_under_the_pointer_is_the_one_in_front) {
    const glm::dvec2 centre(100, 100);
    const glm::dmat3 ahead(1.0);  // looks along z, y down
    const auto balls = axis_balls(ahead, centre, 1);
    const auto hit = [&](double x, double y) { return axis_at(balls, {x, y}, 1); };
    ASSERT_TRUE(hit(100 + kAxisReach, 100));
    EXPECT_EQ(hit(100 + kAxisReach, 100)->axis, 0);
    EXPECT_TRUE(hit(100 + kAxisReach, 100)->positive);
    EXPECT_EQ(hit(100, 100 + kAxisReach - 9)->axis, 1);
    EXPECT_FALSE(hit(100, 100 - kAxisReach)->positive);
    ASSERT_TRUE(hit(100, 100));
    EXPECT_EQ(hit(100, 100)->axis, 2);
    EXPECT_FALSE(hit(100, 100)->positive) << "-z is nearer to the eye";
    EXPECT_FALSE(hit(120, 120));
    const auto larger = axis_balls(ahead, centre, 2);
    EXPECT_TRUE(axis_at(larger, {100 + 2 * kAxisReach, 118}, 2));
}

TEST(Axes, a_click_looks_along_the_axis_and_keeps_the_pivot) {
    Navigation n;
    n.eye = {3, -2, 1};
    n.distance = 4;
    n.look(0.4, 0.2);
    const glm::dvec3 pivot = n.pivot();
    for (int i = 0; i < 6; ++i) {
        const AxisBall ball{i / 2, i % 2 == 0, {}, 0};
        n.view_from(direction_of(ball));
        EXPECT_LT(glm::distance(n.pivot(), pivot), 1e-9);
        EXPECT_GT(glm::dot(-n.forward(), direction_of(ball)), 1 - 1e-7) << i;
        EXPECT_NEAR(glm::determinant(n.axes), 1, 1e-9);
        EXPECT_LT(std::abs(glm::dot(n.right(), n.up)), 1e-9) << "level";
        const glm::dvec3 before = n.forward();
        n.orbit(0.1, 0.1);
        EXPECT_GT(glm::distance(n.forward(), before), 0.01) << "it orbits on " << i;
    }
}

TEST(Sides, are_axes_of_the_file_and_level) {
    for (const glm::dvec3& up : {glm::dvec3(0, -1, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1),
                                 glm::normalize(glm::dvec3(0.1, -1, 0.05)), glm::dvec3(1, 0, 0)}) {
        const glm::dvec3 front = side_of(up, Side::front), right = side_of(up, Side::right);
        EXPECT_EQ(side_of(up, Side::top), up);
        EXPECT_EQ(glm::length(front), 1);
        EXPECT_LT(std::abs(glm::dot(front, up)), 0.2);
        EXPECT_LT(std::abs(glm::dot(right, up)), 0.2);
        EXPECT_EQ(glm::dot(front, right), 0);
    }
    Navigation n;  // -y up, seen from the front: the right side is on the right
    n.view_from(side_of(n.up, Side::front));
    EXPECT_GT(glm::dot(n.right(), side_of(n.up, Side::right)), 0.99);
    n.set_up({0, 0, 1});
    n.view_from(side_of(n.up, Side::front));
    EXPECT_GT(glm::dot(n.right(), side_of(n.up, Side::right)), 0.99);
}

std::vector<View> two_views() {
    std::vector<View> views(2);
    for (View& view : views) view.camera = plain_camera();
    views[0].camera.translation = {1, 0, 5};   // at (-1, 0, -5)
    views[1].camera.translation = {-1, 0, 5};  // at (1, 0, -5)
    return views;
}

TEST(Cameras, are_hit_at_their_lines_and_pictures) {
    const std::vector<View> views = two_views();
    EXPECT_NEAR(frustum_depth(views, 100), 0.8, 1e-12);
    EXPECT_NEAR(frustum_depth(views, 2), 0.25, 1e-12);
    EXPECT_NEAR(frustum_depth(std::span(views).first(1), 2), 0.2, 1e-12);
    Camera eye = plain_camera();
    eye.translation = {0, 0, 8};  // 3 behind them
    const double depth = 0.8;
    const glm::dvec2 first = *pixel_of(eye, views[0].camera.centre());
    const glm::dvec2 second = *pixel_of(eye, views[1].camera.centre());
    EXPECT_EQ(camera_at(views, depth, eye, first + glm::dvec2(3, 0), 1), 0);
    EXPECT_EQ(camera_at(views, depth, eye, second, 1), 1);
    const Frustum f = frustum_of(views[1].camera, depth);
    EXPECT_LT(glm::distance(f.eye, glm::dvec3(1, 0, -5)), 1e-12);
    glm::dvec2 middle(0.0);
    for (const glm::dvec3& corner : f.corners) middle += *pixel_of(eye, corner) / 4.0;
    EXPECT_EQ(camera_at(views, depth, eye, middle + glm::dvec2(20, 15), 1), 1) << "its picture";
    EXPECT_EQ(camera_at(views, depth, eye, {300, 20}, 1), std::nullopt);
    eye.translation = {0, 0, 1};  // they are behind
    EXPECT_EQ(camera_at(views, depth, eye, {300, 200}, 1), std::nullopt);
}

// At least 10 px wide at every scale, which is what a hand hits.
TEST(GizmoZones, are_wide_enough_for_a_hand) {
    const Camera c = plain_camera();
    for (const double scale : {1.0, 1.5, 2.0})
        for (const GizmoMode mode : {GizmoMode::move, GizmoMode::turn, GizmoMode::scale}) {
            const Gizmo g{mode, {0, 0, 5}, 90 * scale};
            const int axis = mode == GizmoMode::turn ? 2 : 0;  // the ring that faces the camera
            const std::vector<glm::dvec3> lines = handle_lines(g, c, axis);
            ASSERT_GE(lines.size(), 2u);
            const std::size_t i = std::max<std::size_t>(lines.size() / 8, 1);  // where none crosses
            const glm::dvec2 a = *pixel_of(c, lines[i - 1]);
            const glm::dvec2 b = *pixel_of(c, lines[i]);
            const glm::dvec2 along = glm::normalize(b - a), across(-along.y, along.x);
            const glm::dvec2 at = mode == GizmoMode::move ? 0.3 * a + 0.7 * b : 0.5 * (a + b);
            for (const double off : {-5.0, 5.0})
                EXPECT_EQ(handle_at(g, c, at + off * scale * across), axis)
                    << static_cast<int>(mode) << ' ' << off;
        }
}

TEST(Lines, end_before_the_eye) {
    const Camera c = plain_camera();
    EXPECT_FALSE(pixels_of(c, {glm::dvec3(0, 0, -1), glm::dvec3(1, 0, -2)}));
    const auto cut = pixels_of(c, {glm::dvec3(0.5, 0, 1), glm::dvec3(0.5, 0, -1)});
    ASSERT_TRUE(cut);
    EXPECT_NEAR((*cut)[0].x, 450, 1e-9);
    EXPECT_GT((*cut)[1].x, 1e4) << "at the edge of what is before the eye";
}

TEST(Depths, of_the_bar_are_those_of_the_picture) {
    Camera c = plain_camera();
    c.translation = {0, 0, 4};
    const auto range = depth_range(c, {{0, 0, 1}, 2});
    EXPECT_EQ(range[0], 2);
    EXPECT_EQ(range[1], 8);
    EXPECT_EQ(depth_range(c, {{0, 0, 0}, 10})[0], 0);
}

TEST(Thumbnail, is_the_mean_of_boxes_and_dark_where_nothing_is) {
    ImageU8 photo(128, 32, 4);
    for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 128; ++x) {
            photo.at(x, y, 0) = x % 2 == 0 ? 200 : 100;
            photo.at(x, y, 2) = 60;
            photo.at(x, y, 3) = x < 64 ? 255 : 0;
        }
    const Thumbnail t = thumbnail_of(photo, 64);
    EXPECT_EQ(t.width, 64);
    EXPECT_EQ(t.height, 16);
    ASSERT_EQ(t.pixels.size(), 64u * 16);
    EXPECT_EQ(t.pixels[0], 0xFF000000u | 60u << 16 | 150u);
    EXPECT_EQ(t.pixels[63], 0xFF000000u);
    EXPECT_EQ(thumbnail_of(ImageU8(20, 10, 3), 64).width, 20);
    EXPECT_TRUE(thumbnail_of(ImageU8(), 64).pixels.empty());
}

}  // namespace
}  // namespace darb
