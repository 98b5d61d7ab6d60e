// SPDX-License-Identifier: MIT
// A virtual display (Xvfb) with a program of this project on it. Mouse, keys and drops reach it as
// a user's would; what it shows is read from Xvfb's frame buffer file.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "engine/core/files.h"
#include "engine/core/image.h"
#include "tests/support/compare_images.h"
#include "tests/support/resident_bytes.h"

namespace darb::test {

using Words = std::vector<std::string>;

inline constexpr int kDisplayWidth = 800, kDisplayHeight = 600;
inline constexpr auto kPatience = std::chrono::seconds(60);  // for a loaded machine

inline bool on_path(const std::string& program) {
    const char* list = std::getenv("PATH");
    std::string rest = list != nullptr ? list : "";
    while (!rest.empty()) {
        const size_t end = std::min(rest.find(':'), rest.size());
        if (::access((std::filesystem::path(rest.substr(0, end)) / program).c_str(), X_OK) == 0)
            return true;
        rest.erase(0, std::min(end + 1, rest.size()));
    }
    return false;
}

// A child process; `out` is its standard output, where that is read.
class Process {
  public:
    Process(const Words& words, const std::filesystem::path& log) {
        std::vector<char*> argv;
        for (const std::string& w : words) argv.push_back(const_cast<char*>(w.c_str()));
        argv.push_back(nullptr);
        pid_ = ::fork();
        if (pid_ != 0) return;
        const int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
        ::dup2(file, STDOUT_FILENO);
        ::dup2(file, STDERR_FILENO);
        ::execvp(argv[0], argv.data());
        ::_exit(127);
    }
    ~Process() {
        if (running()) {
            ::kill(pid_, SIGKILL);
            wait();
        }
    }
    Process(const Process&) = delete;
    Process& operator=(const Process&) = delete;
    bool running() {
        if (pid_ > 0 && ::waitpid(pid_, &status_, WNOHANG) == pid_) pid_ = 0;
        return pid_ > 0;
    }
    // 0 once it has ended.
    std::uint64_t resident_bytes() const { return test::resident_bytes(pid_); }
    void terminate() {  // 0 would be this whole process group
        if (pid_ > 0) ::kill(pid_, SIGTERM);
    }
    int wait() {
        if (pid_ > 0) ::waitpid(pid_, &status_, 0);
        pid_ = 0;
        return WIFEXITED(status_) ? WEXITSTATUS(status_) : -1;
    }

  private:
    pid_t pid_ = 0;
    int status_ = 0;
};

inline bool eventually(const std::function<bool()>& condition) {
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < end) {
        if (condition()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(30));
    }
    return false;
}

inline std::uint32_t big_endian(const std::vector<std::byte>& bytes, size_t word) {
    std::uint32_t value = 0;
    for (size_t i = 0; i < 4; ++i)
        value = value << 8 | std::to_integer<std::uint32_t>(bytes[word * 4 + i]);
    return value;
}

class DisplayTest : public ::testing::Test {
  protected:
    void SetUp() override {
        if (!on_path("Xvfb") || !on_path("xdotool"))
            GTEST_SKIP() << "no Xvfb or xdotool: tools/setup.sh installs them";
        folder_ =
            std::filesystem::temp_directory_path() / ("darb_window_" + std::to_string(::getpid()));
        std::filesystem::create_directories(folder_);
        ::setenv("XDG_STATE_HOME", (folder_ / "state").c_str(), 1);  // not the user's
        start_display();
    }
    void TearDown() override {
        program_.reset();
        if (display_) display_->terminate();
        display_.reset();
        if (!folder_.empty()) std::filesystem::remove_all(folder_);
    }

    // Xvfb chooses a free display number and writes it to the descriptor.
    void start_display() {
        int ends[2];
        ASSERT_EQ(::pipe(ends), 0);
        display_.emplace(
            Words{"Xvfb", "-displayfd", std::to_string(ends[1]), "-screen", "0", "800x600x24",
                  "-fbdir", folder_.string(), "-nocursor", "-nolisten", "tcp"},
            folder_ / "xvfb.log");
        ::close(ends[1]);
        char text[16] = {};
        const ssize_t count = ::read(ends[0], text, sizeof text - 1);
        ::close(ends[0]);
        ASSERT_GT(count, 0) << "Xvfb did not start: " << log("xvfb.log");
        ::setenv("DISPLAY", (":" + std::to_string(std::atoi(text))).c_str(), 1);
    }
    std::string log(const char* name) const {
        return std::filesystem::exists(folder_ / name) ? read_text_file(folder_ / name) : "";
    }
    void xdo(const Words& words) {
        Words all{"xdotool"};
        all.insert(all.end(), words.begin(), words.end());
        Process run(all, folder_ / "xdotool.log");
        ASSERT_EQ(run.wait(), 0) << log("xdotool.log");
    }
    // The top left part of the display, where the window is.
    ImageU8 screen(int width, int height) const {
        const std::vector<std::byte> xwd = read_file(folder_ / "Xvfb_screen0");
        const size_t data = big_endian(xwd, 0) + big_endian(xwd, 19) * 12;
        const size_t line = big_endian(xwd, 12);
        ImageU8 image(width, height, 3);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                for (int c = 0; c < 3; ++c)
                    image.at(x, y, c) = std::to_integer<std::uint8_t>(
                        xwd[data + size_t(y) * line + size_t(x) * 4 + size_t(2 - c)]);
        return image;
    }
    ImageU8 screen() const { return screen(kDisplayWidth, kDisplayHeight); }
    // The display once it has stayed unchanged for several looks in a row.
    ImageU8 settled() {
        ImageU8 last = screen();
        int same = 0;
        EXPECT_TRUE(eventually([&] {
            const ImageU8 now = screen();
            same = largest_difference(now, last) == 0 ? same + 1 : 0;
            last = now;
            return same >= 15;
        }));
        return last;
    }
    bool changes_from(const ImageU8& image, int by) {
        return eventually(
            [&] { return largest_difference(screen(image.width, image.height), image) > by; });
    }
    bool shows(const ImageU8& wanted) {
        return eventually(
            [&] { return largest_difference(screen(wanted.width, wanted.height), wanted) == 0; });
    }

    std::filesystem::path folder_;
    std::optional<Process> display_, program_;
};

}  // namespace darb::test
