// SPDX-License-Identifier: MIT
// The viewer in a real window under Xvfb, driven by mouse, keys and drops; what the display shows
// is compared with a headless screenshot.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "engine/data/image_io.h"
#include "engine/scene/ply.h"
#include "engine/scene/splat_file.h"
#include "tests/support/test_data.h"
#include "tests/support/test_scene.h"
#include "tests/support/window_fixture.h"
#include "tests/support/x_drop.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 640, kHeight = 480;

class WindowTest : public DisplayTest {
  protected:
    void SetUp() override {
        DisplayTest::SetUp();
        if (IsSkipped()) return;
        write_scene(300);
    }
    void write_scene(std::uint32_t splats) {
        SceneOptions options;
        options.count = splats;
        model_ = random_scene(options).model;
        write_ply(folder_ / "scene.ply", model_);
    }
    Words command(const fs::path& scene, const Words& more) const {
        Words words{DARB_COMMAND, "view", scene.string()};
        words.insert(words.end(), more.begin(), more.end());
        return words;
    }
    ImageU8 headless(const fs::path& scene, const Words& more = {}, int width = kWidth,
                     int height = kHeight) {
        const fs::path file = folder_ / "headless.png";
        Words words = command(scene, {"--no-panels", "--screenshot", file.string(), "--size",
                                      std::to_string(width) + "x" + std::to_string(height)});
        words.insert(words.end(), more.begin(), more.end());
        Process run(words, folder_ / "headless.log");
        EXPECT_EQ(run.wait(), 0) << log("headless.log");
        return read_image(file);
    }
    ImageU8 headless() { return headless(folder_ / "scene.ply"); }
    void start(const Words& more = {"--no-panels"}, const std::string& size = "640x480") {
        Words words = command(folder_ / "scene.ply", {"--size", size});
        words.insert(words.end(), more.begin(), more.end());
        program_.emplace(words, folder_ / "view.log");
        ASSERT_TRUE(eventually([&] { return log("view.log").find("loaded") != std::string::npos; }))
            << log("view.log");
    }
    ImageU8 window() const { return screen(kWidth, kHeight); }

    SplatModel model_;
};

TEST_F(WindowTest, Window_shows_the_headless_screenshot_and_closes_with_0_slow) {
    const ImageU8 wanted = headless();
    start();
    EXPECT_TRUE(shows(wanted)) << "differs by " << largest_difference(window(), wanted) << "\n"
                               << log("view.log");
    xdo({"key", "ctrl+q"});
    ASSERT_TRUE(eventually([&] { return !program_->running(); }));
    EXPECT_EQ(program_->wait(), 0) << log("view.log");
}

TEST_F(WindowTest, Accuracy_and_effects_of_the_command_line_show_in_the_screenshot) {
    const fs::path scene = folder_ / "scene.ply";
    const ImageU8 less = headless(scene, {"--accuracy", "fast", "--effects", "none"});
    EXPECT_GT(largest_difference(less, headless()), 3);
    Process wrong(command(scene, {"--effects", "fog"}), folder_ / "wrong.log");
    EXPECT_EQ(wrong.wait(), 2);
    EXPECT_NE(log("wrong.log").find("'fog' is no effect"), std::string::npos) << log("wrong.log");
}

TEST_F(WindowTest, A_screenshot_is_what_its_name_says) {
    const Words size = {"--size", "64x48", "--screenshot"};
    const auto shot = [&](const std::string& name, const Words& more = {}) {
        Words words = command(folder_ / "scene.ply", size);
        words.push_back((folder_ / name).string());
        words.insert(words.end(), more.begin(), more.end());
        Process run(words, folder_ / "shot.log");
        return run.wait();
    };
    const std::vector<std::pair<std::string, std::string>> heads = {
        {"a.png", "\x89PNG"}, {"a.JPG", "\xFF\xD8\xFF"}, {"a.jpeg", "\xFF\xD8\xFF"}};
    for (const auto& [name, head] : heads) {
        ASSERT_EQ(shot(name), 0) << log("shot.log");
        EXPECT_TRUE(read_text_file(folder_ / name).starts_with(head)) << name;
    }
    EXPECT_EQ(shot("a.webp"), 2);
    EXPECT_FALSE(fs::exists(folder_ / "a.webp"));
    EXPECT_EQ(shot("b.png", {"--compare"}), 2);
    EXPECT_NE(log("shot.log").find("--compare: needs a photo"), std::string::npos)
        << log("shot.log");
}

