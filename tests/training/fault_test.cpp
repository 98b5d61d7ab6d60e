// SPDX-License-Identifier: MIT
// Training through the darb command while things break: a lost device, no memory, a full or
// read-only disk, photos that change. Each ends with exit code 2 and a message that says what, why
// and what to do, leaves the last checkpoint as it was, and --resume ends with the bytes of a run
// without faults.
#include <sys/mount.h>

#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/run_command.h"

namespace darb::test {
namespace {

using Bytes = std::vector<std::byte>;

class Fault {
  public:
    explicit Fault(const char* text) { ::setenv("DARB_FAULT", text, 1); }
    ~Fault() { ::unsetenv("DARB_FAULT"); }
};

class FaultyRun : public testing::Test {
  protected:
    void SetUp() override { fs::create_directories(run_); }
    void TearDown() override {
        if (mounted_) ::umount2(run_.c_str(), MNT_DETACH);
        fs::remove_all(folder_);
    }

    static std::string training(const fs::path& output, const fs::path& scene = kShippedScene) {
        return fmt::format(
            "train '{}' -o '{}' -r 8 -q --iterations 80 --checkpoint-interval 10 "
            "--densify-from-iter 10 --densification-interval 10 --sh-degree 1",
            scene.string(), output.string());
    }
    static fs::path model(const fs::path& output) {
        return output / "point_cloud" / "iteration_80" / "point_cloud.ply";
    }
    static std::vector<nlohmann::json> events(const fs::path& output) {
        std::istringstream lines(read_text_file(output / "run.jsonl"));
        std::vector<nlohmann::json> all;
        for (std::string line; std::getline(lines, line);)
            all.push_back(nlohmann::json::parse(line));
        return all;
    }
    fs::path checkpoint() const { return run_ / "checkpoint.darb"; }

    static void expect_says(const Outcome& o, const std::vector<std::string>& parts) {
        EXPECT_EQ(o.code, 2) << o.out << o.err;
        for (const std::string& part : parts)
            EXPECT_NE(o.err.find(part), std::string::npos) << "no '" << part << "' in: " << o.err;
    }
    /// A run whose device is lost after some checkpoints.
    void start_and_lose_the_device(const fs::path& scene = kShippedScene) {
        const Fault fault("lost:75");
        const Outcome o = darb(training(run_, scene));
        expect_says(o, {"pass", "the device was lost", "last checkpoint"});
        ASSERT_TRUE(fs::exists(checkpoint())) << "the device was lost too early for this test";
        ASSERT_FALSE(fs::exists(model(run_))) << "too late";
    }
    void expect_resumes_to(const Bytes& whole, const fs::path& scene = kShippedScene) {
        const Outcome o = darb(training(run_, scene) + " --resume");
        ASSERT_EQ(o.code, 0) << o.err;
        EXPECT_EQ(read_file(model(run_)), whole);
    }
    Bytes whole_run(const fs::path& scene = kShippedScene) {
        const Outcome o = darb(training(folder_ / "whole", scene));
        EXPECT_EQ(o.code, 0) << o.err;
        Bytes whole = read_file(model(folder_ / "whole"));
        EXPECT_FALSE(whole.empty());
        return whole;
    }

