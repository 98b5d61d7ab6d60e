// SPDX-License-Identifier: MIT
// darb train --blocks as a user runs it: the joined scene, a block that is killed or fails and is
// resumed, and what is refused.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_file.h"
#include "tests/support/child.h"

namespace darb::test {
namespace {

class BlocksCommand : public testing::Test {
  protected:
    void TearDown() override {
        fs::remove_all(whole_);
        fs::remove_all(other_);
    }
    static std::vector<std::string> training(const fs::path& output) {
        return {"train",
                std::string(DARB_SOURCE_DIR) + "/assets/scene",
                "-o",
                output.string(),
                "-r",
                "8",
                "-q",
                "--iterations",
                "24",
                "--checkpoint-interval",
                "8",
                "--densify-from-iter",
                "10",
                "--densification-interval",
                "10",
                "--cap-max",
                "3000",
                "--no-report",
                "--max-memory",
                "200MB",
                "--blocks",
                "2x1"};
    }
    static std::string words(const std::vector<std::string>& arguments) {
        std::string text;
        for (const std::string& word : arguments) text += word + " ";
        return text;
    }
    static fs::path scene(const fs::path& output) {
        return output / "point_cloud/iteration_24/point_cloud.ply";
    }
    static nlohmann::json manifest(const fs::path& output) {
        return nlohmann::json::parse(read_text_file(output / "blocks/manifest.json"));
    }
    // Exit code 2, and an error that has all of these.
    static void expect_refused(const std::string& arguments, const std::vector<std::string>& says) {
        const Outcome outcome = darb(arguments);
        EXPECT_EQ(outcome.code, 2) << arguments;
        for (const std::string& text : says)
            EXPECT_NE(outcome.err.find(text), std::string::npos)
                << arguments << ": " << text << " in " << outcome.err;
    }
    const fs::path whole_ = scratch() / "whole", other_ = scratch() / "other";
};

void expect_cells_of(const SplatModel& joined, const nlohmann::json& manifest) {
    const auto axis = manifest["u"].get<std::vector<double>>();
    const double cut = manifest["blocks"][0]["high"][0].get<double>();
    std::size_t low = 0;
    for (std::size_t i = 0; i < joined.size(); ++i) {
        const glm::dvec3 at = position_of(joined, i);
        const bool is_low = at.x * axis[0] + at.y * axis[1] + at.z * axis[2] < cut;
        low += is_low ? 1 : 0;
        EXPECT_EQ(is_low, i < manifest["blocks"][0]["kept"]) << i << ": beyond its cell";
    }
    EXPECT_GT(low, 100u);
    EXPECT_GT(joined.size() - low, 100u);
}

// The quick test of the whole: bytes of an undisturbed run, from one that was killed within a
// block.
TEST_F(BlocksCommand, joins_cells_and_resumes_a_killed_block_to_the_same_bytes) {
    ASSERT_EQ(darb(words(training(whole_))).code, 0);
    const nlohmann::json done = manifest(whole_);
    expect_cells_of(load_splats(scene(whole_)), done);
    for (const nlohmann::json& block : done["blocks"]) {
        EXPECT_EQ(block["state"], "done");
        EXPECT_GT(block["frozen"], 0);
        EXPECT_GE(block["views"].size(), 3u);
        EXPECT_GT(block["peak_device_bytes"], 100'000);
        EXPECT_LE(block["peak_device_bytes"], 200'000'000);
    }
    {
        Child child(training(other_), scratch());
        const fs::path checkpoint = other_ / "blocks/0x0/checkpoint.darb";
        while (child.running() && !fs::exists(checkpoint)) ::usleep(200);
        ASSERT_TRUE(child.running()) << child.err();
        child.send(SIGKILL);
        child.wait();
    }
    EXPECT_EQ(manifest(other_)["blocks"][0]["state"], "training");
    const Outcome resumed = darb("train --resume -q -o " + other_.string());
    ASSERT_EQ(resumed.code, 0) << resumed.err;
    EXPECT_EQ(read_file(scene(other_)), read_file(scene(whole_)));
}

TEST_F(BlocksCommand, what_it_cannot_do_is_refused) {
    const std::string train = "train " + std::string(DARB_SOURCE_DIR) +
                              "/assets/scene -q -r 8 -o " + other_.string() + " --blocks ";
    expect_refused(train + "0x2", {"--blocks 0x2", "Use auto, or columns and rows"});
    for (const char* grid : {"abc", "2", "2x", "x2", "2x2x2", "-1x2", "99x1", "2 x2"})
        expect_refused(train + "'" + grid + "'", {std::string("--blocks ") + grid});
    expect_refused(train + "2x1 --start dense", {"--start dense", "--start auto"});
    expect_refused(train + "2x1 --html", {"--html", "darb convert"});
    expect_refused(train + "2x1 --save-iterations 5", {"--save-iterations"});
    expect_refused(train + "2x1 --effects +exposure", {"exposure"});
    EXPECT_FALSE(fs::exists(other_ / "blocks"));
}

// A block that cannot be written is named; the others are done, and it alone is tried again.
TEST_F(BlocksCommand, a_failed_block_is_named_and_resumed_long) {
    ASSERT_EQ(darb(words(training(whole_))).code, 0);
    {
        Child child(training(other_), scratch());
        while (child.running() && !fs::exists(other_ / "blocks/manifest.json")) ::usleep(200);
        write_file_atomic(other_ / "blocks/1x0", std::string_view("no folder"));
        EXPECT_EQ(child.wait(), 2);
        EXPECT_NE(child.err().find("block 1x0"), std::string::npos) << child.err();
        EXPECT_NE(child.err().find("--resume"), std::string::npos) << child.err();
    }
    EXPECT_EQ(manifest(other_)["blocks"][0]["state"], "done");
    EXPECT_EQ(manifest(other_)["blocks"][1]["state"], "failed");
    EXPECT_FALSE(fs::exists(scene(other_)));
    fs::remove(other_ / "blocks/1x0");
    std::vector<std::string> again = training(other_);
    again.back() = "3x1";
    again.emplace_back("--resume");
    expect_refused(words(again), {"manifest.json", "2x1 then, 3x1 now"});
    again.back() = "--seed=5";
    again[again.size() - 2] = "2x1";
    again.emplace_back("--resume");
    expect_refused(words(again), {"seed: 0 then, 5 now"});
    ASSERT_EQ(darb("train --resume -q -o " + other_.string()).code, 0);
    EXPECT_EQ(read_file(scene(other_)), read_file(scene(whole_)));
}

TEST_F(BlocksCommand, auto_finds_blocks_that_fit_the_memory_and_stays_within_it_long) {
    std::vector<std::string> arguments = training(whole_);
    arguments.back() = "auto";
    arguments[arguments.size() - 3] = "4000KB";
    ASSERT_EQ(darb(words(arguments)).code, 0);
    const nlohmann::json done = manifest(whole_);
    EXPECT_GT(done["blocks"].size(), 1u);
    for (const nlohmann::json& block : done["blocks"])
        EXPECT_LE(block["peak_device_bytes"], 4'000'000);
    arguments[arguments.size() - 3] = "100KB";
    expect_refused(words(arguments), {"--blocks auto", "--max-memory"});
}

}  // namespace
}  // namespace darb::test
