// SPDX-License-Identifier: MIT
// The viewer without a window: exports, measurements and runs that are shown, and what happens to
// them when the size, the scene or its edits change; edits that are not saved.
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/camera_list.h"
#include "engine/scene/splat_file.h"
#include "tests/support/viewer_fixture.h"
#include "viewer/saved_files.h"
#include "viewer/view_camera.h"

namespace darb::test {
namespace {

class ViewerWork : public ViewerTest {
  protected:
    Session& session() { return viewer_->session(); }
    void frame(const Input& input = {}) { viewer_->frame(input, kWidth, kHeight, true); }
    // The window is asked to.
    bool closes() {
        const auto& asked = session().for_window;
        return std::find(asked.begin(), asked.end(), WindowRequest::close) != asked.end();
    }
    void press(Key key) {
        Input input;
        input.pressed = {key};
        frame(input);
    }
    void drop(const fs::path& file) {
        Input input;
        input.dropped = {file};
        frame(input);
    }
    void finish_load() {
        while (viewer_->loading()) frame();
    }
    // Two key frames, `frames` pictures in all.
    void make_path(int frames) {
        PathState& p = session().path;
        p.path.keys.clear();
        p.path.add(session().navigation);
        p.path.add(session().navigation, 1);
        p.fps = frames - 1;
        p.folder = folder_ / "frames";
        p.export_width = kWidth;
        p.export_height = kHeight;
    }
    bool is_frame(int n) {
        return fs::exists(session().path.folder / fmt::format("frame_{:05d}.png", n));
    }
    void drag(const glm::dvec2& from, const glm::dvec2& to, bool let_go = true);
    void delete_something() {
        session().selection.region = {Region::Shape::sphere, {0, 0, 0}, glm::dvec3(0.8)};
        session().selection.shown = true;
        press(Key::remove);
        ASSERT_TRUE(session().edit.unsaved());
    }
};

// A left drag from one pixel to another; let_go: and the button is released.
void ViewerWork::drag(const glm::dvec2& from, const glm::dvec2& to, bool let_go) {
    Input input;
    input.left = true;
    input.trail = {from};
    input.x = from.x;
    input.y = from.y;
    frame(input);
    input.trail = {to};
    input.x = to.x;
    input.y = to.y;
    input.dx = to.x - from.x;
    input.dy = to.y - from.y;
    frame(input);
    input = {};
    input.x = to.x;
    input.y = to.y;
    if (let_go) frame(input);
}

class FramesUnderWay : public ViewerWork {
  protected:
    // A camera that looks along z, this far from the middle.
    static Camera from(double distance) {
        Camera c;
        c.width = kWidth;
        c.height = kHeight;
        c.fx = c.fy = kWidth;
        c.cx = kWidth / 2.0;
        c.cy = kHeight / 2.0;
        c.translation.z = distance;
        return c;
    }
    // Each as large as what `from(3)` sees: of 24 tiles.
    static SplatModel large_splats(std::size_t count) {
        SplatModel m;
        m.resize(count);
        for (std::size_t i = 0; i < count; ++i) {
            m.position[3 * i + 2] = 0.1f * static_cast<float>(i) / static_cast<float>(count);
            m.sh_dc[3 * i] = static_cast<float>(i % 3) - 1;
            m.rotation[4 * i] = 1;
            for (std::size_t c = 0; c < 3; ++c) m.log_scale[3 * i + c] = 0.5f;
        }
        return m;
    }
    static std::vector<std::uint32_t> pixels(const SplatPicture& picture) {
        return picture.pixels().download<std::uint32_t>(kWidth * kHeight);
    }
    // Pictures in motion while the camera turns, the window has another size for some and a splat
    // is selected in one. wait: for each before the next begins.
    std::vector<std::vector<std::uint32_t>> turn(bool wait);
};

std::vector<std::vector<std::uint32_t>> FramesUnderWay::turn(bool wait) {
    make_viewer(options_);
    load(file_);
    session().panels = true;
    session().gui_scale = 0.3f;  // leaves a part of the picture in sight
    for (int i = 0; i < 3; ++i) shot(false);
    constexpr int kFrames = 16, kWide = 200;
    std::vector<Buffer> copies;
    for (int i = 0; i < kFrames; ++i) {
        const bool wide = i % 8 >= 4;
        const int width = wide ? kWide : kWidth;
        copies.emplace_back(shared_device(), "copy", width * kHeight * 4, Memory::host);
        session().navigation.orbit(0.1, 0.02);
        if (i == 6) {
            Input all;
            all.pressed = {Key::select_all};
            viewer_->frame(all, width, kHeight, false);
        } else {
            viewer_->frame({}, width, kHeight, false);
        }
        viewer_->compose();
        Commands& commands = viewer_->canvas().commands();
        commands.copy(viewer_->canvas().image(), copies.back());
        if (wait)
            commands.submit_and_wait();
        else
            commands.submit();
    }
    viewer_.reset();  // the last two may be under way
    std::vector<std::vector<std::uint32_t>> shown;
    for (const Buffer& copy : copies)
        shown.push_back(copy.download<std::uint32_t>(copy.bytes() / 4));
    return shown;
}

// Two frames share pictures, canvas and panels' memory: none may see the next one's.
TEST_F(FramesUnderWay, Show_what_they_show_one_at_a_time) {
    const auto one_by_one = turn(true), at_once = turn(false);
    ASSERT_EQ(one_by_one.size(), at_once.size());
    for (std::size_t i = 0; i < at_once.size(); ++i) {
        EXPECT_EQ(at_once[i], one_by_one[i]) << "frame " << i;
        if (i > 0) {
            EXPECT_NE(at_once[i], at_once[i - 1]) << "frame " << i;
        }
    }
}

TEST_F(FramesUnderWay, Are_followed_by_their_results_in_order) {
    const SplatModel model = large_splats(20);
    SplatPicture picture(shared_device());
    picture.set_scene(model, {{0, 0, 0}, 2});
    const DisplaySettings display;
    picture.render(from(60), display, {});
    const gpu::FrameStatus far = picture.status();
    picture.render(from(3), display, {});
    const gpu::FrameStatus near = picture.status();
    const auto shown = pixels(picture);
    ASSERT_GT(near.intersections, far.intersections);
    picture.start(1, from(60), display, {});
    picture.start(2, from(3), display, {});
    picture.finish(1);
    picture.finish(2);
    const std::vector<StartedPicture> done = picture.take_done();
    ASSERT_EQ(done.size(), 2u);
    for (const int i : {0, 1}) {
        EXPECT_EQ(done[i].frame, i + 1);
        EXPECT_TRUE(done[i].whole);
        EXPECT_EQ(done[i].status.intersections, (i == 0 ? far : near).intersections);
        EXPECT_EQ(done[i].passes.size(), picture.pass_times().size());
    }
    EXPECT_EQ(pixels(picture), shown);
    EXPECT_TRUE(picture.take_done().empty());
}

// From afar there are few intersections of splats and tiles; near by more than were made room for.
TEST_F(FramesUnderWay, Leave_the_picture_before_where_there_is_no_room) {
    const SplatModel model = large_splats(100);
    SplatPicture picture(shared_device());
    picture.set_scene(model, {{0, 0, 0}, 2});
    const DisplaySettings display;
    picture.render(from(60), display, {});
    const auto far = pixels(picture);
    picture.start(1, from(3), display, {});
    picture.start(2, from(3), display, {});
    picture.finish(2);
    std::vector<StartedPicture> done = picture.take_done();
    ASSERT_EQ(done.size(), 2u);
    ASSERT_FALSE(done[0].whole) << done[0].status.intersections << " intersections";
    EXPECT_FALSE(done[1].whole);
    EXPECT_EQ(pixels(picture), far);
    picture.start(3, from(3), display, {});
    picture.finish(3);
    done = picture.take_done();
    ASSERT_EQ(done.size(), 1u);
    EXPECT_TRUE(done[0].whole);
    const auto near = pixels(picture);
    EXPECT_NE(near, far);
    picture.render(from(3), display, {});
    EXPECT_EQ(near, pixels(picture));
}

// What a window does where a picture in motion had no room: it draws another, and says nothing.
TEST_F(FramesUnderWay, Are_made_up_for_in_the_window) {
    write_ply(file_, large_splats(1000));
    load(file_);
    shot();
    Navigation& n = session().navigation;
    n.look_from({0, 0, 0}, 3);
    const ImageU8 near = shot();
    n.look_from({0, 0, 0}, 60);
    const ImageU8 far = shot(false);
    n.look_from({0, 0, 0}, 3);
    EXPECT_EQ(largest_difference(shot(false), far), 0) << "there is room for so much";
    const ImageU8 again = shot(false);
    EXPECT_GT(largest_difference(again, far), 50);
    EXPECT_EQ(session().times.quality.scale, 0.5) << "it is in motion still";
    ImageU8 shown = again;
    for (int i = 0; i < 1000 && !viewer_->refined(); ++i) shown = shot(false);
    EXPECT_EQ(largest_difference(shown, near), 0);
    EXPECT_TRUE(session().error.empty()) << session().error;
}

TEST_F(ViewerWork, Tools_select_and_move_and_esc_takes_a_drag_back) {
    load(file_);
    Session& s = session();
    s.panels = true;
    const glm::dvec3 eye = s.navigation.eye;
    press(Key::tool_rectangle);
    drag({0, 0}, {kWidth, kHeight});
    EXPECT_GT(s.edit.selected_count(), s.scene->model.size() / 2);
    press(Key::select_others);
    press(Key::tool_lasso);
    drag({0, 0}, {3, 0});
    EXPECT_EQ(s.edit.selected_count(), 0u) << "a line has no inside";
    press(Key::tool_brush);
    s.tools.brush_px = 200;
    drag({40, 30}, {50, 30});
    const std::size_t brushed = s.edit.selected_count();
    EXPECT_GT(brushed, 0u);
    press(Key::tool_move);
    frame();
    const std::optional<Gizmo> gizmo = gizmo_of(s);
    ASSERT_TRUE(gizmo);
    const Camera camera = camera_in_window(s.photos, s.navigation, free_area(s, kWidth, kHeight));
    const std::vector<glm::dvec3> arrow = handle_lines(*gizmo, camera, 1);
    const glm::dvec2 at = *pixel_of(camera, arrow[1]);
    const std::vector<float> before = s.scene->model.position;
    drag(at, at + glm::dvec2(3, 20), false);
    EXPECT_NE(s.scene->model.position, before);
    Input held;
    held.left = true;
    held.pressed = {Key::escape};
    frame(held);
    EXPECT_EQ(s.scene->model.position, before);
    EXPECT_EQ(s.tools.tool, Tool::move);
    drag(at, at + glm::dvec2(3, 20), false);
    EXPECT_EQ(s.scene->model.position, before) << "the button was not let go in between";
    frame();
    drag(at, at + glm::dvec2(3, 20));
    EXPECT_TRUE(s.edit.unsaved());
    EXPECT_EQ(s.edit.selected_count(), brushed);
    press(Key::undo);
    EXPECT_EQ(s.scene->model.position, before);
    press(Key::tool_brush);
    s.panels = false;
    drag({0, 0}, {1, 1});
    EXPECT_EQ(s.edit.selected_count(), brushed) << "what is not shown does nothing";
    EXPECT_NE(s.navigation.eye, eye) << "it orbits";
    press(Key::escape);
    EXPECT_EQ(s.tools.tool, Tool::navigate);
}

TEST_F(ViewerWork, A_scene_is_merged_and_goes_again) {
    load(file_);
    Session& s = session();
    const std::size_t count = s.scene->model.size();
    s.ask(request::Open{file_, true});
    frame();
    finish_load();
    frame();
    EXPECT_EQ(s.scene->model.size(), 2 * count);
    EXPECT_EQ(viewer_->picture().splat_count(), 2 * count);
    EXPECT_NE(s.note.find("merged 60 splats of scene.ply"), std::string::npos) << s.note;
    EXPECT_EQ(s.edit.selected_count(), count);
    press(Key::undo);
    EXPECT_EQ(s.scene->model.size(), count);
    EXPECT_EQ(viewer_->picture().splat_count(), count);
    SplatModel other = scene_.model;
    other.kernel = KERNEL_RAISED_COSINE;
    write_ply(folder_ / "other.ply", other);
    s.ask(request::Open{folder_ / "other.ply", true});
    frame();
    finish_load();
    frame();
    EXPECT_EQ(s.error, "");
    EXPECT_NE(s.note.find("raised_cosine is drawn"), std::string::npos) << s.note;
    EXPECT_EQ(s.scene->model.size(), 2 * count);
    EXPECT_EQ(s.display.kernel, KERNEL_GAUSSIAN);
    s.edit.perform(edits::ShowLayer{"scene", false}, s.scene->model);
    s.ask(request::ShowEdits{});
    frame();
    EXPECT_EQ(s.display.kernel, KERNEL_RAISED_COSINE) << "alone it is drawn as it is";
}

TEST_F(ViewerWork, What_was_merged_is_framed_and_frame_all_shows_both) {
    load(file_);
    Session& s = session();
    SplatModel far_off = scene_.model;
    far_off.origin = {300, 0, 0};
    write_ply(folder_ / "far.ply", far_off);
    s.ask(request::Open{folder_ / "far.ply", true});
    frame();
    finish_load();
    frame();
    frame();
    const Subject own = subject_of(scene_.model);
    EXPECT_LT(glm::distance(s.navigation.pivot(), own.centre + glm::dvec3(300, 0, 0)), 1e-3);
    EXPECT_LT(s.navigation.distance, 20 * own.radius);
    press(Key::frame_all);
    frame();
    EXPECT_NEAR(s.navigation.pivot().x, own.centre.x + 150, 1) << "of both";
    EXPECT_GT(s.scene->subject.radius, 150);
}

TEST_F(ViewerWork, A_page_opens_without_the_panels_offset) {
    load(file_);
    Session& s = session();
    s.panels = true;
    const auto wide_frame = [&](const Input& input) { viewer_->frame(input, 800, 200, true); };
    Input frames_all;
    frames_all.pressed = {Key::frame_all};
    wide_frame({});
    wide_frame(frames_all);
    ASSERT_LT(s.navigation.centre_x, 0.5) << "beside the panel";
    s.save_file = folder_ / "page.ply";
    s.ask(request::SavePage{});
    wide_frame({});
    const std::string page = read_text_file(folder_ / "page.html"), mark = "id=\"scene\">";
    const std::size_t from = page.find(mark) + mark.size();
    const auto json = nlohmann::json::parse(page.substr(from, page.find("</script>", from) - from));
    const auto& camera = json["cameras"][0];
    EXPECT_EQ(camera["cx"].get<double>(), camera["width"].get<double>() / 2);
    EXPECT_NEAR(json["up"][1].get<double>(), s.navigation.up.y, 1e-12) << "not tilted as the view";
    EXPECT_NEAR(camera["pivot"].get<double>(), s.navigation.distance, 0.3 * s.navigation.distance);
}

TEST_F(ViewerWork, What_is_selected_is_highlighted_in_the_window_alone) {
    load(file_);
    const ImageU8 plain = shot();
    press(Key::select_all);
    const ImageU8 orange = shot();
    EXPECT_GT(largest_difference(orange, plain), 50);
    make_path(2);
    frame();
    session().ask(request::ExportPath{});
    frame();
    press(Key::select_none);
    press(Key::undo);
    EXPECT_GE(session().progress.exporting, 0) << "a selection ends no export";
    while (session().progress.exporting >= 0) frame();
    EXPECT_LE(largest_difference(read_image(session().path.folder / "frame_00001.png"), plain), 1);
    frame();
    EXPECT_EQ(largest_difference(shot(), orange), 0);
    const fs::path before = fs::current_path();
    fs::current_path(folder_);
    press(Key::picture);
    fs::current_path(before);
    EXPECT_EQ(largest_difference(read_image(folder_ / "darb_001.png"), plain), 0);
    EXPECT_EQ(largest_difference(shot(), orange), 0);
}

TEST_F(ViewerWork, What_is_said_twice_is_shown_twice) {
    load(file_);
    session().path.path.add(session().navigation);
    session().path.file = folder_ / "path.json";
    const int before = session().told;
    for (const int times : {1, 2}) {
        session().ask(request::SavePath{});
        frame();
        EXPECT_EQ(session().told - before, times);
    }
}

TEST_F(ViewerWork, Without_a_scene_it_says_so) {
    make_path(2);
    for (const int what : {0, 1, 2}) {
        session().ask(what == 0   ? Request(request::ExportPath{})
                      : what == 1 ? Request(request::Measure{})
                                  : Request(request::TakePicture{}));
        session().error.clear();
        frame();
        EXPECT_NE(session().error.find("there is no scene"), std::string::npos) << what;
    }
    EXPECT_THROW(viewer_->export_path_now(), Error);
}

TEST_F(ViewerWork, A_measurement_keeps_the_size_that_it_began_with) {
    load(file_);
    session().ask(request::Measure{});
    frame();
    ASSERT_GE(session().progress.measuring, 0);
    viewer_->frame({}, kWidth / 2, kHeight / 2, true);
    EXPECT_GE(session().progress.measuring, 0);
    EXPECT_TRUE(session().error.empty()) << session().error;
    delete_something();
    EXPECT_LT(session().progress.measuring, 0) << "it goes on, with another scene";
}

TEST_F(ViewerWork, An_export_keeps_its_size_and_display_and_ends_with_its_scene) {
    load(file_);
    make_path(3);
    frame();
    session().ask(request::ExportPath{});
    frame();
    session().path.export_width = 2 * kWidth;
    session().display.style = SplatStyle::points;
    frame();
    EXPECT_EQ(largest_difference(read_image(session().path.folder / "frame_00000.png"),
                                 read_image(session().path.folder / "frame_00001.png")),
              0);
    load(file_);
    frame();
    EXPECT_FALSE(is_frame(2));
    EXPECT_LT(session().progress.exporting, 0);
    EXPECT_NE(session().note.find("2 of 3 frames"), std::string::npos) << session().note;
}

TEST_F(ViewerWork, The_folder_holds_the_frames_of_the_last_export_alone) {
    load(file_);
    make_path(3);
    viewer_->export_path_now();
    ASSERT_TRUE(is_frame(2));
    std::ofstream(session().path.folder / "frame_00002_mine.png") << "another's";
    std::ofstream(session().path.folder / "frame_00003.png") << "another's";
    make_path(2);
    viewer_->export_path_now();
    EXPECT_TRUE(is_frame(1));
    EXPECT_FALSE(is_frame(2));
    EXPECT_TRUE(fs::exists(session().path.folder / "frame_00002_mine.png"));
    EXPECT_TRUE(is_frame(3)) << "not this program's";
    session().path.fps = 0;
    EXPECT_THROW(viewer_->export_path_now(), Error);
}

TEST_F(ViewerWork, A_request_that_fails_leaves_an_export_alone) {
    load(file_);
    make_path(3);
    session().ask(request::ExportPath{});
    session().ask(request::LoadPath{});
    session().path.file = folder_ / "none.json";
    frame();
    EXPECT_NE(session().error.find("none.json"), std::string::npos);
    EXPECT_GE(session().progress.exporting, 0);
}

// The window asks, the run draws when it comes to it; then its scene.
TEST_F(ViewerWork, A_run_is_followed_by_its_pictures_and_the_last_one_stays) {
    const GpuSplats splats(shared_device(), scene_.model, false);
    int woken = 0;
    LivePicture pictures([&] { ++woken; });
    LiveDrawer drawer(shared_device(), options_.views, {{0, 0, 0}, 2});
    EXPECT_FALSE(drawer.draw(splats, LiveChange::at_once, pictures)) << "nobody has asked";
    viewer_->show_live(pictures, {{0, 0, 0}, 2}, live_scene(splats));
    frame();
    EXPECT_TRUE(drawer.draw(splats, LiveChange::none, pictures));
    EXPECT_EQ(woken, 1);
    const ImageU8 shown = shot();
    EXPECT_GT(largest_difference(shown, ImageU8(kWidth, kHeight, 3)), 50);
    drawer.draw(splats, LiveChange::at_once, pictures);
    const ImageU8 first = shot();
    session().ask(request::Measure{});
    frame();
    EXPECT_NE(session().error.find("a run is shown"), std::string::npos) << session().error;
    session().error.clear();
    session().navigation.orbit(0.5, 0.1);
    EXPECT_EQ(largest_difference(shot(), first), 0) << "the run is busy: its last picture stays";
    EXPECT_TRUE(drawer.draw(splats, LiveChange::none, pictures));
    drawer.draw(splats, LiveChange::at_once, pictures);
    const ImageU8 turned = shot();
    EXPECT_GT(largest_difference(turned, first), 20);
    drop(file_);
    EXPECT_FALSE(viewer_->loading()) << "dropped on a run";
    EXPECT_FALSE(session().note.empty());
    viewer_->end_live();
    EXPECT_EQ(largest_difference(shot(), turned), 0) << "at the end the last picture stays";
    session().navigation.orbit(0.3, 0.1);
    const glm::dvec3 eye = session().navigation.eye;
    load(file_);
    frame();
    EXPECT_EQ(session().navigation.eye, eye);
    EXPECT_GT(largest_difference(shot(), turned), 20);
}

// What the scene's pictures need is compiled on another device before.
TEST_F(ViewerWork, At_the_end_of_a_run_its_last_picture_stays_while_another_compiles_slow) {
    const GpuSplats splats(shared_device(), scene_.model, false);
    options_.second_device = DeviceOptions();
    make_viewer(options_);
    LivePicture pictures({});
    LiveDrawer drawer(shared_device(), options_.views, {{0, 0, 0}, 2});
    viewer_->show_live(pictures, {{0, 0, 0}, 2}, live_scene(splats));
    frame();
    drawer.draw(splats, LiveChange::at_once, pictures);
    const ImageU8 last = shot();
    viewer_->end_live();
    session().navigation.orbit(0.5, 0.1);
    load(file_);
    EXPECT_FALSE(viewer_->at_rest());
    for (int frames = 0; frames < 6000 && largest_difference(shot(), last) == 0; ++frames)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_GT(largest_difference(shot(), last), 20);
}

TEST_F(ViewerWork, A_run_shows_photo_and_kernels_beside_its_picture) {
    const GpuSplats splats(shared_device(), scene_.model, false);
    LivePicture pictures({});
    LiveDrawer drawer(shared_device(), options_.views, {{0, 0, 0}, 2});
    viewer_->choose_camera(0);
    viewer_->show_live(pictures, {{0, 0, 0}, 2}, live_scene(splats));
    session().photos.compare = true;
    session().panes.kernels = {KERNEL_RAISED_COSINE};
    for (int i = 0; i < 3; ++i) {
        frame();
        drawer.draw(splats, LiveChange::at_once, pictures);
    }
    frame();
    EXPECT_EQ(session().panes.lines.size(), 2u);
    EXPECT_EQ(session().panes.psnr_db.size(), 2u);
    const ImageU8 all = shot();
    for (int y = 0; y < kHeight; ++y)
        for (int c = 0; c < 3; ++c) ASSERT_EQ(all.at(3, y, c), photo_.at(3, y, c)) << y;
    viewer_->choose_camera(1);  // has no photo
    frame();
    drawer.draw(splats, LiveChange::none, pictures);
    frame();
    EXPECT_NE(session().error.find("no photo"), std::string::npos) << session().error;
    EXPECT_FALSE(session().photos.compare);
}

TEST_F(ViewerWork, Unsaved_edits_are_asked_about_before_another_scene_and_the_end) {
    load(file_);
    delete_something();
    press(Key::quit);
    EXPECT_FALSE(closes());
    ASSERT_TRUE(session().leaving && session().leaving->quit);
    press(Key::escape);
    EXPECT_FALSE(session().leaving);
    drop(file_);
    EXPECT_FALSE(viewer_->loading());
    ASSERT_TRUE(session().leaving);
    session().save_file = folder_ / "edited.nothing";  // cannot be saved: stays
    session().ask(request::SaveAndLeave{});
    frame();
    EXPECT_FALSE(session().leaving || viewer_->loading());
    EXPECT_FALSE(session().error.empty());
    session().save_file = folder_ / "edited.splat";
    drop(file_);
    session().ask(request::SaveAndLeave{});
    frame();
    finish_load();
    EXPECT_TRUE(fs::exists(session().save_file.parent_path() / "edited.splat"));
    EXPECT_EQ(session().edit.removed_count(), 0u) << "the other scene";
    delete_something();
    press(Key::quit);
    session().ask(request::Leave{});
    frame();
    EXPECT_TRUE(closes());
}

TEST_F(ViewerWork, What_is_not_saved_is_recovered_beside_the_scene_over_nothing) {
    load(file_);
    EXPECT_EQ(recover_unsaved(session()), "");
    delete_something();
    const size_t left = session().scene->model.size() - session().edit.removed_count();
    const fs::path first = folder_ / "scene_recovered.ply",
                   second = folder_ / "scene_recovered_2.ply";
    fs::create_symlink(folder_ / "nowhere", first);
    EXPECT_NE(recover_unsaved(session()).find(second.string()), std::string::npos);
    EXPECT_EQ(load_splats(second).size(), left);
    EXPECT_FALSE(fs::exists(folder_ / "nowhere"));
    session().save_file = folder_ / "edited.ply";
    press(Key::save);
    EXPECT_EQ(recover_unsaved(session()), "") << "it is saved";
    make_path(2);
    session().path.file = folder_ / "scene.ply" / "path.json";  // below a file: not there
    const std::string said = recover_unsaved(session());
    EXPECT_NE(said.find("The camera path that was not saved is in ./path_recovered.json"),
              std::string::npos)
        << said;
    EXPECT_EQ(read_camera_path("path_recovered.json").keys, session().path.path.keys);
    fs::remove("path_recovered.json");
    session().path.file = folder_ / "path.json";
    session().ask(request::SavePath{});
    frame();
    EXPECT_EQ(recover_unsaved(session()), "");
}

TEST_F(ViewerWork, A_save_says_what_the_format_loses_and_is_not_asked_about) {
    load(file_);
    delete_something();
    session().save_file = folder_ / "edited.splat";
    press(Key::save);
    const std::vector<std::string> losses =
        losses_of(SplatFormat::dot_splat, session().scene->model);
    ASSERT_FALSE(losses.empty());
    EXPECT_NE(session().note.find(losses[0]), std::string::npos) << session().note;
    press(Key::quit);
    EXPECT_TRUE(closes());
}

TEST_F(ViewerWork, A_dropped_scene_brings_its_own_cameras) {
    const fs::path other = folder_ / "other" / "scene.ply";
    fs::create_directories(other.parent_path());
    write_ply(other, scene_.model);
    options_.find_cameras = [&](const fs::path& scene) -> std::vector<View> {
        if (scene != other) throw Error("cameras.json", "is broken");
        return {options_.views[1], options_.views[1], options_.views[1]};
    };
    make_viewer(options_);
    load(file_);
    viewer_->choose_camera(1);
    EXPECT_EQ(session().photos.views.size(), 2u) << "named with the first scene";
    drop(other);
    finish_load();
    EXPECT_EQ(session().photos.views.size(), 3u);
    EXPECT_EQ(session().photos.current, -1);
    EXPECT_EQ(session().title, "scene.ply - darb");
    drop(file_);
    finish_load();
    EXPECT_TRUE(session().photos.views.empty());
    ASSERT_FALSE(session().scene->notes.empty());
    EXPECT_NE(session().scene->notes.back().find("is broken"), std::string::npos);
    EXPECT_TRUE(session().error.empty()) << session().error;
}

TEST_F(ViewerWork, From_the_free_camera_to_the_first_or_the_last) {
    load(file_);
    press(Key::next_camera);
    EXPECT_EQ(session().photos.current, 0);
    const Navigation& n = session().navigation;
    const glm::dvec3 to_subject = session().scene->subject.centre - n.eye;
    EXPECT_NEAR(n.distance, glm::dot(to_subject, n.forward()), 1e-6) << "orbits pass the subject";
    press(Key::frame_all);
    EXPECT_EQ(session().photos.current, -1);
    press(Key::last_camera);
    EXPECT_EQ(session().photos.current, 1);
}

// The slider of a path leaves the photo's camera, and with it the error to that photo.
TEST_F(ViewerWork, Leaving_the_photo_leaves_its_error_map) {
    load(file_);
    viewer_->choose_camera(0);
    session().display.mode = VIEW_ERROR;
    frame();
    session().ask(request::LeavePhoto{});
    frame();
    EXPECT_EQ(session().display.mode, VIEW_COLOUR);
    EXPECT_EQ(session().photos.current, -1);
}

TEST_F(ViewerWork, A_coarse_picture_is_refined_behind_an_error_message) {
    load(file_);
    frame();
    session().error = "something";
    session().navigation.orbit(0.3, 0);
    viewer_->frame({}, kWidth, kHeight, false);
    EXPECT_LT(session().times.quality.splats, 1);
    double next = 0;
    for (int i = 0; i < 1'000'000 && !(session().times.quality == MotionQuality()); ++i) {
        next = viewer_->frame({}, kWidth, kHeight, false);
        ASSERT_LT(next, 1);  // it asks for the frame that refines
    }
    EXPECT_EQ(session().times.quality, MotionQuality());
}

}  // namespace
}  // namespace darb::test
