// SPDX-License-Identifier: MIT
// What ends or disturbs a training run from outside: signals, lost readers of its output, limits of
// files, a second run in its folder. It saves, says so, and goes on where it can. For the command.
#include <fcntl.h>
#include <sys/resource.h>

#include <csignal>
#include <functional>
#include <nlohmann/json.hpp>
#include <vector>

#include "tests/support/child.h"
#include "tests/support/run_command.h"

namespace darb::test {
namespace {

const fs::path kStoppedScene = fs::path(DARB_SOURCE_DIR) / "assets" / "scene";

class StoppedRun : public testing::Test {
  protected:
    void SetUp() override { fs::create_directories(folder_); }
    void TearDown() override { fs::remove_all(folder_); }

    std::vector<std::string> training(int iterations, const char* more = "--no-report") const {
        return {"train",
                kStoppedScene.string(),
                "-o",
                run_.string(),
                "-r",
                "8",
                "--iterations",
                std::to_string(iterations),
                "--checkpoint-interval",
                "0",
                "--sh-degree",
                "0",
                more};
    }
    // Until it trains.
    void begins(Child& child) const {
        while (child.running() && !fs::exists(run_ / "run.jsonl")) ::usleep(1'000);
        while (child.running() && read_text_file(run_ / "run.jsonl").empty()) ::usleep(1'000);
        ASSERT_TRUE(child.running()) << child.err();
    }
    void expect_saved() const {
        EXPECT_TRUE(fs::exists(run_ / "checkpoint.darb"));
        size_t scenes = 0;
        for (const auto& entry : fs::recursive_directory_iterator(run_ / "point_cloud"))
            scenes += entry.path().extension() == ".ply" ? 1 : 0;
        EXPECT_EQ(scenes, 1U);
    }
    static fs::path ended_model(const fs::path& run) {
        return run / "point_cloud" / "iteration_40" / "point_cloud.ply";
    }

    const fs::path folder_ = scratch() / "stopped", run_ = folder_ / "run";
};

TEST_F(StoppedRun, each_signal_ends_it_with_a_save_and_a_code_of_its_own) {
    const std::vector<std::pair<int, const char*>> signals{
        {SIGINT, "SIGINT"}, {SIGTERM, "SIGTERM"}, {SIGHUP, "SIGHUP"}, {SIGXCPU, "SIGXCPU"}};
    for (const auto& [signal, name] : signals) {
        SCOPED_TRACE(name);
        fs::remove_all(run_);
        Child child(training(1'000'000), folder_);
        begins(child);
        child.send(signal);
        if (signal == SIGHUP) child.send(signal);  // from the terminal and from the shell
        EXPECT_EQ(child.wait(), 128 + signal) << child.err();
        expect_saved();
        EXPECT_NE(child.err().find("saved the checkpoint and the scene"), std::string::npos);
        EXPECT_NE(child.out().find(std::string("interrupted by ") + name), std::string::npos);
    }
}

TEST_F(StoppedRun, a_hangup_that_nohup_keeps_away_does_not_count) {
    Child child(training(40), folder_, [] { ::signal(SIGHUP, SIG_IGN); });
    begins(child);
    child.send(SIGHUP);
    EXPECT_EQ(child.wait(), 0) << child.err();
    EXPECT_TRUE(fs::exists(ended_model(run_)));
}

// Readers that are gone, descriptors that are closed: the run goes on to its end.
TEST_F(StoppedRun, lost_stdout_and_stderr_are_no_reason_to_stop) {
    const std::vector<std::function<void()>> losses{
        [&] {
            write_to_nobody({STDOUT_FILENO, STDERR_FILENO});
        },
        [&] { write_to_nobody({STDERR_FILENO}); },
        [] {
            ::close(STDOUT_FILENO);
            ::close(STDERR_FILENO);
        }};
    for (const auto& loss : losses) {
        fs::remove_all(run_);
        Child child(training(40), folder_, loss);
        EXPECT_EQ(child.wait(), 0);
        EXPECT_TRUE(fs::exists(ended_model(run_)));
    }
}

// A checkpoint is larger than its scene.
TEST_F(StoppedRun, a_limit_of_the_size_of_files_is_an_error_and_the_scene_is_saved) {
    const auto limit = [] {
        const rlimit bytes{300'000, 300'000};
        ::setrlimit(RLIMIT_FSIZE, &bytes);
    };
    auto words = training(40);
    words.insert(words.end(), {"--checkpoint-iterations", "20"});
    Child child(words, folder_, limit);
    EXPECT_EQ(child.wait(), 2);
    EXPECT_NE(child.err().find("chkpnt20.darb: cannot be written: File too large"),
              std::string::npos)
        << child.err();
    EXPECT_NE(child.err().find("saved the scene"), std::string::npos) << child.err();
    EXPECT_TRUE(fs::exists(run_ / "point_cloud" / "iteration_20" / "point_cloud.ply"));
    for (const auto& entry : fs::recursive_directory_iterator(run_))
        EXPECT_NE(entry.path().extension(), ".tmp") << entry.path();
}

TEST_F(StoppedRun, a_second_run_in_the_folder_is_refused_and_names_the_first) {
    Child first(training(1'000'000), folder_);
    begins(first);
    const auto command = [&](const char* more) {
        return fmt::format("train '{}' -o '{}' -r 8 --iterations 5 -q {}", kStoppedScene.string(),
                           run_.string(), more);
    };
    for (const char* more : {"", "--resume"}) {
        const Outcome second = darb(command(more));
        EXPECT_EQ(second.code, 2) << second.err;
        EXPECT_NE(second.err.find(fmt::format("process {} on ", first.pid())), std::string::npos)
            << second.err;
    }
    EXPECT_EQ(darb(fmt::format("compare '{}' -o '{}' -r 8 --iterations 5", kStoppedScene.string(),
                               run_.string()))
                  .code,
              2);
    first.send(SIGKILL);  // leaves its lock file, and no lock
    EXPECT_EQ(first.wait(), -SIGKILL);
    ASSERT_TRUE(fs::exists(run_ / "run.lock"));
    const Outcome after = darb(command(""));
    EXPECT_EQ(after.code, 0) << after.err;
    EXPECT_FALSE(fs::exists(run_ / "run.lock"));
}

TEST_F(StoppedRun, temporary_files_of_a_killed_run_go_and_no_others) {
    const std::vector<fs::path> left{
        "checkpoint.darb.tmp",      "checkpoint.darb.1.tmp",
        "metrics.json.tmp",         "chkpnt20.darb.tmp",
        "held_out/20/view.png.tmp", "point_cloud/iteration_20/point_cloud.ply.3.tmp"};
    const std::vector<fs::path> kept{"notes.tmp",
                                     "checkpoint.darb.old.tmp",
                                     "thesis.txt.tmp",
                                     "held_out/mine/view.png.tmp",
                                     "held_out/20/view.txt.tmp",
                                     "point_cloud/iteration_20/mine.ply.tmp",
                                     "point_cloud.tmp/mine"};
    for (const auto* list : {&left, &kept})
        for (const fs::path& name : *list) write_file_atomic(run_ / name, "x");
    fs::create_directory_symlink(folder_ / "elsewhere", run_ / "held_out" / "7");
    write_file_atomic(folder_ / "elsewhere" / "view.png.tmp", "x");
    fs::create_symlink(folder_ / "elsewhere" / "view.png.tmp", run_ / "cfg_args.tmp");
    const Outcome o = darb(fmt::format("train '{}' -o '{}' -r 8 --iterations 2 -q --no-report",
                                       kStoppedScene.string(), run_.string()));
    ASSERT_EQ(o.code, 0) << o.err;
    // What stays may have been set aside with its folder.
    const auto is_there = [&](const fs::path& name) {
        return fs::exists(fs::symlink_status(run_ / name)) ||
               fs::exists(fs::symlink_status(run_ / "earlier.1" / name));
    };
    for (const fs::path& name : left) EXPECT_FALSE(is_there(name)) << name;
    for (const fs::path& name : kept) EXPECT_TRUE(is_there(name)) << name;
    EXPECT_TRUE(is_there("cfg_args.tmp"));
    EXPECT_TRUE(fs::exists(folder_ / "elsewhere" / "view.png.tmp"));
}

}  // namespace
}  // namespace darb::test
