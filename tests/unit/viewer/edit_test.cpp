// Selection, deletion, undo; cameras for a window; picking.
#include "viewer/edit.h"

#include <gtest/gtest.h>

#include "viewer/bounds.h"
#include "viewer/view_camera.h"

namespace darb {
namespace {

// Splats at x = 0, 1, ..., n - 1; every value tells its splat.
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
    const SplatModel m = row(10);
    Edit edit(10);
    edit.remove(m, box(-0.5, 1.5), true);
    edit.remove(m, box(0.5, 3.5), true);  // 1 is gone already: 2, 3
    EXPECT_EQ(edit.removed_count(), 4u);
    edit.undo();
    EXPECT_EQ(edit.removed_count(), 2u);
    EXPECT_EQ(edit.removed()[1], 1);  // of the first step, stays deleted
    EXPECT_EQ(edit.removed()[2], 0);
    edit.undo();
    EXPECT_EQ(edit.removed_count(), 0u);
    EXPECT_FALSE(edit.can_undo());
    edit.undo();  // nothing left: no harm
    edit.redo();
    edit.redo();
    EXPECT_EQ(edit.removed_count(), 4u);
    EXPECT_FALSE(edit.can_redo());
}

TEST(Edit, A_new_step_drops_what_was_undone) {
    const SplatModel m = row(10);
    Edit edit(10);
    edit.remove(m, box(-0.5, 1.5), true);
    edit.undo();
    edit.remove(m, box(7.5, 9.5), true);
    EXPECT_FALSE(edit.can_redo());
    EXPECT_EQ(edit.removed()[0], 0);
    EXPECT_EQ(edit.removed()[9], 1);
}

TEST(Edit, Unsaved_until_marked_and_again_after_another_step) {
    const SplatModel m = row(10);
    Edit edit(10);
    EXPECT_FALSE(edit.unsaved());
    edit.remove(m, box(-0.5, 1.5), true);
    EXPECT_TRUE(edit.unsaved());
    edit.mark_saved();
    EXPECT_FALSE(edit.unsaved());
    edit.remove(m, box(7.5, 9.5), true);
    EXPECT_TRUE(edit.unsaved());
    edit.undo();
    EXPECT_FALSE(edit.unsaved());  // as saved
    edit.undo();
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
    EXPECT_EQ(count_inside(m, sphere, edit), 3u);
    EXPECT_EQ(edit.remove(m, sphere, true), 3u);
    EXPECT_EQ(count_inside(m, sphere, edit), 0u);
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
    const Camera f = fitted(c, 800, 400);
    EXPECT_DOUBLE_EQ(f.fx, 300);
    EXPECT_DOUBLE_EQ(f.cx, 52 * 2 + 300);
    EXPECT_DOUBLE_EQ(f.cy, 196);
    const Camera same = fitted(c, 100, 200);
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
