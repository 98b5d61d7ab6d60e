// SPDX-License-Identifier: MIT
// Reading and atomic writing, with the failures that a long run meets: full disk, read-only disk.
#include "engine/core/files.h"

#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <string>
#include <thread>

#include "engine/core/error.h"

namespace darb {
namespace {

namespace fs = std::filesystem;

class Files : public testing::Test {
  protected:
    void SetUp() override {
        std::string name = (fs::temp_directory_path() / "darb_files_XXXXXX").string();
        ASSERT_NE(::mkdtemp(name.data()), nullptr);
        folder = name;
    }
    void TearDown() override {
        if (mounted) ::umount2(folder.c_str(), MNT_DETACH);
        std::error_code ignored;
        fs::permissions(folder, fs::perms::owner_all, ignored);
        fs::remove_all(folder, ignored);
    }
    /// A tmpfs over the folder; false where that is not allowed (no root, a tight container).
    bool mount_tmpfs(const char* options, unsigned long flags = 0) {
        mounted = ::mount("tmpfs", folder.c_str(), "tmpfs", flags, options) == 0;
        return mounted;
    }
    std::size_t file_count() const {
        return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {}));
    }

    fs::path folder;
    bool mounted = false;
};

/// The text of the Error that f throws; a failure and "" where it throws none.
template <class Function>
std::string error_text(Function f) {
    try {
        f();
    } catch (const Error& error) {
        return error.what();
    }
    ADD_FAILURE() << "no Error was thrown";
    return {};
}

void expect_contains(const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << "'" << part << "' is not in: " << text;
}

TEST_F(Files, Write_then_read_gives_the_same_bytes_for_every_size) {
    for (const std::size_t size : {0u, 1u, 4096u, (1u << 20) - 1, 1u << 20, 5'000'001u}) {
        std::vector<std::byte> bytes(size);
        for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i * 31 + i / 251);
        write_file_atomic(folder / "x.bin", bytes);
        EXPECT_EQ(read_file(folder / "x.bin"), bytes) << size << " bytes";
    }
    EXPECT_EQ(file_count(), 1u) << "a temporary file was left";
}

TEST_F(Files, Write_of_text_reads_back_with_its_zero_bytes) {
    const std::string text("a\0b\r\n", 5);
    write_file_atomic(folder / "x.txt", text);
    EXPECT_EQ(read_text_file(folder / "x.txt"), text);
}

TEST_F(Files, Write_replaces_a_longer_file_and_makes_missing_folders) {
    const fs::path path = folder / "a" / "b" / "x.txt";
    write_file_atomic(path, "a long first version");
    write_file_atomic(path, "short");
    EXPECT_EQ(read_text_file(path), "short");
}

TEST_F(Files, Read_of_a_missing_file_names_it_and_the_reason) {
    const fs::path path = folder / "missing.ply";
    const std::string text = error_text([&] { read_file(path); });
    expect_contains(text, path.string());
    expect_contains(text, "No such file");
}

TEST_F(Files, Read_of_a_folder_is_an_error) {
    expect_contains(error_text([&] { read_text_file(folder); }), "is a folder, not a file");
}

