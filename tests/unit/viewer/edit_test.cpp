// SPDX-License-Identifier: MIT
// Selection, deletion, undo; cameras for a window; picking.
#include "engine/scene/edit.h"

#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "viewer/bounds.h"
#include "viewer/view_camera.h"

namespace darb {
namespace {

// Splats at x = 0, 1, ..., n - 1; every value identifies its splat.
SplatModel row(size_t n, int degree = 1) {
    SplatModel m;
    m.sh_degree = degree;
    m.resize(n);
    for (size_t i = 0; i < n; ++i) {
        const float f = static_cast<float>(i);
        m.position[3 * i] = f;
        m.opacity_logit[i] = f;
        for (size_t c = 0; c < 3; ++c) m.log_scale[3 * i + c] = f, m.sh_dc[3 * i + c] = f;
        for (size_t c = 0; c < 4; ++c) m.rotation[4 * i + c] = f;
        const size_t rest = static_cast<size_t>(m.rest_count());
        for (size_t c = 0; c < rest; ++c) m.sh_rest[rest * i + c] = f;
    }
    return m;
}

Region box(double low, double high) {
    return {Region::Shape::box, {(low + high) / 2, 0, 0}, {(high - low) / 2, 1, 1}};
}

TEST(Edit, Delete_inside_and_crop_mark_the_right_splats) {
    const SplatModel m = row(10);
    Edit edit(10);
    EXPECT_EQ(edit.remove(m, box(2.5, 4.5), true), 2u);    // 3, 4
    EXPECT_EQ(edit.remove(m, box(-0.5, 6.5), false), 3u);  // 7, 8, 9
    const SplatModel left = edit.apply(m);
    ASSERT_EQ(left.size(), 5u);
    const float expected[] = {0, 1, 2, 5, 6};
    const size_t rest = static_cast<size_t>(m.rest_count());
    for (size_t i = 0; i < 5; ++i) {
        EXPECT_EQ(left.position[3 * i], expected[i]);
        EXPECT_EQ(left.rotation[4 * i + 3], expected[i]);
        EXPECT_EQ(left.sh_rest[rest * i + rest - 1], expected[i]);
        EXPECT_EQ(left.log_scale[3 * i + 2], expected[i]);
        EXPECT_EQ(left.sh_dc[3 * i], expected[i]);
    }
}

TEST(Edit, Undo_and_redo_walk_the_steps) {
    SplatModel m = row(10);
    Edit edit(10);
    edit.remove(m, box(-0.5, 1.5), true);
    edit.remove(m, box(0.5, 3.5), true);  // 1 is gone already: 2, 3
    EXPECT_EQ(edit.removed_count(), 4u);
    edit.undo(m);
    EXPECT_EQ(edit.removed_count(), 2u);
    EXPECT_EQ(edit.removed()[1], 1);  // removed by the first step, stays removed
    EXPECT_EQ(edit.removed()[2], 0);
    edit.undo(m);
    EXPECT_EQ(edit.removed_count(), 0u);
    EXPECT_FALSE(edit.can_undo());
    edit.undo(m);  // nothing left: no harm
    edit.redo(m);
    edit.redo(m);
    EXPECT_EQ(edit.removed_count(), 4u);
    EXPECT_FALSE(edit.can_redo());
}

TEST(Edit, A_new_step_drops_what_was_undone) {
    SplatModel m = row(10);
    Edit edit(10);
    edit.remove(m, box(-0.5, 1.5), true);
    edit.undo(m);
    edit.remove(m, box(7.5, 9.5), true);
    EXPECT_FALSE(edit.can_redo());
    EXPECT_EQ(edit.removed()[0], 0);
    EXPECT_EQ(edit.removed()[9], 1);
}

TEST(Edit, Unsaved_until_marked_and_again_after_another_step) {
    SplatModel m = row(10);
    Edit edit(10);
    EXPECT_FALSE(edit.unsaved());
    edit.remove(m, box(-0.5, 1.5), true);
    EXPECT_TRUE(edit.unsaved());
    edit.mark_saved();
    EXPECT_FALSE(edit.unsaved());
    edit.remove(m, box(7.5, 9.5), true);
    EXPECT_TRUE(edit.unsaved());
    edit.undo(m);
    EXPECT_FALSE(edit.unsaved());  // as saved
    edit.undo(m);
    EXPECT_FALSE(edit.unsaved());  // as in the file that was opened
    edit.remove(m, box(2.5, 3.5), true);
    EXPECT_TRUE(edit.unsaved());  // as many steps as were saved, but another one
}

TEST(Edit, Nothing_selected_is_no_step) {
    const SplatModel m = row(3);
    Edit edit(3);
    EXPECT_EQ(edit.remove(m, box(20, 30), true), 0u);
    EXPECT_FALSE(edit.can_undo());
}

TEST(Edit, Sphere_and_origin_are_in_world_coordinates) {
    SplatModel m = row(10);
    m.origin = {1000, 0, 0};
    Edit edit(10);
    const Region sphere{Region::Shape::sphere, {1004, 0, 0}, {1.5, 0.1, 0.1}};
    EXPECT_EQ(edit.remove(m, sphere, true), 3u);
    EXPECT_EQ(edit.remove(m, sphere, true), 0u);  // those are gone
}

SplatSet only(size_t n, std::initializer_list<size_t> splats) {
    SplatSet mask(n, 0);
    for (const size_t i : splats) mask[i] = 1;
    return mask;
}

TEST(Edit, Selections_combine_and_leave_what_is_not_seen) {
    SplatModel m = row(6);
    Edit edit(6);
    edit.select(only(6, {0, 1}), Combine::replace);
    edit.select(only(6, {2, 3}), Combine::add);
    edit.select(only(6, {1}), Combine::subtract);
    EXPECT_EQ(edit.selected(), only(6, {0, 2, 3}));
    EXPECT_EQ(edit.hide_selected(), 3u);
    EXPECT_EQ(edit.selected_count(), 0u);
    EXPECT_EQ(edit.select(SplatSet(6, 1), Combine::replace), 3u) << "hidden ones are not";
    EXPECT_EQ(edit.invert_selection(), 3u);
    EXPECT_EQ(edit.selected_count(), 0u);
    EXPECT_EQ(edit.apply(m).size(), 6u) << "hidden ones are saved";
    EXPECT_FALSE(edit.unsaved()) << "nothing that is saved has changed";
    EXPECT_EQ(edit.show_hidden(), 3u);
    EXPECT_EQ(edit.unseen(), SplatSet(6, 0));
    while (edit.can_undo()) EXPECT_NE(edit.undo(m), "");
    EXPECT_EQ(edit.selected_count() + edit.hidden_count(), 0u);
    EXPECT_EQ(edit.redo(m), "selected 2 splats");
}

std::size_t transform(const Similarity& similarity, Edit& edit, SplatModel& m) {
    edit.begin_transform(m);
    edit.drag_transform(similarity, m);
    return edit.end_transform(m);
}

TEST(Edit, A_move_is_of_the_selection_and_its_undo_exact) {
    SplatModel m = row(5, 3);
    for (size_t i = 0; i < 5; ++i) m.rotation[4 * i] = 1 + static_cast<float>(i);
    m.origin = {10, 0, 0};
    const SplatModel before = m;
    Edit edit(5);
    edit.select(only(5, {1, 3}), Combine::replace);
    const Similarity quarter{2, glm::dmat3(0, 1, 0, -1, 0, 0, 0, 0, 1), {0, 0, 7}};
    EXPECT_EQ(transform(quarter, edit, m), 2u);
    EXPECT_TRUE(edit.unsaved());
    EXPECT_NEAR(position_of(m, 1).y, 22, 1e-5);  // (11, 0, 0), turned and twice as far
    EXPECT_NEAR(position_of(m, 1).z, 7, 1e-5);
    EXPECT_EQ(m.position[0], before.position[0]);
    SplatModel whole = before;  // as the whole scene is turned, harmonics too
    transform_splats(quarter, whole);
    const size_t rest = static_cast<size_t>(m.rest_count());
    for (size_t c = 0; c < rest; ++c) {
        EXPECT_EQ(m.sh_rest[rest * 3 + c], whole.sh_rest[rest * 3 + c]) << c;
        EXPECT_EQ(m.sh_rest[rest * 2 + c], before.sh_rest[rest * 2 + c]) << c;
    }
    const SplatModel after = m;
    EXPECT_EQ(edit.undo(m), "moved 2 splats");
    for (int a = 0; a < kAttributeCount; ++a)
        EXPECT_EQ(attribute_values(m, a), attribute_values(before, a)) << a;
    edit.redo(m);
    for (int a = 0; a < kAttributeCount; ++a)
        EXPECT_EQ(attribute_values(m, a), attribute_values(after, a)) << a;
    edit.undo(m);
    EXPECT_EQ(m.sh_rest, before.sh_rest) << "a second time";
    EXPECT_EQ(m.position, before.position);
}

TEST(Edit, Drags_are_from_the_start_and_one_step) {
    SplatModel m = row(3);
    Edit edit(3);
    edit.begin_transform(m);
    edit.drag_transform({1, glm::dmat3(1.0), {5, 0, 0}}, m);
    edit.drag_transform({1, glm::dmat3(1.0), {1, 0, 0}}, m);
    EXPECT_EQ(m.position[6], 3);
    EXPECT_EQ(edit.end_transform(m), 3u);
    edit.undo(m);
    EXPECT_EQ(m.position[6], 2);
    EXPECT_FALSE(edit.can_undo());
    edit.begin_transform(m);
    EXPECT_EQ(edit.end_transform(m), 0u) << "was not moved";
    edit.begin_transform(m);
    edit.drag_transform({2, glm::dmat3(1.0), {5, 0, 0}}, m);
    edit.cancel_transform(m);
    EXPECT_EQ(m.position[6], 2);
    EXPECT_EQ(m.log_scale[6], 2);
    EXPECT_FALSE(edit.transforms() || edit.can_undo());
}

TEST(Edit, A_merge_appends_in_the_world_and_goes_again) {
    SplatModel m = row(4, 1), other = row(3, 2);
    m.origin = {100, 0, 0};
    other.origin = {0, 0, 50};
    const SplatModel before = m;
    Edit edit(4);
    edit.remove(only(4, {0}));
    edit.select(only(4, {1, 2}), Combine::replace);
    EXPECT_EQ(edit.merge(other, m), 3u);
    ASSERT_EQ(m.size(), 7u);
    EXPECT_EQ(edit.selected(), only(7, {4, 5, 6})) << "what came, and nothing else";
    EXPECT_EQ(edit.selected_count(), 3u);
    EXPECT_EQ(edit.parts(), (std::vector<std::size_t>{4, 3}));
    EXPECT_EQ(m.sh_degree, 2);
    EXPECT_EQ(m.sh_rest.size(), 7u * 24);
    EXPECT_EQ(m.sh_rest[24 * 3 + 8], 3);
    EXPECT_EQ(m.sh_rest[24 * 3 + 9], 0) << "a band that it had not";
    EXPECT_EQ(position_of(m, 6), glm::dvec3(2, 0, 50));
    EXPECT_EQ(edit.select(only(7, {6}), Combine::replace), 2u);
    EXPECT_EQ(edit.apply(m).size(), 6u);
    edit.undo(m);
    EXPECT_EQ(edit.undo(m), "merged 3 splats");
    for (int a = 0; a < kAttributeCount; ++a)
        EXPECT_EQ(attribute_values(m, a), attribute_values(before, a)) << a;
    EXPECT_EQ(edit.removed().size(), 4u);
    EXPECT_EQ(edit.selected(), only(4, {1, 2})) << "as before";
    EXPECT_EQ(edit.selected_count(), 2u);
    EXPECT_EQ(edit.parts(), std::vector<std::size_t>{4});
    edit.redo(m);
    edit.redo(m);
    EXPECT_EQ(edit.selected_count(), 1u);
}

TEST(Bounds, Far_background_does_not_shrink_the_scene) {
    SplatModel m = row(0, 0);
    m.resize(1000);
    for (size_t i = 0; i < 1000; ++i) m.position[3 * i] = static_cast<float>(i) / 1000;
    for (size_t i = 0; i < 10; ++i) m.position[3 * i + 1] = 1e5f;
    const Bounds b = scene_bounds(m);
    EXPECT_NEAR(b.centre.x, 0.5, 0.02);
    EXPECT_NEAR(b.centre.y, 0, 1e-6);
    EXPECT_NEAR(b.radius, 0.5, 0.05);
}

TEST(ViewCamera, Fitted_photo_camera_centres_its_frame) {
    Camera c;
    c.width = 100;
    c.height = 200;
    c.fx = c.fy = 150;
    c.cx = 52;
    c.cy = 98;
    const Camera f = fitted(c, {800, 400});
    EXPECT_DOUBLE_EQ(f.fx, 300);
    EXPECT_DOUBLE_EQ(f.cx, 52 * 2 + 300);
    EXPECT_DOUBLE_EQ(f.cy, 196);
    const Camera same = fitted(c, {100, 200});
    EXPECT_EQ(same.fx, c.fx);
    EXPECT_EQ(same.cx, c.cx);
}

TEST(ViewCamera, Pick_takes_the_nearest_that_is_not_deleted) {
    SplatModel m = row(3, 0);
    for (size_t i = 0; i < 3; ++i) {
        m.position[3 * i] = 0;
        m.position[3 * i + 2] = 5 - static_cast<float>(i);  // the last is the nearest
        m.opacity_logit[i] = 3;
    }
    Camera c;
    c.width = c.height = 100;
    c.fx = c.fy = 100;
    c.cx = c.cy = 50;
    EXPECT_NEAR(pick(m, {}, c, 50, 50)->z, 3, 1e-6);
    EXPECT_NEAR(pick(m, {0, 0, 1}, c, 50, 50)->z, 4, 1e-6);
    EXPECT_FALSE(pick(m, {}, c, 90, 50));
}

}  // namespace
}  // namespace darb
