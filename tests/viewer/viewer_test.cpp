// SPDX-License-Identifier: MIT
// The viewer without a window: loading, editing, comparison, paths.
#include "viewer/viewer.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <cstdlib>
#include <fstream>

#include "engine/core/error.h"
#include "tests/support/test_data.h"
#include "tests/support/viewer_fixture.h"

namespace darb::test {
namespace {

TEST_F(ViewerTest, Screenshot_at_a_camera_is_what_the_renderer_gives) {
    load(file_);
    viewer_->choose_camera(0);
    // One level: rounding of halves differs between the shader and the host.
    EXPECT_LE(largest_difference(shot(), rendered(scene_.model, scene_.camera)), 1);
}

TEST_F(ViewerTest, Panels_cover_a_part_of_the_picture) {
    load(file_);
    const ImageU8 without = shot();
    viewer_->session().panels = true;
    viewer_->draw_whole(kWidth, kHeight);
    EXPECT_GT(largest_difference(shot(), without), 50);
}

TEST_F(ViewerTest, Corrupt_dropped_file_says_why_and_keeps_the_scene) {
    load(file_);
    const ImageU8 before = shot();
    const fs::path bad = folder_ / "bad.ply";
    std::ofstream(bad) << "ply\nformat binary_little_endian 1.0\nelement vertex 5\nend_header\n";
    Input input;
    input.dropped = {bad};
    shot(true, input);
    while (viewer_->loading()) shot();
    EXPECT_NE(viewer_->session().error.find("bad.ply"), std::string::npos)
        << viewer_->session().error;
    EXPECT_EQ(viewer_->session().scene->file, file_);
    EXPECT_GT(largest_difference(shot(), before), 50);  // the message
    input = {};
    input.pressed = {Key::escape};
    EXPECT_EQ(largest_difference(shot(true, input), before), 0);
}

TEST_F(ViewerTest, Missing_file_without_a_window_is_an_error) {
    viewer_->open(folder_ / "none.ply");
    EXPECT_THROW(viewer_->finish_loading(), Error);
}

TEST_F(ViewerTest, Cancelled_load_keeps_the_scene) {
    load(file_);
    viewer_->open(file_);
    viewer_->session().ask(request::CancelLoad{});
    shot();
    EXPECT_FALSE(viewer_->loading());
    EXPECT_TRUE(viewer_->session().scene);
    EXPECT_TRUE(viewer_->session().error.empty());
}

TEST_F(ViewerTest, Point_cloud_opens_as_points) {
    const fs::path cloud = folder_ / "cloud.ply";
    std::ofstream out(cloud);
    out << "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
           "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
           "end_header\n";
    for (int i = 0; i < 8; ++i)
        out << (i & 1) << ' ' << (i >> 1 & 1) << ' ' << (i >> 2) << " 255 0 0\n";
    out.close();
    load(cloud);
    EXPECT_TRUE(viewer_->session().scene->is_points);
    EXPECT_EQ(viewer_->session().scene->model.size(), 8u);
    const ImageU8 image = shot();
    int reddest = 0;
    for (size_t p = 0; p < image.data.size(); p += 3)
        reddest = std::max(reddest, image.data[p] - image.data[p + 1]);
    EXPECT_GT(reddest, 200);
}

TEST_F(ViewerTest, A_sog_scene_opens_by_the_name_of_its_meta_json) {
    const auto data = test_data_folder();
    if (!data) GTEST_SKIP() << "no test data";
    const fs::path folder = *data / "splats" / "playbot_sog";
    if (!fs::exists(folder)) GTEST_SKIP() << "no " << folder;
    const Scene scene = load_scene_file(folder / "meta.json");
    EXPECT_GT(scene.model.size(), 0u);
    EXPECT_EQ(scene.format, load_scene_file(folder).format);
}

TEST_F(ViewerTest, A_hundred_scenes_opened_and_closed_leave_no_memory_behind) {
    std::uint64_t device_bytes = 0;
    size_t heap_bytes = 0;
    for (int cycle = 0; cycle < 100; ++cycle) {
        load(file_);
        shot();
        if (cycle != 9) continue;
        device_bytes = shared_device().allocated_bytes();
        heap_bytes = ::mallinfo2().uordblks;
    }
    EXPECT_EQ(shared_device().allocated_bytes(), device_bytes);
    // The scene alone is 60 splats of 236 bytes; a leak of it would be 1.2 MB.
    EXPECT_LT(::mallinfo2().uordblks, heap_bytes + 300'000);
}

TEST_F(ViewerTest, Delete_undo_and_save) {
    load(file_);
    Session& s = viewer_->session();
    const ImageU8 before = shot();
    s.selection.region = {Region::Shape::sphere, {0, 0, 0}, glm::dvec3(0.8)};
    s.selection.shown = true;
    Input input;
    input.pressed = {Key::remove};
    const ImageU8 after = shot(true, input);
    EXPECT_GT(s.edit.removed_count(), 0u);
    EXPECT_GT(largest_difference(after, before), 20);
    s.save_file = folder_ / "edited.ply";
    s.ask(request::Save{});
    shot();
    const SplatModel saved = read_ply(s.save_file);
    EXPECT_EQ(saved.size(), scene_.model.size() - s.edit.removed_count());
    input.pressed = {Key::undo};
    EXPECT_EQ(largest_difference(shot(true, input), before), 0);
    load(s.save_file);
    viewer_->choose_camera(1);
    EXPECT_LE(largest_difference(shot(), rendered(saved, scene_.camera)), 1);
}

TEST_F(ViewerTest, Camera_without_photo_says_so) {
    load(file_);
    viewer_->choose_camera(1);
    viewer_->session().photos.compare = true;
    shot();
    EXPECT_NE(viewer_->session().error.find("no photo"), std::string::npos);
    EXPECT_THROW(viewer_->choose_camera(2), Error);
}

TEST_F(ViewerTest, Load_reports_progress_and_is_cancelled_while_it_decodes) {
    SceneOptions options;
    options.count = 200'000;
    options.sh_degree = 0;
    write_ply(file_, random_scene(options).model);
    std::vector<double> shares;
    load_scene_file(file_, [&](double share, const char*) { shares.push_back(share); });
    EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
    EXPECT_GE(
        std::count_if(shares.begin(), shares.end(), [](double s) { return s > 0.41 && s < 0.94; }),
        2);
    struct Stop {};
    EXPECT_THROW(load_scene_file(file_,
                                 [](double share, const char*) {
                                     if (share > 0.41) throw Stop();
                                 }),
                 Stop);
}

TEST_F(ViewerTest, Picture_key_writes_the_scene_without_the_panels) {
    load(file_);
    const ImageU8 scene = shot();
    viewer_->session().panels = true;
    const fs::path before = fs::current_path();
    fs::current_path(folder_);
    Input input;
    input.pressed = {Key::picture};
    shot(true, input);
    fs::current_path(before);
    EXPECT_EQ(largest_difference(read_image(folder_ / "darb_001.png"), scene), 0);
}

TEST_F(ViewerTest, The_scene_is_shown_again_after_an_export) {
    load(file_);
    const ImageU8 before = shot();
    Session& s = viewer_->session();
    s.path.path.add(s.navigation);
    s.path.path.keys[0].eye.x += 1;
    s.path.folder = folder_ / "frames";
    s.path.export_width = 2 * kWidth;
    s.path.export_height = kHeight / 2;
    s.ask(request::ExportPath{});
    EXPECT_GT(largest_difference(shot(false), before), 20);  // the frame that is exported
    while (s.progress.exporting >= 0) viewer_->frame({}, kWidth, kHeight, false);
    EXPECT_EQ(largest_difference(shot(false), before), 0);
}

TEST_F(ViewerTest, Path_export_writes_a_frame_for_each_time_step) {
    load(file_);
    shot();
    Session& s = viewer_->session();
    s.path.path.add(s.navigation);
    s.navigation.orbit(0.5, 0);
    s.path.path.add(s.navigation, 0.5);
    s.path.folder = folder_ / "frames";
    s.path.fps = 4;
    s.path.export_width = kWidth;
    s.path.export_height = kHeight;
    viewer_->export_path_now();
    EXPECT_TRUE(fs::exists(s.path.folder / "frame_00000.png"));
    EXPECT_TRUE(fs::exists(s.path.folder / "frame_00002.png"));
    EXPECT_FALSE(fs::exists(s.path.folder / "frame_00003.png"));
    const ImageU8 last = read_image(s.path.folder / "frame_00002.png");
    EXPECT_EQ(largest_difference(last, shot()), 0);  // the camera is at the last key
    const bool has_ffmpeg = std::system("command -v ffmpeg > /dev/null") == 0;
    const fs::path video = s.path.folder / "video.mp4";
    EXPECT_EQ(fs::exists(video) && fs::file_size(video) > 0, has_ffmpeg) << s.note;

    s.path.folder = folder_ / "no_ffmpeg";
    const std::string programs = std::getenv("PATH");
    ::setenv("PATH", folder_.c_str(), 1);
    viewer_->export_path_now();
    ::setenv("PATH", programs.c_str(), 1);
    EXPECT_TRUE(fs::exists(s.path.folder / "frame_00002.png"));
    EXPECT_NE(s.note.find("no video, ffmpeg is not installed"), std::string::npos) << s.note;
}

}  // namespace
}  // namespace darb::test
