// SPDX-License-Identifier: MIT
// Layers, projects, scripts and notes in the viewer, without a window: the picture is that of one
// model of all visible layers, and what is saved opens to the same bits.
#include <gtest/gtest.h>

#include <fstream>

#include "engine/core/files.h"
#include "engine/scene/edit_script.h"
#include "engine/scene/project_file.h"
#include "engine/scene/splat_file.h"
#include "tests/support/viewer_fixture.h"

namespace darb::test {
namespace {

class LayersViewTest : public ViewerTest {
  protected:
    void SetUp() override {
        ViewerTest::SetUp();
        SceneOptions options;
        options.count = 40;
        options.seed = 7;
        options.width = kWidth;
        options.height = kHeight;
        other_ = random_scene(options).model;
        other_file_ = folder_ / "other.ply";
        write_ply(other_file_, other_);
    }
    Session& session() { return viewer_->session(); }
    void perform(const EditOperation& operation) {
        perform_edit(operation, session());
        EXPECT_EQ(session().error, "");
        shot();
    }
    void ask(const Request& request) {
        session().ask(request);
        shot();
        EXPECT_EQ(session().error, "");
    }
    void drop(const fs::path& file, bool shift) {
        Input input;
        input.dropped = {file};
        input.shift = shift;
        shot(true, input);
        for (int frame = 0; frame < 1000 && (frame < 3 || viewer_->loading()); ++frame) shot();
    }
    // Both scenes, the second one moved.
    void open_both() {
        load(file_);
        viewer_->choose_camera(0);
        drop(other_file_, true);
        ASSERT_EQ(session().edit.layers().size(), 2u);
        perform(edits::Transform{{1.25, turn_of_degrees({10, 20, 30}), {0.2, 0.1, 0}}, "other"});
        perform(edits::Select{by::Nothing{}});
    }
    SplatModel other_;
    fs::path other_file_;
};

TEST_F(LayersViewTest, All_visible_layers_are_one_picture_in_one_order_of_depth) {
    open_both();
    const Session& s = session();
    EXPECT_EQ(s.edit.layers()[1].name, "other");
    const SplatModel both = s.edit.apply(s.scene->model);
    EXPECT_EQ(both.size(), 100u);
    viewer_->choose_camera(0);
    EXPECT_LE(largest_difference(shot(), rendered(both, scene_.camera)), 1);
    perform(edits::ShowLayer{"scene", false});
    viewer_->choose_camera(0);
    EXPECT_LE(largest_difference(shot(), rendered(s.edit.apply(s.scene->model), scene_.camera)), 1);
    perform(edits::ShowLayer{"other", false});
    perform(edits::ShowLayer{"scene", true});
    viewer_->choose_camera(0);
    EXPECT_LE(largest_difference(shot(), rendered(scene_.model, scene_.camera)), 1);
}

TEST_F(LayersViewTest, Layers_of_different_kernels_are_drawn_as_their_gaussians) {
    SplatModel cosine = other_;
    cosine.kernel = KERNEL_RAISED_COSINE;
    write_ply(other_file_, cosine);
    open_both();
    const Session& s = session();
    EXPECT_TRUE(s.edit.mixes_kernels());
    EXPECT_NE(s.edit.losses_together()[0].find("raised_cosine"), std::string::npos);
    viewer_->choose_camera(0);
    EXPECT_LE(largest_difference(shot(), rendered(s.edit.apply(s.scene->model), scene_.camera)), 1);
    perform(edits::ShowLayer{"scene", false});
    viewer_->choose_camera(0);
    const SplatModel alone = s.edit.apply(s.scene->model);
    EXPECT_EQ(alone.kernel, KERNEL_RAISED_COSINE);
    EXPECT_LE(largest_difference(shot(), rendered(alone, scene_.camera)), 1);
}

TEST_F(LayersViewTest, A_drop_replaces_and_adds_only_with_shift_or_on_the_list) {
    load(file_);
    drop(other_file_, false);
    EXPECT_EQ(session().scene->model.size(), 40u);
    EXPECT_EQ(session().edit.layers().size(), 1u);
    drop(file_, true);
    EXPECT_EQ(session().edit.layers().size(), 2u);
    session().panels = true;
    for (int i = 0; i < 3; ++i) viewer_->frame({}, 800, 600, true);
    Input input;
    input.dropped = {file_};
    const OutlinerState& list = session().outliner;
    ASSERT_TRUE(list.shown);
    input.x = (list.low.x + list.high.x) / 2;
    input.y = (list.low.y + list.high.y) / 2;
    viewer_->frame(input, 800, 600, true);
    for (int i = 0; i < 1000 && (i < 3 || viewer_->loading()); ++i)
        viewer_->frame({}, 800, 600, true);
    EXPECT_EQ(session().edit.layers().size(), 3u);
}

TEST_F(LayersViewTest, A_note_has_a_label_in_the_picture) {
    load(file_);
    Session& s = session();
    s.panels = true;
    for (int i = 0; i < 3; ++i) viewer_->frame({}, 800, 600, true);
    const auto window = [&] {
        viewer_->frame({}, 800, 600, true);
        viewer_->compose();
        viewer_->canvas().submit_and_wait();
        return viewer_->canvas().read_back();
    };
    const ImageU8 before = window();
    SceneNote note;
    note.at = s.navigation.pivot();
    note.title = "here";
    set_note(-1, note, s);
    window();
    const ImageU8 after = window();
    ASSERT_EQ(before.data.size(), after.data.size());
    int changed = 0;  // px of the picture itself, left of the properties
    for (int y = 100; y < 500; ++y)
        for (int x = 80; x < 400; ++x) changed += before.at(x, y, 0) != after.at(x, y, 0) ? 1 : 0;
    EXPECT_GT(changed, 100);
}

TEST_F(LayersViewTest, A_project_opens_as_it_was_saved_with_its_history) {
    open_both();
    perform(edits::Remove{Region{Region::Shape::sphere, {0, 0, 0}, glm::dvec3(0.6)}, false});
    perform(edits::ShowLayer{"scene", false});
    Session& s = session();
    s.path.path.add(s.navigation);
    add_measured_point({0.1, 0.2, 0.3}, -1, s);
    SceneNote note;
    note.at = {0.1, 0.2, 0.3};
    note.title = "here";
    note.text = "a word";
    set_note(-1, note, s);
    EXPECT_TRUE(s.edit.unsaved());
    const Navigation view = s.navigation;
    Input save;
    save.pressed = {Key::save};
    shot(true, save);
    EXPECT_EQ(s.error, "");
    EXPECT_FALSE(unsaved_edits(s));
    const fs::path file = folder_ / "scene.darb.json";
    ASSERT_TRUE(fs::exists(file)) << s.note;
    const SplatModel before = s.scene->model;
    const SplatSet removed = s.edit.removed();
    const std::vector<SceneLayer> layers = s.edit.layers();
    const SceneFacts facts = s.edit.facts();

    make_viewer(options_);
    load(file);
    Session& again = session();
    EXPECT_EQ(again.scene->model.position, before.position);
    EXPECT_EQ(again.scene->model.sh_rest, before.sh_rest);
    EXPECT_EQ(again.edit.removed(), removed);
    EXPECT_EQ(again.edit.layers(), layers);
    EXPECT_EQ(again.edit.facts().notes, facts.notes);
    EXPECT_EQ(again.edit.facts().measured, facts.measured);
    EXPECT_EQ(again.path.path.keys.size(), 1u);
    EXPECT_FALSE(unsaved_edits(again));
    EXPECT_LT(glm::distance(again.navigation.eye, view.eye), 1e-9);
    EXPECT_LT(glm::distance(again.navigation.forward(), view.forward()), 1e-9);
    shot();
    while (again.edit.can_undo()) undo_edit(again);
    shot();
    EXPECT_EQ(again.scene->model.size(), scene_.model.size());
    EXPECT_EQ(again.scene->model.position, scene_.model.position);
}

// What the window saves is what the command makes of its script.
TEST_F(LayersViewTest, A_script_of_the_window_gives_the_file_of_the_window) {
    load(file_);
    Session& s = session();
    Input press;
    press.pressed = {Key::tool_lasso};
    s.panels = true;
    viewer_->choose_camera(0);
    shot(true, press);
    Input stroke;
    stroke.left = true;
    stroke.trail = {{20, 10}, {80, 12}, {60, 55}};
    stroke.x = 60;
    stroke.y = 55;
    shot(true, stroke);
    Input up;
    up.x = 60;
    up.y = 55;
    shot(true, up);
    ASSERT_GT(s.edit.selected_count(), 0u);
    s.panels = false;
    s.edit.begin_transform(s.scene->model);
    s.edit.drag_transform({1.3, turn_of_degrees({3, 2, 1}), {0, 0.1, 0}}, s.scene->model);
    s.edit.end_transform(s.scene->model);
    perform(edits::Duplicate{});
    drop(other_file_, true);
    perform(edits::Select{by::Opacity{0, 0.4}});
    press.pressed = {Key::remove};
    shot(true, press);
    s.save_file = folder_ / "result.ply";
    ask(request::SaveScene{});
    ask(request::SaveScript{});
    const fs::path script = folder_ / "result.edits.json";
    ASSERT_TRUE(fs::exists(script)) << s.note;

    EditedScene scene;
    scene.model = load_splats(file_);
    scene.edit = Edit(scene.model, "scene", file_);
    for (const EditOperation& one : read_edit_script(script))
        scene.edit.perform(one, scene.model,
                           [](const fs::path& file) { return load_splats(file); });
    save_splats(folder_ / "replayed.ply", SplatFormat::ply, scene.saved());
    EXPECT_EQ(read_file(folder_ / "replayed.ply"), read_file(folder_ / "result.ply"));
}

TEST_F(LayersViewTest, One_layer_is_saved_alone_and_ctrl_s_saves_one_scene_as_before) {
    load(file_);
    perform(edits::Remove{by::Opacity{0, 0.4}, false});
    Input save;
    save.pressed = {Key::save};
    shot(true, save);
    EXPECT_TRUE(fs::exists(folder_ / "scene_edited.ply"));
    EXPECT_FALSE(fs::exists(folder_ / "scene.darb.json"));
    drop(other_file_, true);
    ask(request::SaveScene{"other"});
    const SplatModel alone = load_splats(folder_ / "scene_edited_other.ply");
    EXPECT_EQ(alone.position, other_.position);
    EXPECT_EQ(alone.size(), 40u);
}

TEST(LayerPose, Numbers_of_a_pose_give_the_move_back) {
    for (const glm::dvec3& turn : {glm::dvec3(10, 20, 30), glm::dvec3(-170, 80, 5),
                                   glm::dvec3(40, 90, 0), glm::dvec3(0, -90, 0)}) {
        const Similarity moved{1.5, turn_of_degrees(turn), {1, 2, 3}};
        const Similarity again = moved_by(pose_of(moved));
        for (int column = 0; column < 3; ++column)
            EXPECT_LT(glm::distance(again.turn[column], moved.turn[column]), 1e-6) << turn.y;
        EXPECT_EQ(again.scale, moved.scale);
        EXPECT_EQ(again.translation, moved.translation);
    }
}

}  // namespace
}  // namespace darb::test
