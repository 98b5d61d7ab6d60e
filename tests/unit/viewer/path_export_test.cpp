// SPDX-License-Identifier: MIT
// What an export of a camera path does to the folder that it writes to: with every length of a
// path, and with every list of an earlier export, the files of others stay.
#include "viewer/path_export.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <limits>
#include <map>

#include "engine/core/error.h"
#include "engine/core/files.h"

namespace darb {
namespace {

namespace fs = std::filesystem;

class PathExportTest : public ::testing::Test {
  protected:
    void SetUp() override {
        fs::create_directories(folder_);
        put("notes.txt", "mine");
        put("scene.ply", "ply");
        put("frame_00007.png", "another's");
        put("frame_-0001.png", "another's");
        put("frame_00000.png.bak", "another's");
        put("frame_000012.png", "not a name that an export makes");
        put("frame_99999999999999999999.png", "another's");
        fs::create_directories(folder_ / "frame_00008.png");  // empty: remove would take it
        fs::create_directories(folder_ / "sub");
        put("sub/frame_00009.png", "another's");
        std::ofstream(root_ / "target.txt") << "behind a link";
        fs::create_symlink(root_ / "target.txt", folder_ / "link.txt");
        fs::create_symlink(root_ / "target.txt", folder_ / "frame_00005.png");
        before_ = content();
    }
    void TearDown() override { fs::remove_all(root_); }

    void put(const std::string& name, const std::string& text) {
        std::ofstream(folder_ / name) << text;
    }
    // Every entry, links unfollowed, with what it holds.
    std::map<std::string, std::string> content() const {
        std::map<std::string, std::string> all;
        for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root_)) {
            const fs::path name = entry.path().lexically_relative(root_);
            all[name.string()] = entry.is_symlink()     ? "-> " + fs::read_symlink(entry).string()
                                 : entry.is_directory() ? "/"
                                                        : read_text_file(entry.path());
        }
        return all;
    }
    void expect_others_stay(const std::string& when) const {
        const auto now = content();
        for (const auto& [name, text] : before_) {
            const auto found = now.find(name);
            ASSERT_NE(found, now.end()) << name << " is gone, " << when;
            EXPECT_EQ(found->second, text) << name << ", " << when;
        }
    }
    bool is_there(const std::string& name) const { return fs::exists(folder_ / name); }

    // Keys at 0 and at `last_s`.
    static CameraPath path_of(double last_s) {
        CameraPath path;
        path.keys.resize(2);
        for (KeyFrame& key : path.keys) key.fov_y = 1;
        path.keys[1].seconds = last_s;
        return path;
    }
    void run(const CameraPath& path, int fps, const fs::path& folder) const {
        ExportOptions options;
        options.folder = folder;
        options.fps = fps;
        options.width = options.height = 16;
        PathExport work(path, options);
        const auto grey = [](const Camera& camera, const DisplaySettings&) {
            return ImageU8(camera.width, camera.height, 3);
        };
        while (!work.done()) work.step(grey, true);
    }
    void run(double last_s, int fps) const { run(path_of(last_s), fps, folder_); }

    fs::path root_ = fs::temp_directory_path() / ("darb_path_export_" + std::to_string(::getpid()));
    fs::path folder_ = root_ / "frames";
    std::map<std::string, std::string> before_;
};

TEST_F(PathExportTest, Paths_of_every_length_leave_the_files_of_others) {
    for (const double last_s : {0.0, 0.2, -5.0, 1.7e9, 1e300, 71582788.3, 143165576.6,
                                std::numeric_limits<double>::infinity(), std::nan("")}) {
        try {
            run(last_s, 10);
            EXPECT_LT(last_s, 1) << "taken";
        } catch (const Error& e) {
            EXPECT_FALSE(last_s >= 0 && last_s < 1) << e.what();
            EXPECT_NE(std::string(e.what()).find("key 1"), std::string::npos) << e.what();
        }
        expect_others_stay(fmt::format("{} s", last_s));
    }
}