// A window opened, empty, and the command waited for it to be closed.
TEST_F(WindowTest, A_scene_that_is_not_there_is_an_error_without_a_window) {
    const fs::path missing = folder_ / "none.ply";
    program_.emplace(command(missing, {}), folder_ / "missing.log");
    ASSERT_TRUE(eventually([&] { return !program_->running(); }));
    EXPECT_EQ(program_->wait(), 2);
    EXPECT_NE(log("missing.log").find("none.ply: does not exist\n  Name a splat file"),
              std::string::npos)
        << log("missing.log");
}

// Closing waited for whoever would write to the pipe.
TEST_F(WindowTest, A_dropped_pipe_is_refused_and_the_window_closes_slow) {
    const fs::path pipe = folder_ / "pipe.ply";
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    start();
    const ImageU8 before = headless();
    ASSERT_TRUE(shows(before));
    ASSERT_TRUE(drop_on_window("darb", pipe));
    EXPECT_TRUE(changes_from(before, 100)) << "no message";
    xdo({"key", "Escape"});
    EXPECT_TRUE(shows(before)) << "the scene before is gone";
    xdo({"key", "ctrl+q"});
    ASSERT_TRUE(eventually([&] { return !program_->running(); }));
    EXPECT_EQ(program_->wait(), 0) << log("view.log");
}

// Edited by the keys of a user: a path of one key, which nobody saved.
TEST_F(WindowTest, What_was_not_saved_is_kept_when_the_display_ends_or_a_signal_comes_slow) {
    const fs::path kept = "camera_path_recovered.json";
    const ImageU8 wanted = headless();
    for (const bool display_ends : {false, true}) {
        SCOPED_TRACE(display_ends);
        fs::remove(folder_ / kept);
        fs::remove(folder_ / "view.log");
        ::setenv("DARB_TEST_FOLDER", folder_.c_str(), 1);
        program_.emplace(Words{"sh", "-c",
                               "cd \"$DARB_TEST_FOLDER\" && exec \"$0\" view scene.ply --no-panels "
                               "--size 640x480",
                               DARB_COMMAND},
                         folder_ / "view.log");
        ASSERT_TRUE(eventually([&] { return log("view.log").find("loaded") != std::string::npos; }))
            << log("view.log");
        ASSERT_TRUE(shows(wanted)) << log("view.log");
        xdo({"mousemove", "300", "200", "key", "k"});
        settled();
        std::this_thread::sleep_for(std::chrono::seconds(1));  // the key shows nothing to wait for
        ASSERT_TRUE(program_->running()) << log("view.log");
        if (display_ends)
            display_->terminate();
        else
            program_->terminate();
        EXPECT_TRUE(eventually([&] { return !program_->running(); }));
        EXPECT_EQ(program_->wait(), display_ends ? 2 : 128 + SIGTERM) << log("view.log");
        EXPECT_NE(log("view.log")
                      .find(display_ends ? "error: window: the display is gone"
                                         : "interrupted by SIGTERM"),
                  std::string::npos)
            << log("view.log");
        EXPECT_NE(log("view.log").find("The camera path that was not saved is in " + kept.string()),
                  std::string::npos)
            << log("view.log");
        EXPECT_TRUE(fs::exists(folder_ / kept));
    }
}

