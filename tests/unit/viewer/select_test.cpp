// SPDX-License-Identifier: MIT
// Which splats a stroke or a range of values has; the gizmo's handles.
#include "engine/scene/edit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "viewer/tools.h"
#include "viewer/view_camera.h"

namespace darb {
namespace {

// 5 x 5 splats, one unit apart, around (0, 0, 5).
SplatModel grid() {
    SplatModel m;
    m.resize(25);
    for (size_t i = 0; i < 25; ++i) {
        m.position[3 * i] = static_cast<float>(i % 5) - 2;
        m.position[3 * i + 1] = static_cast<float>(i / 5) - 2;
        m.position[3 * i + 2] = 5;
        m.rotation[4 * i] = 1;
        m.opacity_logit[i] = static_cast<float>(i) - 12;
        m.log_scale[3 * i] = std::log(0.1f * static_cast<float>(i + 1));
        m.log_scale[3 * i + 1] = m.log_scale[3 * i + 2] = -9;
        m.sh_dc[3 * i] = i == 7 ? 1.7724539f : 0;  // red 1, else grey
    }
    return m;
}

// A unit at the grid's depth is 100 px.
Camera camera() {
    Camera c;
    c.width = 600;
    c.height = 600;
    c.fx = c.fy = 500;
    c.cx = c.cy = 300;
    return c;
}

int count(const SplatSet& mask) {
    return std::accumulate(mask.begin(), mask.end(), 0);
}

TEST(Select, Rectangle_takes_its_corners_in_any_order) {
    const SplatModel m = grid();
    const SplatSet mask = in_rectangle(m, camera(), {350, 450}, {150, 250});
    EXPECT_EQ(count(mask), 4);  // x at 200 and 300, y at 300 and 400
    EXPECT_EQ(mask[11] + mask[12] + mask[16] + mask[17], 4);
    Camera away = camera();
    away.rotation = glm::dmat3(-1, 0, 0, 0, 1, 0, 0, 0, -1);
    EXPECT_EQ(count(in_rectangle(m, away, {0, 0}, {600, 600})), 0) << "behind the camera";
}

TEST(Select, Lasso_is_even_odd_and_closed) {
    const SplatModel m = grid();
    const std::vector<glm::dvec2> corner = {{50, 50}, {350, 50}, {50, 350}};
    const SplatSet mask = in_lasso(m, camera(), corner);
    EXPECT_EQ(count(mask), 3);  // (100, 100), (200, 100), (100, 200)
    EXPECT_EQ(mask[0] + mask[1] + mask[5], 3);
    EXPECT_EQ(count(in_lasso(m, camera(), {})), 0);
}

TEST(Select, Brush_is_a_line_with_a_radius) {
    const SplatModel m = grid();
    EXPECT_EQ(count(under_brush(m, camera(), {{100, 110}, {500, 110}}, 20)), 5);
    EXPECT_EQ(count(under_brush(m, camera(), {{100, 110}, {500, 110}}, 5)), 0);
    EXPECT_EQ(count(under_brush(m, camera(), {{300, 300}}, 105)), 5) << "a dot";
}

TEST(Select, A_long_brush_is_as_its_segments_are) {
    SplatModel m = grid();
    m.resize(4000);
    for (size_t i = 0; i < m.size(); ++i) {
        m.position[3 * i] = static_cast<float>(i % 80) / 16 - 2.5f;
        m.position[3 * i + 1] = static_cast<float>(i / 80) / 10 - 2.5f;
        m.position[3 * i + 2] = 5;
    }
    std::vector<glm::dvec2> stroke;
    for (int i = 0; i < 60; ++i) stroke.emplace_back(300 + 4 * i * std::cos(i), 300 + 3 * i);
    for (const double radius : {3.0, 17.0, 90.0}) {
        const SplatSet mask = under_brush(m, camera(), stroke, radius);
        for (size_t i = 0; i < m.size(); ++i) {
            const glm::dvec2 at(300 + 100.0 * double{m.position[3 * i]},
                                300 + 100.0 * double{m.position[3 * i + 1]});
            double least = glm::distance(at, stroke[0]);
            for (size_t k = 1; k < stroke.size(); ++k)
                least = std::min(least, distance_to_segment(at, stroke[k - 1], stroke[k]));
            if (std::abs(least - radius) > 1e-9) {
                ASSERT_EQ(mask[i], least < radius) << i << ' ' << radius;
            }
        }
        EXPECT_GT(count(mask), 10) << radius;
    }
    EXPECT_EQ(count(under_brush(m, camera(), {}, 50)), 0);
}

TEST(Select, Values_have_both_ends) {
    const SplatModel m = grid();
    EXPECT_EQ(count(by_opacity(m, 0.5, 1)), 13);
    EXPECT_EQ(count(by_scale(m, 0.95, 1.15)), 2);  // 1 and 1.1: the largest axis counts
    const SplatSet red = by_colour(m, {1, 0.5, 0.5}, 0.05);
    EXPECT_EQ(count(red), 1);
    EXPECT_EQ(red[7], 1);
    EXPECT_EQ(count(in_region(m, {Region::Shape::sphere, {0, 0, 5}, glm::dvec3(1.1)})), 5);
}

TEST(Select, Grown_adds_what_is_near_wherever_the_origin_is) {
    SplatModel m = grid();
    m.origin = {-1e5, 3, 77};
    SplatSet mask(25, 0);
    mask[12] = 1;
    EXPECT_EQ(count(grown(m, mask, 1.1)), 5);
    EXPECT_EQ(count(grown(m, mask, 1.5)), 9);
    EXPECT_EQ(count(grown(m, mask, 0.9)), 1);
    EXPECT_EQ(count(grown(m, SplatSet(25, 0), 3)), 0);
}

TEST(Gizmo, A_drag_along_an_axis_moves_by_as_much_as_the_hand) {
    const Gizmo g{GizmoMode::move, {0, 0, 5}, 90};
    const Camera c = camera();
    EXPECT_EQ(handle_at(g, c, {350, 302}), 0);
    EXPECT_EQ(handle_at(g, c, {297, 360}), 1);
    EXPECT_FALSE(handle_at(g, c, {360, 360}));
    const Similarity s = dragged(g, c, 0, {350, 302}, {450, 290});
    EXPECT_NEAR(s.translation.x, 1, 1e-3);
    EXPECT_NEAR(s.translation.y, 0, 1e-12);
    const Similarity along_view = dragged(g, c, 2, {300, 300}, {310, 300});
    EXPECT_EQ(along_view.translation, glm::dvec3(0.0)) << "cannot be said";
}

TEST(Gizmo, A_quarter_of_a_ring_is_a_quarter_of_a_turn_about_the_centre) {
    const Gizmo g{GizmoMode::turn, {0.5, 0, 5}, 90};
    const Camera c = camera();
    const Similarity s = dragged(g, c, 2, {440, 300}, {350, 390});
    const glm::dvec3 moved = s.scale * (s.turn * glm::dvec3(1.5, 0, 5)) + s.translation;
    EXPECT_NEAR(moved.x, 0.5, 1e-9);
    EXPECT_NEAR(moved.y, 1, 1e-9);
    EXPECT_NEAR(moved.z, 5, 1e-9);
    const double diagonal = 90 * std::sqrt(0.5);  // away from the rings that are seen edge-on
    EXPECT_EQ(handle_at(g, c, {350 + diagonal, 300 + diagonal}), 2);
}

TEST(Gizmo, A_ring_twice_as_wide_is_twice_the_size) {
    const Gizmo g{GizmoMode::scale, {0, 0, 5}, 90};
    const Similarity s = dragged(g, camera(), 0, {390, 300}, {300, 480});
    EXPECT_NEAR(s.scale, 2, 1e-12);
    const glm::dvec3 centre = s.scale * (s.turn * g.centre) + s.translation;
    EXPECT_NEAR(glm::distance(centre, g.centre), 0, 1e-12);
    EXPECT_EQ(handle_at(g, camera(), {300, 212}), 0);
}

}  // namespace
}  // namespace darb
