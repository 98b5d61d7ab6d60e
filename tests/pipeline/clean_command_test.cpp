// SPDX-License-Identifier: MIT
// darb clean, as a user runs it: what each rule leaves out of a scene whose clutter is known.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>

#include "engine/core/files.h"
#include "engine/core/rng.h"
#include "engine/scene/ply.h"
#include "engine/scene/splat_file.h"
#include "tests/support/run_command.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

constexpr std::size_t kBallSplats = 800, kFarSplats = 12, kHazeSplats = 5;

/// A ball of radius 1 at the origin, a small cluster at x = 1.6, and haze over the ball.
std::string cluttered_scene() {
    SplatModel m;
    Pcg32 rng(4);
    for (std::size_t i = 0; i < kBallSplats; ++i)
        append_splat(glm::normalize(glm::dvec3(rng.normal(), rng.normal(), rng.normal())),
                     glm::dvec3(0.08), 3, m);
    for (std::size_t i = 0; i < kFarSplats; ++i)
        append_splat({1.6 + 0.01 * double(i), 0, 0}, glm::dvec3(0.03), 3, m);
    for (std::size_t i = 0; i < kHazeSplats; ++i)
        append_splat({0.3 * double(i) - 0.6, 0, -1}, glm::dvec3(0.7), -3.5, m);
    const fs::path path = scratch() / "cluttered.ply";
    write_ply(path, m);
    return path.string();
}

std::string cameras_before_clutter() {
    nlohmann::json list = nlohmann::json::array();
    for (int i = 0; i < 4; ++i)
        list.push_back({{"id", i},
                        {"img_name", fmt::format("view_{}", i)},
                        {"width", 64},
                        {"height", 64},
                        {"position", {0.5 * i - 0.75, 0.0, -5.0}},
                        {"rotation", {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
                        {"fx", 64.0},
                        {"fy", 64.0}});
    const std::string file = scratch_file("before_it.json");
    write_file_atomic(file, list.dump());
    return file;
}

TEST(CleanCommand, Leaves_out_isolated_parts_where_no_rule_is_named) {
    const Outcome o = darb(fmt::format("clean '{}' -o '{}' --json '{}'", cluttered_scene(),
                                       scratch_file("clean.ply"), scratch_file("clean.json")));
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(load_splats(scratch_file("clean.ply")).size(), kBallSplats + kHazeSplats);
    const nlohmann::json report = read_json(scratch_file("clean.json"));
    EXPECT_EQ(report["together"]["splats"], kFarSplats);
    EXPECT_GT(report["together"]["light_share"], 0.0);
    EXPECT_LT(report["together"]["light_share"], 0.02);
}

TEST(CleanCommand, Shows_what_each_rule_would_take_and_writes_nothing) {
    const std::string json = scratch_file("dry.json");
    const Outcome o = darb(fmt::format(
        "clean '{}' --dry-run --cameras '{}' --isolated 0.01 --haze 0.1,5 --free-space 3 "
        "--few-views 2 --region sphere:0,0,0,1.5 --json '{}'",
        cluttered_scene(), cameras_before_clutter(), json));
    ASSERT_EQ(o.code, 0) << o.err;
    const nlohmann::json report = read_json(json);
    std::map<std::string, std::size_t> taken;
    for (const auto& rule : report["rules"]) taken[rule["rule"]] = rule["splats"];
    EXPECT_EQ(taken["isolated parts"], kFarSplats);
    EXPECT_EQ(taken["outside the region"], kFarSplats);
    EXPECT_EQ(taken["haze"], kHazeSplats);
    EXPECT_EQ(taken["in free space"], 0u) << "haze touches the ball";
    EXPECT_EQ(report["together"]["splats"], kFarSplats + kHazeSplats + taken["seen by few"]);
    EXPECT_EQ(report["output"], "");
}

// 0 is an answer: no part is light enough.
TEST(CleanCommand, Leaves_out_nothing_below_a_share_of_0) {
    const std::string json = scratch_file("nothing.json");
    const Outcome o =
        darb(fmt::format("clean '{}' --dry-run --isolated 0 --json '{}'", cluttered_scene(), json));
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(read_json(json)["together"]["splats"], 0);
}

TEST(CleanCommand, Says_what_is_wrong) {
    const std::string scene = cluttered_scene();
    const auto refused = [&](const std::string& more, const std::string& words) {
        const Outcome o = darb("clean '" + scene + "' " + more);
        EXPECT_EQ(o.code, 2) << more;
        EXPECT_NE(o.err.find(words), std::string::npos) << more << "\n" << o.err;
    };
    const std::string to = "-o '" + scratch_file("never.ply") + "' ";
    refused("", "names no output");
    refused(to + "--dry-run", "Leave out one of them");
    refused("-o '" + scratch_file("never.jpg") + "'", "names no format");
    refused(to + "--free-space 3", "--cameras");
    refused(to + "--few-views 3", "--cameras");
    refused(to + "--region cube:1", "sphere:X,Y,Z,RADIUS");
    refused(to + "--region box:1,1,1,0,2,2", "holds nothing");
    refused(to + "--region sphere:0,0,0,-1", "holds nothing");
    refused(to + "--region sphere:50,0,0,1", "nothing would be left");
    refused(to + "--haze 0.1", "--haze");
    refused(to + "--haze 5,0.1", "an opacity of 0 to 1");
    refused("-o '" + scene + "'", scene);
    EXPECT_FALSE(fs::exists(scratch_file("never.ply")));
}

}  // namespace
}  // namespace darb::test
