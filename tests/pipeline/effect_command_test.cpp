// SPDX-License-Identifier: MIT
// The effects by hand on the command line: what is refused, and what a lens that is left out does.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "engine/core/files.h"
#include "tests/support/run_command.h"
#include "tests/support/same_rounding.h"
#include "tests/support/test_data.h"

namespace darb {
namespace {

using nlohmann::json;
using namespace test;

using test::kScene;

TEST(EffectCommand, effects_begin_with_a_minus_or_a_base) {
    for (const char* effects : {"--effects -near", "--effects=-near", "--effects auto,-near"}) {
        const Outcome o = darb("plan " + kScene + " --no-price " + effects);
        EXPECT_EQ(o.code, 0) << effects << ": " << o.err;
        EXPECT_NE(o.out.find("near        off"), std::string::npos) << o.out;
        EXPECT_NE(o.out.find("alpha       off"), std::string::npos) << o.out;
    }
    const Outcome o = darb("plan " + kScene + " --no-price --effects none,+lens --json -");
    EXPECT_EQ(o.code, 0) << o.err;
    const json plan = json::parse(o.out);
    for (const json& row : plan["effects"])
        EXPECT_EQ(row["on"].get<bool>(), row["effect"] == "lens") << row.dump();
}

TEST(EffectCommand, effects_that_a_command_cannot_do_are_refused) {
    const std::string out = " -o " + (scratch() / "unused").string() + " --effects ";
    const std::string plan = "plan " + kScene + " --no-price --effects ";
    expect_refused({{"train " + kScene + out + "+depth", "no training photo has a measured depth"},
                    {"render a.ply --cameras b" + out + "+exposure", "'exposure' is nothing"},
                    {"render a.ply --cameras b" + out + "all,+alpha", "'alpha' is nothing"},
                    {"eval a.ply b --effects +depth", "'depth' is nothing"},
                    {"view a.ply --effects +alpha", "'alpha' is nothing"},
                    {plan + "none,+depth", "leave +depth out"},
                    {plan + "none --lens original", "keep the effect with +lens"}});
    EXPECT_EQ(darb(plan + "none,+alpha,-depth").code, 0);
    EXPECT_EQ(darb(plan + "none,+lens --lens original").code, 0);
}

TEST(EffectCommand, a_probe_decides_by_every_size_that_the_photos_have) {
    const std::string plan =
        "plan " + kScene +
        " --no-price --probe --probe-iterations 20 --effects +exposure --json - ";
    const Outcome o = darb(plan + "-r 4");
    ASSERT_EQ(o.code, 0) << o.err;
    const json result = json::parse(o.out), probe = result.at("probe");
    ASSERT_EQ(probe.at("sizes").size(), 4u);
    double gain = 0;
    for (const json& size : probe.at("sizes"))
        gain += size.at("with_psnr_db").get<double>() - size.at("without_psnr_db").get<double>();
    EXPECT_NEAR(probe.at("gain_db").get<double>(), gain / 4, 1e-9);
    EXPECT_EQ(probe.at("sizes")[3].at("width"), 200);
    for (const json& row : result.at("effects"))
        if (row["effect"] == "antialias") {
            EXPECT_TRUE(row["reason"].get<std::string>().starts_with("a probe: ")) << row;
        }
    const json trial = result.at("trials").at(0);
    EXPECT_EQ(trial.at("tried"), "--exposure-grid");
    EXPECT_NEAR(trial.at("gain_db").get<double>(),
                trial.at("psnr_db").get<double>() - trial.at("beside_psnr_db").get<double>(), 1e-9);
    EXPECT_NE(o.err.find("--exposure-grid, a probe of 20 iterations"), std::string::npos);
    expect_refused({{"plan " + kScene + "/none.ply --probe", "none.ply"},
                    {"plan " + kScene + " --probe-iterations 20", "--probe"}});
}

// Flat pictures of a fisheye have another size and another focal length than its photos.
TEST(EffectCommand, without_the_lens_effect_a_wide_fisheye_is_straightened_as_by_lens_undistort) {
    json cameras = json::parse(read_text_file(kScene + "/transforms_train.json"));
    for (json& frame : cameras["frames"])
        frame["file_path"] = kScene + "/" + frame["file_path"].get<std::string>();
    cameras["is_fisheye"] = true;
    cameras["fl_x"] = cameras["fl_y"] = 60;  // 95 degrees to a side
    const fs::path dataset = scratch() / "fisheye.json";
    std::ofstream(dataset) << cameras.dump();
    const auto trained = [&](const std::string& name, const std::string& options) {
        const fs::path out = scratch() / name;
        const Outcome o =
            darb(fmt::format("train {} -o {} -r 8 -q --eval --no-report --iterations 1 {}",
                             dataset.string(), out.string(), options));
        EXPECT_EQ(o.code, 0) << o.err;
        const json metrics = json::parse(read_text_file(out / "metrics.json"));
        return std::pair(read_text_file(out / "cameras.json"), metrics["evaluations"]);
    };
    const auto [cameras_of, evaluations] = trained("flat", "--lens undistort --effects none");
    const auto dropped = trained("dropped", "--effects none");
    const json camera = json::parse(cameras_of)[0];
    ASSERT_EQ(camera["width"], camera["height"]) << "60 degrees to each side, not the photo's";
    EXPECT_EQ(dropped.first, cameras_of);
    EXPECT_EQ(dropped.second[0]["psnr_db"], evaluations[0]["psnr_db"]);
    const auto measured = [&](const std::string& options) {
        const fs::path file = scratch() / "measured.json";
        const Outcome o =
            darb(fmt::format("eval {} {} -r 8 --json {} {}", (scratch() / "flat").string(),
                             dataset.string(), file.string(), options));
        EXPECT_EQ(o.code, 0) << o.err;
        return json::parse(read_text_file(file));
    };
    const json left_out = measured("--effects all,-lens"),
               straight = measured("--effects all --lens undistort");
    if (rounds_every_operation()) {
        EXPECT_EQ(left_out, straight);
    }
    EXPECT_NEAR(left_out["mean"]["psnr_db"].get<double>(),
                straight["mean"]["psnr_db"].get<double>(), 1e-3);
}

TEST(EffectCommand, the_plan_prices_the_lens_where_photos_are_distorted_long) {
    const auto lens_row = [](const fs::path& dataset) {
        const Outcome o = darb("plan " + dataset.string() + " -r 8 --json -");
        EXPECT_EQ(o.code, 0) << o.err;
        const json plan = json::parse(o.out);
        for (const json& row : plan["effects"])
            if (row["effect"] == "lens") return row;
        return json::object();
    };
    json cameras = json::parse(read_text_file(kScene + "/transforms_train.json"));
    for (json& frame : cameras["frames"])
        frame["file_path"] = kScene + "/" + frame["file_path"].get<std::string>();
    const fs::path straight = scratch() / "straight.json", distorted = scratch() / "distorted.json";
    std::ofstream(straight) << cameras.dump();
    cameras["k1"] = 0.05;
    std::ofstream(distorted) << cameras.dump();
    EXPECT_FALSE(lens_row(straight).contains("price"));
    const json row = lens_row(distorted);
    EXPECT_EQ(row["on"], false) << row.dump();
    ASSERT_TRUE(row.contains("price")) << row.dump();
    EXPECT_GT(row["price"]["bytes"].get<int>(), 0) << "cameras without a lens were measured";
}

}  // namespace
}  // namespace darb