// Frames are under way then, and other libraries have the connection.
TEST_F(WindowTest, A_display_that_ends_while_a_window_draws_is_an_error_slow) {
    start();
    display_->terminate();
    ASSERT_TRUE(eventually([&] { return !program_->running(); }));
    EXPECT_EQ(program_->wait(), 2) << log("view.log");
    EXPECT_NE(log("view.log").find("error: window: the display is gone"), std::string::npos)
        << log("view.log");
}

TEST_F(WindowTest, Mouse_and_keys_move_the_camera_slow) {
    const ImageU8 wanted = headless();
    start();
    ASSERT_TRUE(shows(wanted));
    xdo({"mousemove", "300", "200", "mousedown", "1", "mousemove", "360", "220", "mouseup", "1"});
    EXPECT_TRUE(changes_from(wanted, 20)) << "orbit";
    const ImageU8 orbited = settled();
    xdo({"key", "k", "mousedown", "2", "mousemove", "310", "200", "mouseup", "2"});
    EXPECT_TRUE(changes_from(orbited, 20)) << "pan";
    const ImageU8 turned = settled();
    xdo({"key", "k", "key", "space"});
    EXPECT_TRUE(changes_from(turned, 20)) << "path";
    EXPECT_TRUE(shows(turned)) << "the end of the path";
    xdo({"keydown", "w", "sleep", "0.3", "keyup", "w"});
    EXPECT_TRUE(changes_from(turned, 20)) << "fly";
    const ImageU8 flown = settled();
    xdo({"click", "4"});
    EXPECT_TRUE(changes_from(flown, 5)) << "wheel";
    const ImageU8 zoomed = settled();
    xdo({"key", "h"});
    EXPECT_TRUE(changes_from(zoomed, 50)) << "panels";
}

TEST_F(WindowTest, Resize_storm_ends_with_the_right_picture_slow) {
    const ImageU8 wanted = headless();
    start();
    ASSERT_TRUE(shows(wanted));
    Words storm{"search", "--name", "darb"};
    for (int i = 0; i < 40; ++i)
        for (const int value : {-1, 100 + i * 389 % 600, 80 + i * 277 % 500})
            storm.push_back(value < 0 ? "windowsize" : std::to_string(value));
    xdo(storm);
    xdo({"search", "--name", "darb", "windowsize", std::to_string(kWidth),
         std::to_string(kHeight)});
    // The camera's field of view is vertical, so the same size gives the same picture again.
    EXPECT_TRUE(shows(wanted)) << "differs by " << largest_difference(window(), wanted);
    EXPECT_TRUE(program_->running()) << log("view.log");
}

TEST_F(WindowTest, Full_screen_and_back_slow) {
    const ImageU8 wanted = headless();
    const ImageU8 whole = headless(folder_ / "scene.ply", {}, kDisplayWidth, kDisplayHeight);
    start();
    ASSERT_TRUE(shows(wanted));
    xdo({"key", "F11"});
    EXPECT_TRUE(shows(whole)) << "differs by " << largest_difference(screen(), whole);
    xdo({"key", "Escape"});
    EXPECT_TRUE(shows(wanted)) << "differs by " << largest_difference(window(), wanted);
}

// At twice the dots per inch the properties, 350 px wide at 96, cover x = 400.
TEST_F(WindowTest, Panels_grow_with_the_dots_per_inch_slow) {
    const ImageU8 bare = headless(folder_ / "scene.ply", {"-w"}, kDisplayWidth, kDisplayHeight);
    set_display_dpi(192);
    start({"-w"}, "800x600");
    EXPECT_TRUE(eventually([&] {
        const ImageU8 now = screen();
        return now.at(100, 590, 0) > 120 && now.at(400, 590, 0) < 100;
    })) << log("view.log");
    EXPECT_GT(bare.at(400, 590, 0), 120);
}

