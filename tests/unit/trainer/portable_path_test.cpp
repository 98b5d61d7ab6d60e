// SPDX-License-Identifier: MIT
#include "trainer/run/run_folder.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace darb {
namespace {

namespace fs = std::filesystem;

TEST(PortablePath, is_as_seen_from_the_folder_by_the_places_behind_links) {
    const fs::path root = fs::path(testing::TempDir()) / fmt::format("portable_{}", ::getpid());
    fs::create_directories(root / "real" / "out");
    fs::create_directories(root / "photos");
    fs::create_directory_symlink(root / "real" / "out", root / "link");
    fs::create_directory_symlink(root / "photos", root / "photos_link");
    EXPECT_EQ(seen_from(root / "real" / "out", root / "photos"), "../../photos");
    EXPECT_EQ(seen_from(root / "link", root / "photos/"), "../../photos");
    EXPECT_EQ(seen_from(root / "real" / "out", root / "photos_link"), "../../photos_link");
    EXPECT_EQ(seen_from(root / "link", root / "real" / "out"), ".");
    EXPECT_EQ(seen_from(root / "photos", root / "photos" / "sub" / ".." / "x.json"), "x.json");
    for (const char* from : {"real/out", "link", "photos"})
        EXPECT_TRUE(fs::equivalent(root / from / seen_from(root / from, root / "photos_link"),
                                   root / "photos"))
            << from;
    EXPECT_EQ(shared_name(root / "link", root / "photos"), "../../photos");
    EXPECT_EQ(shared_name(root / "link", "/usr"), "usr") << "nothing in common but the root";
    fs::remove_all(root);
}

TEST(PortablePath, sentences_keep_the_last_name) {
    EXPECT_EQ(without_folders("/home/me/fox/sparse was read, not /home/me/fox/x", "/home/me/fox/"),
              "fox/sparse was read, not fox/x");
    EXPECT_EQ(without_folders("../data/fox is it", "../data/fox"), "fox is it");
    EXPECT_EQ(without_folders("a fox", "fox"), "a fox");
}

}  // namespace
}  // namespace darb
