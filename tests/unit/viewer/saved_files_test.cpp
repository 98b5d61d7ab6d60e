// Files that the viewer writes over, and those that it asks about first.
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

}  // namespace
}  // namespace darb
