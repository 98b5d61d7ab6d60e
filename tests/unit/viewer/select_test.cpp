// SPDX-License-Identifier: MIT
// Which splats a stroke or a range of values has; the gizmo's handles.
#include "engine/scene/edit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "viewer/commands.h"
#include "viewer/controls.h"
#include "viewer/session.h"
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

// Rows of splats that touch their neighbours. The first row is red up to a gap in its middle, then
// grey; the second row, too far from the first to touch it, is red.
SplatModel two_rows() {
    SplatModel m;
    m.resize(20);
    m.origin = {1000, 0, 0};
    for (size_t i = 0; i < 20; ++i) {
        m.position[3 * i] = static_cast<float>(i % 10);
        m.position[3 * i + 1] = i < 10 ? 0.0f : 20.0f;
        m.rotation[4 * i] = 1;
        m.opacity_logit[i] = 3;
        for (size_t c = 0; c < 3; ++c) m.log_scale[3 * i + c] = std::log(0.4f);
        m.sh_dc[3 * i] = i < 6 || i >= 10 ? 1.7724539f : 0;
    }
    return m;
}

TEST(Select, A_flood_stays_in_touch_and_in_its_colour) {
    const SplatModel m = two_rows();
    SplatSet unseen(20, 0);
    const glm::dvec3 at(1002.1, 0.3, 0);
    const SplatSet red = flooded(m, at, 0.1, unseen);
    EXPECT_EQ(count(red), 6) << "not the grey ones, nor those of the other row";
    EXPECT_EQ(std::accumulate(red.begin(), red.begin() + 6, 0), 6);
    EXPECT_EQ(count(flooded(m, at, 0.6, unseen)), 10) << "all colours, one row";
    for (size_t i = 3; i < 5; ++i) unseen[i] = 1;
    EXPECT_EQ(count(flooded(m, at, 0.1, unseen)), 3) << "what is hidden connects nothing";
    unseen[2] = 1;
    EXPECT_EQ(flooded(m, at, 0.1, unseen)[1], 1) << "the nearest that is seen";
    EXPECT_EQ(count(flooded(m, at, 0.1, SplatSet(20, 1))), 0);
    SplatModel faint = m;
    const glm::dvec3 grey(1006.1, 0.3, 0);
    faint.opacity_logit[6] = -3;
    faint.sh_dc[3 * 6] = -1.7724539f;
    EXPECT_EQ(flooded(faint, grey, 0.1, SplatSet(20, 0))[7], 1) << "none that is hardly seen";
}

// The pointer as a hand moves it, over a scene of the grid that fills the window.
class ClickedTools : public ::testing::Test {
  protected:
    void SetUp() override {
        session_.scene = std::make_unique<Scene>();
        session_.scene->model = grid();
        session_.edit = Edit(25);
        session_.panels = true;
        Session& s = session_;
        camera_ = camera_in_window(s.photos, s.navigation, free_area(s, 1200, 800));
    }
    bool pointer(const glm::dvec2& at, bool down, bool shift = false) {
        Input in;
        in.x = at.x;
        in.y = at.y;
        in.left = down;
        in.shift = shift;
        ControlFrame frame;
        frame.width = 1200;
        frame.height = 800;
        return use_tool(in, frame, session_);
    }
    void click(const glm::dvec2& at, bool shift = false) {
        pointer(at, true, shift);
        pointer(at, false);
    }
    glm::dvec2 seen(size_t splat) const {
        return *pixel_of(camera_, position_of(session_.scene->model, splat));
    }
    Session session_;
    Camera camera_;
};

TEST_F(ClickedTools, A_polygon_is_closed_at_its_first_corner) {
    Session& s = session_;
    choose_tool(Tool::polygon, s);
    click({0, 0});
    click({1200, 0});
    EXPECT_FALSE(closes_polygon(s, {0, 0})) << "two corners have no inside";
    click({600, 1});
    press(Key::remove, s);
    EXPECT_EQ(s.tools.stroke.size(), 2u) << "the last corner was taken away";
    click({1200, 800});
    click({0, 800});
    EXPECT_TRUE(pointer({300, 300}, false)) << "it goes on while the button is up";
    EXPECT_EQ(s.edit.selected_count(), 0u);
    const auto inside =
        static_cast<std::size_t>(count(in_rectangle(s.scene->model, camera_, {0, 0}, {1200, 800})));
    click({4, 5});
    EXPECT_FALSE(s.tools.drawing);
    EXPECT_GT(inside, 0u);
    EXPECT_EQ(s.edit.selected_count(), inside);
    const std::vector<EditOperation> done = s.edit.operations();
    ASSERT_EQ(done.size(), 1u);
    const auto& select = std::get<edits::Select>(done[0]);
    EXPECT_EQ(std::get<by::Polygon>(select.what).outline.size(), 4u);
    undo_edit(s);
    EXPECT_EQ(s.edit.selected_count(), 0u);
}

TEST_F(ClickedTools, A_polygon_is_closed_by_two_clicks_at_one_place_and_cancelled_by_Esc) {
    Session& s = session_;
    choose_tool(Tool::polygon, s);
    for (const glm::dvec2& corner : {glm::dvec2(0, 0), {1200, 0}, {1200, 800}}) click(corner);
    EXPECT_TRUE(cancel_stroke(s));
    EXPECT_FALSE(s.tools.drawing);
    for (const glm::dvec2& corner : {glm::dvec2(0, 0), {1200, 0}, {1200, 800}, {0, 800}})
        click(corner, true);
    EXPECT_TRUE(s.tools.drawing);
    click({1, 799});
    EXPECT_FALSE(s.tools.drawing);
    const std::vector<EditOperation> done = s.edit.operations();
    ASSERT_EQ(done.size(), 1u);
    EXPECT_EQ(std::get<edits::Select>(done[0]).how, Combine::add) << "as the first click said";
}

TEST_F(ClickedTools, A_flood_takes_a_click_and_leaves_drags_to_the_camera) {
    Session& s = session_;
    for (float& logit : s.scene->model.opacity_logit) logit = 3;
    for (float& scale : s.scene->model.log_scale) scale = std::log(0.4f);
    choose_tool(Tool::flood, s);
    const glm::dvec2 at = seen(13);
    EXPECT_TRUE(pointer(at, true));
    EXPECT_FALSE(pointer(at + 30.0, true)) << "this drag turns the view";
    EXPECT_FALSE(pointer(at + 30.0, false));
    EXPECT_EQ(s.edit.selected_count(), 0u);
    EXPECT_TRUE(s.requests.empty());
    click(at);
    ASSERT_EQ(s.requests.size(), 1u) << "which the picture's surface answers";
    const auto& asked = std::get<request::Flood>(s.requests[0]);
    EXPECT_EQ(asked.px, at);
    EXPECT_EQ(asked.combine, Combine::replace);
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