TEST_F(Files, Read_of_pipes_devices_and_sockets_is_refused_without_waiting) {
    ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
    fs::create_symlink("/dev/zero", folder / "zero.jpg");
    fs::create_symlink(folder / "pipe", folder / "link");
    const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string name = (folder / "s").string();
    std::copy(name.begin(), name.end(), address.sun_path);
    ASSERT_EQ(::bind(socket, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    const std::pair<const char*, const char*> kinds[] = {{"pipe", "is a pipe"},
                                                         {"link", "is a pipe"},
                                                         {"zero.jpg", "is a device"},
                                                         {"s", "is a socket"}};
    for (const auto& [name_of_it, kind] : kinds) {
        const fs::path file = folder / name_of_it;
        expect_contains(error_text([&] { read_file(file); }), kind);
        expect_contains(error_text([&] { read_file_head(file, 10); }), kind);
        expect_contains(error_text([&] { check_is_file(file); }), kind);
    }
    check_is_file(folder / "missing");
    ::close(socket);
}

TEST_F(Files, Read_of_the_head_ends_there) {
    write_file_atomic(folder / "a", "0123456789");
    EXPECT_EQ(read_file_head(folder / "a", 4).size(), 4u);
    EXPECT_EQ(read_file_head(folder / "a", 40).size(), 10u);
}

TEST_F(Files, Read_of_more_than_the_memory_names_the_file) {
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "the sanitizer reserves all addresses";
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
    GTEST_SKIP() << "the sanitizer reserves all addresses";
#endif
#endif
    write_file_atomic(folder / "huge", "");
    fs::resize_file(folder / "huge", std::uintmax_t{1} << 38);
    const pid_t child = ::fork();
    if (child == 0) {
        const rlimit limit{1u << 30, 1u << 30};
        ::setrlimit(RLIMIT_AS, &limit);
        try {
            read_file(folder / "huge");
        } catch (const Error& error) {
            ::_exit(error.where.ends_with("huge") ? 7 : 1);
        } catch (...) {
        }
        ::_exit(1);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 7) << status;
}

TEST_F(Files, Read_of_a_file_without_known_size_reads_to_the_end) {
    EXPECT_FALSE(read_text_file("/proc/self/status").empty());
}

TEST_F(Files, Write_below_a_file_names_the_path) {
    write_file_atomic(folder / "file", "content");
    const fs::path path = folder / "file" / "x.txt";
    expect_contains(error_text([&] { write_file_atomic(path, "text"); }), path.string());
    EXPECT_EQ(read_text_file(folder / "file"), "content");
}

TEST_F(Files, Write_over_a_folder_is_an_error_that_leaves_the_folder) {
    fs::create_directories(folder / "x" / "inner");
    expect_contains(error_text([&] { write_file_atomic(folder / "x", "text"); }), "cannot be");
    EXPECT_TRUE(fs::is_directory(folder / "x" / "inner"));
    EXPECT_EQ(file_count(), 1u) << "a temporary file was left";
}

// A file size limit stops write() half way, as a full disk does, and needs no root.
TEST_F(Files, Write_that_fails_half_way_leaves_the_old_file_and_no_other) {
    write_file_atomic(folder / "x.bin", "old");
    rlimit before{};
    ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
    rlimit small = before;
    small.rlim_cur = 100'000;
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
    const std::string big(1'000'000, 'x');
    const std::string text = error_text([&] { write_file_atomic(folder / "x.bin", big); });
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
    std::signal(SIGXFSZ, handler);

    expect_contains(text, (folder / "x.bin").string());
    expect_contains(text, "File too large");
    EXPECT_EQ(read_text_file(folder / "x.bin"), "old");
    EXPECT_EQ(file_count(), 1u) << "a temporary file was left";
}

TEST_F(Files, Write_on_a_full_disk_says_so_and_leaves_the_old_file) {
    if (!mount_tmpfs("size=64k")) GTEST_SKIP() << "mounting a small tmpfs needs root";
    write_file_atomic(folder / "x.bin", "old");
    const std::string big(1'000'000, 'x');
    const std::string text = error_text([&] { write_file_atomic(folder / "x.bin", big); });
    expect_contains(text, "No space left");
    EXPECT_EQ(read_text_file(folder / "x.bin"), "old");
    EXPECT_EQ(file_count(), 1u) << "a temporary file was left";
}

TEST_F(Files, Write_on_a_read_only_disk_names_file_and_reason) {
    const bool root = ::geteuid() == 0;  // root may write where the mode forbids it
    if (root && !mount_tmpfs("size=64k", MS_RDONLY)) GTEST_SKIP() << "mounting is not allowed";
    if (!root) fs::permissions(folder, fs::perms::owner_read | fs::perms::owner_exec);
    const fs::path path = folder / "x.bin";
    const std::string text = error_text([&] { write_file_atomic(path, "text"); });
    expect_contains(text, path.string());
    expect_contains(text, root ? "Read-only file system" : "Permission denied");
    EXPECT_EQ(file_count(), 0u);
}

TEST_F(Files, Write_leaves_a_file_that_has_the_name_of_its_temporary_one) {
    write_file_atomic(folder / "x.bin.tmp", "of the user");
    write_file_atomic(folder / "x.bin", "text");
    EXPECT_EQ(read_text_file(folder / "x.bin"), "text");
    EXPECT_EQ(read_text_file(folder / "x.bin.tmp"), "of the user");
    EXPECT_EQ(file_count(), 2u) << "a temporary file was left";
}

TEST_F(Files, Write_keeps_the_permissions_of_the_old_file_and_gives_a_new_one_the_usual_ones) {
    const auto mode = [&] { return fs::status(folder / "x.bin").permissions(); };
    const mode_t before = ::umask(027);
    write_file_atomic(folder / "x.bin", "new");
    ::umask(before);
    EXPECT_EQ(mode(), fs::perms(0640));
    fs::permissions(folder / "x.bin", fs::perms(0606));
    write_file_atomic(folder / "x.bin", "text");
    EXPECT_EQ(mode(), fs::perms(0606));
}

TEST_F(Files, Write_through_a_link_changes_the_file_that_it_points_to) {
    write_file_atomic(folder / "target", "old");
    fs::create_symlink("target", folder / "link");
    write_file_atomic(folder / "link", "new");
    EXPECT_TRUE(fs::is_symlink(folder / "link"));
    EXPECT_EQ(read_text_file(folder / "target"), "new");
}

TEST_F(Files, Write_to_a_pipe_or_a_device_leaves_it_one) {
    const fs::path pipe = folder / "pipe";
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    std::string got;
    std::jthread reader([&] { std::getline(std::ifstream(pipe) >> std::ws, got); });
    write_file_atomic(pipe, "text");
    reader.join();
    EXPECT_EQ(got, "text");
    EXPECT_TRUE(fs::is_fifo(pipe));
    write_file_atomic("/dev/null", "text");
    EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

}  // namespace
}  // namespace darb