// What a hand does first: a menu, a tool of the toolbar, an axis in the corner, the grid.
TEST_F(WindowTest, Menus_toolbar_axes_and_grid_are_clicked_slow) {
    start({}, "800x600");
    const auto changes = [&](const Words& hand, const char* what) {
        const ImageU8 before = settled();
        xdo(hand);
        EXPECT_TRUE(changes_from(before, 20)) << what;
    };
    const Words away{"mousemove", "250", "500"};
    ASSERT_TRUE(eventually([&] { return settled().at(600, 300, 0) < 100; })) << "no properties";
    changes({"mousemove", "147", "11", "click", "1"}, "the menu View");
    changes({"key", "Escape"}, "it closes");
    changes({"mousemove", "22", "87", "click", "1"}, "the rectangle of the toolbar");
    xdo(away);
    changes({"key", "1"}, "orbiting again");
    changes({"key", "g"}, "the grid");
    changes({"mousemove", "428", "85", "click", "1"}, "the axis x");
}

// Each format in turn dropped on one running viewer; between them a file that is none.
TEST_F(WindowTest, Dropped_files_of_every_format_are_shown_long) {
    std::vector<fs::path> files;
    for (const char* name : {"a.compressed.ply", "a.spz", "a.splat"}) {
        files.push_back(folder_ / name);
        save_splats(files.back(), *format_to_write(files.back()), model_);
    }
    files.push_back(folder_ / "cloud.ply");
    std::ofstream(files.back()) << "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
                                   "property float y\nproperty float z\nproperty uchar red\n"
                                   "property uchar green\nproperty uchar blue\nend_header\n"
                                   "0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0.5 0 0 255\n";
    if (const auto data = test_data_folder())  // a zip and a folder
        for (const char* name : {"Unicorn_Stuffy_cleaned.sog", "playbot_sog"})
            files.push_back(*data / "splats" / name);
    const fs::path bad = folder_ / "bad name.ply";
    std::ofstream(bad) << "ply\nformat binary_little_endian 1.0\nelement vertex 5\nend_header\n";
    start();
    ImageU8 before = headless();
    ASSERT_TRUE(shows(before));
    for (const fs::path& file : files) {
        ASSERT_TRUE(drop_on_window("darb", bad));
        EXPECT_TRUE(changes_from(before, 100)) << "no message at " << file;
        xdo({"key", "Escape"});
        EXPECT_TRUE(shows(before)) << "the scene before is gone at " << file;
        const ImageU8 wanted = headless(file);
        ASSERT_TRUE(drop_on_window("darb", file));
        EXPECT_TRUE(shows(wanted))
            << file << " differs by " << largest_difference(window(), wanted);
        before = wanted;
    }
    EXPECT_TRUE(program_->running()) << log("view.log");
}

// Two scenes in turn on one running viewer.
TEST_F(WindowTest, A_hundred_dropped_scenes_leave_no_memory_behind_long) {
    write_scene(3'000);
    write_ply(folder_ / "other.ply", model_);
    start();
    const auto loads = [&] {
        const std::string text = log("view.log");
        size_t count = 0;
        for (size_t at = text.find("loaded "); at != std::string::npos;
             at = text.find("loaded ", at + 1))
            ++count;
        return count;
    };
    std::uint64_t after_some = 0;
    for (size_t i = 1; i <= 100; ++i) {
        ASSERT_TRUE(drop_on_window("darb", folder_ / (i % 2 == 0 ? "scene.ply" : "other.ply")));
        ASSERT_TRUE(eventually([&] { return loads() == i + 1; })) << i << "\n" << log("view.log");
        if (i == 20) after_some = program_->resident_bytes();
    }
    ASSERT_GT(after_some, 0u);
    // One scene of 3,000 splats is 0.7 MB on the host and as much on the device: 80 on one of them
    // would be 56 MB. The driver may first need a second worker's memory late, 9 MB once.
    EXPECT_TRUE(eventually([&] { return program_->resident_bytes() < after_some + 30'000'000; }))
        << program_->resident_bytes() << " bytes for " << after_some;
    EXPECT_TRUE(program_->running()) << log("view.log");
}

}  // namespace
}  // namespace darb::test