TEST_F(PathExportTest, A_shorter_export_deletes_the_frames_of_the_longer_alone) {
    run(0.4, 10);
    EXPECT_TRUE(is_there("frame_00004.png"));
    run(0.2, 10);
    EXPECT_TRUE(is_there("frame_00002.png"));
    EXPECT_FALSE(is_there("frame_00003.png"));
    EXPECT_FALSE(is_there("frame_00004.png"));
    EXPECT_FALSE(is_there(ExportFolder::kUnfinishedVideo));
    expect_others_stay("after two exports");
}

// Frame 7 and the link 5 are somebody else's: neither written over nor through.
TEST_F(PathExportTest, A_frame_that_no_export_wrote_is_refused_before_the_first_is_written) {
    for (const double last_s : {0.5, 0.7, 0.8}) {
        EXPECT_THROW(run(last_s, 10), Error);
        EXPECT_FALSE(is_there("frame_00000.png"));
        expect_others_stay(fmt::format("{} s", last_s));
    }
    put(ExportFolder::kVideo, "my own film");
    before_ = content();
    EXPECT_THROW(run(0.2, 10), Error);
    expect_others_stay("with a video of the user's");
}

TEST_F(PathExportTest, A_list_of_another_origin_deletes_nothing) {
    run(0.1, 10);
    std::string first_line;
    std::getline(std::ifstream(folder_ / ExportFolder::kList), first_line);
    put(ExportFolder::kList, first_line +
                                 "\nnotes.txt\n../target.txt\nsub/frame_00009.png\n"
                                 "./frame_00007.png\nframe_00008.png\nframe_00005.png\n"
                                 "link.txt\nsub\nframe_-0001.png\nframe_000012.png\n\n/\n"
                                 "frame_00000.png\nvideo.mp4\nframe_00001.png\nframe_000");
    run(0, 10);
    EXPECT_TRUE(is_there("frame_00000.png"));
    EXPECT_FALSE(is_there("frame_00001.png"));
    expect_others_stay("with a list that names them");
}

TEST_F(PathExportTest, A_file_of_the_list_s_name_that_is_none_is_refused_and_stays) {
    for (const std::string& text : {std::string(), std::string("frame_00007.png\n"),
                                    std::string("my notes on darb_export\nframe_00007.png\n")}) {
        put(ExportFolder::kList, text);
        before_ = content();
        EXPECT_THROW(run(0.1, 10), Error) << text;
        expect_others_stay("with the list: " + text);
    }
    fs::remove(folder_ / ExportFolder::kList);
    fs::create_symlink(root_ / "target.txt", folder_ / ExportFolder::kList);
    before_ = content();
    EXPECT_THROW(run(0.1, 10), Error);
    expect_others_stay("with a link of the list's name");
}

// A killed export has listed what it wrote: the next one goes on from there.
TEST_F(PathExportTest, What_an_export_without_an_end_left_is_replaced_by_the_next) {
    {
        ExportOptions options;
        options.folder = root_ / "new";
        options.fps = 10;
        options.width = options.height = 16;
        PathExport work(path_of(1), options);
        for (int n = 0; n < 5; ++n)
            work.step([](const Camera&, const DisplaySettings&) { return ImageU8(16, 16, 3); });
    }
    EXPECT_TRUE(fs::exists(root_ / "new" / "frame_00004.png"));
    run(path_of(0.1), 10, root_ / "new");
    EXPECT_TRUE(fs::exists(root_ / "new" / "frame_00001.png"));
    EXPECT_FALSE(fs::exists(root_ / "new" / "frame_00002.png"));
}

TEST(FrameName, Its_number_comes_back_and_other_names_have_none) {
    for (const std::int64_t n : {0, 12, 99'999, 100'000, 2'147'483'647})
        EXPECT_EQ(frame_number(frame_name(n)), n);
    for (const char* name : {"", "frame_.png", "frame_-0001.png", "frame_0.png", "frame_000012.png",
                             "frame_00012.PNG", "frame_00012.png.tmp", "a_frame_00012.png",
                             "frame_+0012.png", "frame_99999999999999999999.png"})
        EXPECT_EQ(frame_number(name), -1) << name;
}

}  // namespace
}  // namespace darb
