// SPDX-License-Identifier: MIT
// Files that the viewer writes over, and those that it asks about first; what it lists to open.
#include "viewer/saved_files.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include "engine/core/error.h"

namespace darb {
namespace {

namespace fs = std::filesystem;

class SavedFilesTest : public ::testing::Test {
  protected:
    void SetUp() override {
        fs::create_directories(folder_);
        std::ofstream(folder_ / "theirs.ply") << "ply";
        std::ofstream(folder_ / "other.ply") << "ply";
    }
    void TearDown() override { fs::remove_all(folder_); }

    fs::path folder_ = fs::temp_directory_path() / ("darb_saved_" + std::to_string(::getpid()));
    SavedFiles saved_;
};

TEST_F(SavedFilesTest, A_new_file_and_one_that_it_wrote_are_free) {
    const fs::path file = folder_ / "new.ply";
    EXPECT_NO_THROW(saved_.check(file));
    std::ofstream(file) << "ply";
    saved_.wrote(file);
    for (int again = 0; again < 2; ++again) EXPECT_NO_THROW(saved_.check(file));
    EXPECT_NO_THROW(saved_.check(folder_ / "." / "new.ply")) << "another name of it";
}

TEST_F(SavedFilesTest, Another_s_file_is_replaced_when_it_is_asked_for_twice_in_a_row) {
    EXPECT_THROW(saved_.check(folder_ / "theirs.ply"), Error);
    EXPECT_THROW(saved_.check(folder_ / "other.ply"), Error);
    EXPECT_THROW(saved_.check(folder_ / "theirs.ply"), Error) << "another was in between";
    EXPECT_NO_THROW(saved_.check(folder_ / "theirs.ply"));
}

TEST_F(SavedFilesTest, A_link_is_what_it_leads_to_and_other_kinds_are_refused) {
    fs::create_symlink(folder_ / "theirs.ply", folder_ / "link.ply");
    EXPECT_THROW(saved_.check(folder_ / "link.ply"), Error);
    fs::create_directory(folder_ / "folder.ply");
    ASSERT_EQ(::mkfifo((folder_ / "pipe.ply").c_str(), 0600), 0);
    for (const char* name : {"folder.ply", "pipe.ply"})
        for (int twice = 0; twice < 2; ++twice)
            EXPECT_THROW(saved_.check(folder_ / name), Error) << name;
}

TEST_F(SavedFilesTest, The_latest_ten_that_are_still_there_are_listed_once) {
    const fs::path list = folder_ / "state" / "recent.json";
    const RecentFiles recent(list);
    EXPECT_TRUE(recent.read().empty());
    for (int i = 0; i < 12; ++i) {
        const fs::path file = folder_ / (std::to_string(i) + "\xff.ply");
        std::ofstream(file) << "ply";
        recent.opened(file);
    }
    for (const char* name : {"theirs.ply", "other.ply", "theirs.ply"})
        recent.opened(folder_ / "." / name);
    recent.opened(folder_ / "");  // a scene that is a folder
    fs::remove(folder_ / "other.ply");
    const std::vector<fs::path> files = recent.read();
    ASSERT_GE(files.size(), 2u);
    EXPECT_LE(files.size(), 10u);
    EXPECT_EQ(files[0], folder_);
    EXPECT_EQ(files[1], folder_ / "theirs.ply");
    for (const char* bad : {"{", "[]", "{\"scenes\": 3}"}) {
        std::ofstream(list) << bad;
        EXPECT_TRUE(recent.read().empty()) << bad;
        EXPECT_NO_THROW(recent.opened(folder_ / "theirs.ply"));
        EXPECT_EQ(fs::file_size(list), std::string(bad).size()) << "another's list was replaced";
    }
    EXPECT_NO_THROW(RecentFiles().opened("a.ply"));
}

TEST_F(SavedFilesTest, A_folder_is_listed_with_its_folders_and_scenes_alone) {
    fs::create_directory(folder_ / "z");
    fs::create_directory(folder_ / ".hidden");
    std::ofstream(folder_ / "notes.txt") << "text";
    std::ofstream(folder_ / "A.SPZ") << "spz";
    ASSERT_EQ(::mkfifo((folder_ / "pipe.ply").c_str(), 0600), 0);
    std::vector<std::string> names;
    for (const FolderEntry& entry : list_folder(folder_)) {
        EXPECT_EQ(entry.folder, entry.name == "z");
        names.push_back(entry.name);
    }
    EXPECT_EQ(names, (std::vector<std::string>{"z", "A.SPZ", "other.ply", "theirs.ply"}));
    EXPECT_TRUE(list_folder(folder_ / "notes.txt").empty());
    EXPECT_TRUE(list_folder(folder_ / "none").empty());
}

}  // namespace
}  // namespace darb
