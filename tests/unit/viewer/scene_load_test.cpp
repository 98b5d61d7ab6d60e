// SPDX-License-Identifier: MIT
// What is no file is refused by its kind, at once, and never makes the loader wait.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <fstream>

#include "engine/core/error.h"
#include "viewer/scene.h"

namespace darb {
namespace {

namespace fs = std::filesystem;

class SceneLoadTest : public ::testing::Test {
  protected:
    void SetUp() override { fs::create_directories(folder_); }
    void TearDown() override { fs::remove_all(folder_); }

    fs::path make_socket() {
        const fs::path path = folder_ / "socket";
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
        const int handle = ::socket(AF_UNIX, SOCK_STREAM, 0);
        EXPECT_EQ(::bind(handle, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
        ::close(handle);
        return path;
    }
    fs::path make_pipe(const fs::path& path) {
        fs::create_directories(path.parent_path());
        EXPECT_EQ(::mkfifo(path.c_str(), 0600), 0);
        return path;
    }
    fs::path make_link(const char* name, const fs::path& target) {
        fs::create_symlink(target, folder_ / name);
        return folder_ / name;
    }

    fs::path folder_ = fs::temp_directory_path() / ("darb_load_" + std::to_string(::getpid()));
};

TEST_F(SceneLoadTest, What_is_no_file_is_refused_by_its_kind) {
    fs::create_directories(folder_ / "empty");
    const std::vector<std::pair<fs::path, std::string>> cases = {
        {make_pipe(folder_ / "pipe.ply"), "pipe"},
        {make_pipe(folder_ / "sog" / "meta.json"), "pipe"},
        {make_link("link.ply", folder_ / "pipe.ply"), "pipe"},
        {make_socket(), "socket"},
        {"/dev/zero", "device"},
        {make_link("device.ply", "/dev/zero"), "device"},
        {folder_ / "empty", "folder"},
        {folder_ / "sog", "folder"},
        {folder_ / "none.ply", "does not exist"}};
    for (const auto& [path, what] : cases) {
        SceneLoader loader(nullptr, nullptr);
        loader.start(path, true);
        try {
            loader.wait();
            ADD_FAILURE() << path << " was taken";
        } catch (const Error& e) {
            EXPECT_NE(std::string(e.what()).find(what), std::string::npos) << e.what();
            EXPECT_NE(std::string(e.what()).find(path.string()), std::string::npos) << e.what();
        }
        EXPECT_FALSE(loader.loading());
    }
}

TEST_F(SceneLoadTest, A_loader_ends_while_it_has_a_pipe) {
    SceneLoader loader(nullptr, nullptr);
    loader.start(make_pipe(folder_ / "pipe.ply"), true);
    loader.start(folder_ / "pipe.ply", true);
    loader.cancel();
    EXPECT_EQ(loader.share(), -1);
    EXPECT_FALSE(loader.poll());
}

TEST_F(SceneLoadTest, An_earlier_load_goes_on_where_the_next_path_means_no_scene) {
    std::ofstream(folder_ / "points.ply")
        << "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
           "property float z\nend_header\n0 0 0\n";
    SceneLoader loader(
        [](const fs::path& path) -> fs::path {
            if (path == "nothing") throw Error("nothing", "is no scene");
            return path;
        },
        nullptr);
    loader.start(folder_ / "points.ply", false);
    EXPECT_THROW(loader.start("nothing", true), Error);
    const std::optional<LoadedScene> loaded = loader.wait();
    ASSERT_TRUE(loaded);
    EXPECT_EQ(loaded->asked_for, folder_ / "points.ply");
    EXPECT_FALSE(loaded->dropped);
}

}  // namespace
}  // namespace darb
