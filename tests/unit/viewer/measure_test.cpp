// SPDX-License-Identifier: MIT
// Lengths, heights and areas between points; the scale and the ground that they give; undo.
#include "engine/scene/measure.h"

#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "viewer/session.h"
#include "viewer/tools.h"

namespace darb {
namespace {

const glm::dvec3 kUp(0, -1, 0);

TEST(Measure, A_line_has_length_height_and_distance_across) {
    const MeasuredLengths m = measured_lengths({{{0, 0, 0}, {3, 0, 0}, {3, -4, 0}}, false}, kUp);
    EXPECT_EQ(m.sides, (std::vector<double>{3, 4}));
    EXPECT_EQ(m.total, 7);
    EXPECT_EQ(m.height, 4) << "up is -y";
    EXPECT_EQ(m.across, 3);
    EXPECT_FALSE(m.area);
}

TEST(Measure, A_polygon_has_the_area_of_its_outline) {
    // An L of three unit squares, tilted.
    const glm::dvec3 u = glm::normalize(glm::dvec3(1, 2, 0.5)),
                     v = glm::normalize(glm::cross(u, glm::dvec3(0, 0, 1)));
    Measurement m;
    for (const auto& p : {glm::dvec2(0, 0), {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}})
        m.points.push_back(glm::dvec3(50, 60, 70) + p.x * u + p.y * v);
    m.closed = true;
    const MeasuredLengths lengths = measured_lengths(m, kUp);
    EXPECT_EQ(lengths.sides.size(), 6u);
    EXPECT_NEAR(lengths.total, 8, 1e-12);
    ASSERT_TRUE(lengths.area);
    EXPECT_NEAR(*lengths.area, 3, 1e-12);
    EXPECT_NEAR(*lengths.off_plane, 0, 1e-12);
    m.points[0] += 0.3 * glm::cross(u, v);
    EXPECT_NEAR(*measured_lengths(m, kUp).off_plane, 0.05, 0.01);
}

TEST(Measure, Two_points_close_nothing) {
    const MeasuredLengths m = measured_lengths({{{0, 0, 0}, {1, 0, 0}}, true}, kUp);
    EXPECT_EQ(m.sides.size(), 1u);
    EXPECT_FALSE(m.area);
}

TEST(Measure, The_ground_says_which_way_is_up) {
    const Measurement m{{{0, 5, 0}, {2, 5, 0.2}, {0, 5.1, 2}}, false};
    const auto up = up_of_ground(m, kUp);
    ASSERT_TRUE(up);
    EXPECT_LT(glm::dot(*up, glm::dvec3(0, 1, 0)), -0.99);
    for (const glm::dvec3& p : m.points) EXPECT_NEAR(glm::dot(*up, p - m.points[0]), 0, 1e-12);
    EXPECT_NEAR(glm::dot(*up_of_ground(m, -kUp), *up), -1, 1e-12) << "the side is that of `up`";
    EXPECT_FALSE(up_of_ground({{{0, 0, 0}, {1, 1, 1}, {3, 3, 3}}, false}, kUp)) << "a line";
    EXPECT_FALSE(up_of_ground({{{0, 0, 0}, {1, 1, 1}}, false}, kUp));
}

TEST(Measure, Lengths_are_metres_once_a_unit_is_known) {
    EXPECT_EQ(length_text(1.23456, 0), "1.235 units");
    EXPECT_EQ(length_text(1.5, 2), "3 m");
    EXPECT_EQ(length_text(1.5, 2, 2), "6 m²");
    EXPECT_EQ(length_text(1.5, 0, 2), "1.5 units²");
}

class MeasureSession : public ::testing::Test {
  protected:
    void SetUp() override {
        session_.scene = std::make_unique<Scene>();
        session_.scene->model.resize(4);
        session_.edit = Edit(4);
    }
    Session session_;
};

TEST_F(MeasureSession, Points_are_steps_that_are_undone_one_by_one) {
    Session& s = session_;
    for (int i = 0; i < 3; ++i) add_measured_point({double(i), double(i * i), 0}, -1, s);
    close_measurement(s);
    EXPECT_TRUE(s.edit.facts().measured.closed);
    add_measured_point({9, 9, 9}, 1, s);
    EXPECT_EQ(s.edit.facts().measured.points[1], glm::dvec3(9));
    EXPECT_FALSE(s.edit.unsaved()) << "what is measured is in no file";
    undo_edit(s);
    EXPECT_EQ(s.edit.facts().measured.points[1], glm::dvec3(1, 1, 0));
    undo_edit(s);
    EXPECT_FALSE(s.edit.facts().measured.closed);
    drop_measured_point(s);
    EXPECT_EQ(s.edit.facts().measured.points.size(), 2u);
    clear_measurement(s);
    EXPECT_TRUE(s.edit.facts().measured.points.empty());
    undo_edit(s);
    undo_edit(s);
    EXPECT_EQ(s.edit.facts().measured.points.size(), 3u);
    redo_edit(s);
    EXPECT_EQ(s.edit.facts().measured.points.size(), 2u);
}

TEST_F(MeasureSession, After_a_closed_polygon_another_one_begins) {
    for (int i = 0; i < 3; ++i) add_measured_point({double(i), double(i * i), 0}, -1, session_);
    close_measurement(session_);
    add_measured_point({7, 7, 7}, -1, session_);
    EXPECT_EQ(session_.edit.facts().measured, (Measurement{{{7, 7, 7}}, false}));
}

TEST_F(MeasureSession, A_known_length_sets_the_scale_of_what_is_saved) {
    Session& s = session_;
    EXPECT_THROW(set_known_length(-1, 1, s), Error) << "nothing is measured";
    for (const double x : {0.0, 2.0, 6.0}) add_measured_point({x, 0, 0}, -1, s);
    EXPECT_THROW(set_known_length(-1, 0, s), Error);
    set_known_length(0, 1, s);
    EXPECT_EQ(s.edit.facts().metres_per_unit, 0.5);
    EXPECT_TRUE(s.edit.unsaved());
    EXPECT_EQ(s.edit.apply(s.scene->model).metres_per_unit, 0.5);
    set_known_length(-1, 12, s);
    EXPECT_EQ(s.edit.facts().metres_per_unit, 2);
    undo_edit(s);
    EXPECT_EQ(s.edit.facts().metres_per_unit, 0.5);
    undo_edit(s);
    EXPECT_EQ(s.edit.apply(s.scene->model).metres_per_unit, 0);
    EXPECT_FALSE(s.edit.unsaved());
    EXPECT_EQ(s.edit.facts().measured.points.size(), 3u) << "the points stay";
}

TEST_F(MeasureSession, A_ground_levels_the_view_and_undo_turns_it_back) {
    Session& s = session_;
    EXPECT_THROW(set_ground(s), Error);
    s.navigation.set_up({0, -1, 0});
    const glm::dvec3 before = s.navigation.up, ground = glm::normalize(glm::dvec3(0.2, -1, 0.1));
    const glm::dvec3 u = glm::normalize(glm::cross(ground, glm::dvec3(1, 0, 0)));
    for (const glm::dvec3& p : {glm::dvec3(0.0), u, glm::cross(u, ground)})
        add_measured_point(p, -1, s);
    set_ground(s);
    EXPECT_NEAR(glm::dot(s.navigation.up, ground), 1, 1e-12);
    EXPECT_TRUE(s.edit.facts().ground);
    undo_edit(s);
    EXPECT_NEAR(glm::dot(s.navigation.up, before), 1, 1e-12);
    EXPECT_FALSE(s.edit.facts().ground);
    redo_edit(s);
    EXPECT_NEAR(glm::dot(s.navigation.up, ground), 1, 1e-12);
}

}  // namespace
}  // namespace darb
