// SPDX-License-Identifier: MIT
// The darb command, killed without warning while it trains, continues with --resume and ends with
// exactly the bytes of an undisturbed run.
#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/core/files.h"
#include "engine/core/rng.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;

class Command {
  public:
    explicit Command(const std::vector<std::string>& arguments, const fs::path& log) {
        std::vector<char*> argv{const_cast<char*>(DARB_COMMAND)};
        for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
        argv.push_back(nullptr);
        child_ = ::fork();
        if (child_ == 0) {
            const int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
            ::dup2(file, STDOUT_FILENO);
            ::dup2(file, STDERR_FILENO);
            ::execv(DARB_COMMAND, argv.data());
            ::_exit(127);
        }
    }
    ~Command() {
        if (running()) kill();
    }
    bool running() {
        if (child_ > 0 && ::waitpid(child_, &status_, WNOHANG) == child_) child_ = 0;
        return child_ > 0;
    }
    void kill() {
        ::kill(child_, SIGKILL);
        ::waitpid(child_, &status_, 0);
        child_ = 0;
    }
    void interrupt() { ::kill(child_, SIGINT); }
    /// Exit code, or -1 where a signal ended it.
    int wait() {
        if (child_ > 0) ::waitpid(child_, &status_, 0);
        child_ = 0;
        return WIFEXITED(status_) ? WEXITSTATUS(status_) : -1;
    }

  private:
    pid_t child_ = 0;
    int status_ = 0;
};

class KilledRun : public testing::Test {
  protected:
    void SetUp() override { fs::create_directories(folder_); }
    void TearDown() override {
        const std::string text = fs::exists(log()) ? read_text_file(log()) : "";
        EXPECT_EQ(text.find("vulkan validation:"), std::string::npos) << text;
        fs::remove_all(folder_);
    }

    static std::vector<std::string> training(const fs::path& output) {
        return {"train", std::string(DARB_SOURCE_DIR) + "/assets/scene",
                "-o",    output.string(),
                "-r",    "8",
                "-q",    "--iterations",
                "160",   "--checkpoint-interval",
                "10",    "--densify-from-iter",
                "20",    "--densification-interval",
                "20",    "--opacity-reset-interval",
                "50"};
    }
    fs::path log() const { return folder_ / "log"; }
    static fs::path model(const fs::path& output) {
        return output / "point_cloud" / "iteration_160" / "point_cloud.ply";
    }

    const fs::path folder_ =
        fs::path(testing::TempDir()) / fmt::format("darb_killed_{}", ::getpid());
};

TEST_F(KilledRun, resumes_to_the_bytes_of_a_run_that_nobody_killed) {
    const fs::path whole = folder_ / "whole", killed = folder_ / "killed";
    ASSERT_EQ(Command(training(whole), log()).wait(), 0) << read_text_file(log());
    const fs::path checkpoint = killed / "checkpoint.darb",
                   temporary = killed / "checkpoint.darb.tmp";
    Pcg32 rng(1);
    int kills = 0;
    for (int round = 0; round < 5; ++round) {
        std::vector<std::string> arguments = training(killed);
        if (round > 0) arguments.push_back("--resume");
        fs::remove(temporary);  // left by a run that was killed while writing
        Command command(arguments, log());
        // In even rounds at the next checkpoint, some way into what follows; in odd ones while it
        // is written.
        const auto before = round > 0 ? fs::last_write_time(checkpoint) : fs::file_time_type();
        std::error_code none;
        const auto moment = [&] {
            const auto now = fs::last_write_time(checkpoint, none);
            return (!none && now != before) || (round % 2 == 1 && fs::exists(temporary));
        };
        while (command.running() && !moment()) ::usleep(200);
        if (round % 2 == 0) ::usleep(rng.below(60'000));
        if (!command.running()) break;
        command.kill();
        ++kills;
        ASSERT_TRUE(fs::exists(checkpoint)) << "round " << round;
    }
    EXPECT_GE(kills, 2);
    std::vector<std::string> arguments = training(killed);
    arguments.push_back("--resume");
    ASSERT_EQ(Command(arguments, log()).wait(), 0) << read_text_file(log());
    EXPECT_EQ(read_file(model(killed)), read_file(model(whole)));
    EXPECT_FALSE(read_file(model(whole)).empty());
}

// The same with Ctrl-C, which saves first; and without repeating the arguments.
TEST_F(KilledRun, interrupted_run_saves_and_resumes_by_its_folder_alone) {
    const fs::path whole = folder_ / "whole", stopped = folder_ / "stopped";
    ASSERT_EQ(Command(training(whole), log()).wait(), 0) << read_text_file(log());
    {
        Command command(training(stopped), log());
        while (command.running() && !fs::exists(stopped / "checkpoint.darb")) ::usleep(200);
        ASSERT_TRUE(command.running()) << "the run ended before it was interrupted";
        command.interrupt();
        EXPECT_EQ(command.wait(), 128 + SIGINT) << read_text_file(log());
    }
    EXPECT_FALSE(fs::exists(model(stopped)));
    ASSERT_EQ(Command({"train", "--resume", "-q", "-o", stopped.string()}, log()).wait(), 0)
        << read_text_file(log());
    EXPECT_EQ(read_file(model(stopped)), read_file(model(whole)));
}

// A comparison ends with the signal's exit code, and reports the results so far.
TEST_F(KilledRun, interrupted_comparison_keeps_the_evaluations_that_were_made) {
    const fs::path run = folder_ / "scene/gaussian/seed0";
    Command command(
        {"compare", std::string(DARB_SOURCE_DIR) + "/assets/scene", "-o", folder_.string(), "-r",
         "8", "-q", "--kernels", "gaussian", "--iterations", "10,1000000", "--blending-views", "0"},
        log());
    while (command.running() && !fs::exists(run / "point_cloud/iteration_10")) ::usleep(200);
    ASSERT_TRUE(command.running()) << read_text_file(log());
    command.interrupt();
    EXPECT_EQ(command.wait(), 128 + SIGINT) << read_text_file(log());
    const auto report = nlohmann::json::parse(read_text_file(folder_ / "compare.json"));
    const auto& set = report["datasets"][0];
    EXPECT_GT(set["medians"][0]["psnr_db"]["median"].get<double>(), 5);
    EXPECT_TRUE(set["medians"][1]["psnr_db"].is_null());
    EXPECT_EQ(set["runs"][0]["failure"].get<std::string>().find("interrupted"), 0u);
}

}  // namespace
}  // namespace darb::test