    static const fs::path kShippedScene;
    const fs::path folder_ = scratch() / "faults";
    const fs::path run_ = folder_ / "run";
    bool mounted_ = false;
};
const fs::path FaultyRun::kShippedScene = fs::path(DARB_SOURCE_DIR) / "assets" / "scene";

TEST_F(FaultyRun, a_lost_device_is_logged_and_resumed_from) {
    const Bytes whole = whole_run();
    start_and_lose_the_device();
    const nlohmann::json last = events(run_).back();
    EXPECT_EQ(last["event"], "failure");
    EXPECT_NE(last["what"].get<std::string>().find("device was lost"), std::string::npos);
    expect_resumes_to(whole);

    // The counters in run log and metrics, for a run in which nothing went wrong.
    nlohmann::json logged;
    for (const nlohmann::json& event : events(folder_ / "whole"))
        if (event["event"] == "iteration") logged = event;
    const nlohmann::json metrics =
        nlohmann::json::parse(read_text_file(folder_ / "whole" / "metrics.json"));
    const std::vector<nlohmann::json> reports = {metrics, logged};
    for (const nlohmann::json& report : reports) {
        EXPECT_EQ(report.at("bad_gradients"), 0);
        EXPECT_TRUE(report.at("overflows").is_number());
        EXPECT_TRUE(report.at("redone_iterations").is_number());
        const nlohmann::json& culled = report.at("culled_splat_frames");
        for (const char* reason : {"near", "rotation", "opacity", "covariance", "colour"})
            EXPECT_TRUE(culled.at(reason).is_number()) << reason;
        EXPECT_GT(culled.at("outside").get<int>(), 0);
    }
}

TEST_F(FaultyRun, no_memory_names_the_buffer_and_what_to_do) {
    {
        const Fault fault("oom:splat shape");  // at the start
        expect_says(darb(training(run_)), {"splat shape", "out of device memory"});
    }
    EXPECT_FALSE(fs::exists(checkpoint()));
    const Fault fault("oom:densify action");  // at the first density control
    const Outcome o = darb(training(run_));
    expect_says(o, {"densify action", "out of device memory"});
    EXPECT_TRUE(fs::exists(checkpoint()));
    expect_says(darb(training(run_) + " --max-memory 1M"), {"--max-memory"});
}

// A tmpfs that a file fills up to the last 200 kB, too few for a second checkpoint.
TEST_F(FaultyRun, a_full_and_a_read_only_disk_leave_the_checkpoint) {
    mounted_ = ::mount("tmpfs", run_.c_str(), "tmpfs", 0, "size=32m") == 0;
    if (!mounted_) GTEST_SKIP() << "mounting a small tmpfs needs root";
    const Bytes whole = whole_run();
    start_and_lose_the_device();
    const Bytes before = read_file(checkpoint());
    ASSERT_GT(before.size(), 300'000U);

    const auto room = fs::space(run_).available;
    ASSERT_GT(room, 300'000U);
    write_file_atomic(run_ / "filler", std::string(room - 200'000, 'x'));
    expect_says(darb(training(run_) + " --resume"), {run_.string(), "No space left on device"});
    EXPECT_EQ(read_file(checkpoint()), before);
    for (const auto& entry : fs::recursive_directory_iterator(run_))
        EXPECT_NE(entry.path().extension(), ".tmp") << entry.path();
    fs::remove(run_ / "filler");

    ASSERT_EQ(::mount(nullptr, run_.c_str(), nullptr, MS_REMOUNT | MS_RDONLY, nullptr), 0);
    expect_says(darb(training(run_) + " --resume"), {run_.string(), "Read-only file system"});
    EXPECT_EQ(read_file(checkpoint()), before);
    ASSERT_EQ(::mount(nullptr, run_.c_str(), nullptr, MS_REMOUNT, nullptr), 0);
    expect_resumes_to(whole);
}

TEST_F(FaultyRun, photos_that_changed_since_are_noticed) {
    const fs::path scene = folder_ / "scene";
    fs::copy(kShippedScene, scene, fs::copy_options::recursive);
    const Bytes whole = whole_run(scene);
    start_and_lose_the_device(scene);
    const Bytes before = read_file(checkpoint());
    const fs::path photo = scene / "images" / "view_11.png";
    const fs::path kept = folder_ / "kept.png";
    fs::rename(photo, kept);
    expect_says(darb(training(run_, scene) + " --resume"), {"view_11.png"});  // missing
    fs::copy(scene / "images" / "view_12.png", photo);  // another one under its name
    expect_says(darb(training(run_, scene) + " --resume"),
                {"checkpoint.darb", "is not the one it was trained on", "Restore the photos"});
    fs::copy(kept, photo, fs::copy_options::overwrite_existing);
    EXPECT_EQ(read_file(checkpoint()), before);
    expect_resumes_to(whole, scene);
}

TEST_F(FaultyRun, a_refused_resume_leaves_everything_of_the_run) {
    start_and_lose_the_device();
    std::map<fs::path, Bytes> before;
    for (const char* name : {"request.json", "cameras.json", "cfg_args", "run.jsonl"})
        before[run_ / name] = read_file(run_ / name);
    expect_says(darb(training(run_) + " --resume --kernel sinc"),
                {"was written with other settings", "kernel"});
    expect_says(darb("train --resume --iterations 90 -o '" + run_.string() + "'"),
                {"--iterations", "Repeat the whole command"});
    for (const auto& [path, bytes] : before) EXPECT_EQ(read_file(path), bytes) << path;
}

TEST_F(FaultyRun, a_fresh_run_is_not_mistaken_for_an_earlier_one) {
    start_and_lose_the_device();
    const Bytes before = read_file(checkpoint());
    const Fault fault("lost:30");
    EXPECT_EQ(darb(training(run_) + " --kernel sinc").code, 2);
    EXPECT_EQ(read_file(run_ / "earlier.1" / "checkpoint.darb"), before);
    EXPECT_TRUE(!fs::exists(checkpoint()) || read_file(checkpoint()) != before);
}

}  // namespace
}  // namespace darb::test
