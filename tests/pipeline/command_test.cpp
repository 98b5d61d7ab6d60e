// SPDX-License-Identifier: MIT
// The built darb command, as a user runs it: exit codes, what errors name, and what info and
// devices print.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/core/files.h"
#include "engine/core/scope_guard.h"
#include "engine/data/depth_io.h"
#include "engine/data/image_io.h"
#include "engine/scene/ply.h"
#include "tests/support/run_command.h"
#include "tests/support/test_data.h"

namespace darb {
namespace {

using nlohmann::json;
using namespace test;

using test::kScene;

TEST(Command, bad_usage_is_exit_code_2) {
    const std::string out = " -o " + (scratch() / "unused").string() + " ";
    const std::string train = "train " + kScene + out;
    const std::string ply = (scratch() / "itself.ply").string();
    std::ofstream{ply};
    const std::string render = "render a.ply --cameras b" + out;
    expect_refused({{"", "subcommand"},
                    {"no_such", "no_such"},
                    {"train --no-such-option", "--no-such-option"},
                    {"train --resume", "no output folder"},
                    {"train" + out, "no data set"},
                    {train + "--sh_degree 4", "--sh-degree 4: must be a whole number from 0 to 3"},
                    {train + "--kernel no_such", "no such kernel"},
                    {train + "--footprint no_such", "psi, exact"},
                    {train + "--effects no_such", "'no_such' is no effect"},
                    {train + "--effects lens", "+lens or -lens"},
                    {train + "--effects -no_such", "'-no_such' is no effect"},
                    {train + "--accuracy high", "fast, balanced or exact"},
                    {train + "--alpha-cutoff 1/2", "1/255, 1/1024, 1/64"},
                    {train + "--depth-order pixel", "no backward pass"},
                    {train + "--render-scale 1/2", "-r 2"},
                    {train + "--strategy no_such", "no such strategy"},
                    {train + "--strategy mcmc --densify_grad_threshold 1e-4", "--strategy mcmc"},
                    {train + "--exposure-grid --effects none", "--effects none"},
                    {train + "--exposure-grid --effects=-exposure", "--effects -exposure"},
                    {train + "--noise-lr 0.1", "goes with --strategy mcmc"},
                    {train + "--resolution-ramp maybe", "--resolution-ramp"},
                    {train + "--kernel beta --html", "convert --kernel gaussian"},
                    {"eval", "scene"},
                    {"eval a.ply b --split no_such", "--split"},
                    {"render a.ply -o b --depth png", "--depth"},
                    {render + "--render-scale 1/2 --depth png", "Add --render-scale 1."},
                    {render + "--render-scale 1/2 --effects +depth", "Add --render-scale 1."},
                    {render + "--accuracy fast --effects +depth", "Add --storage float32."},
                    {render + "--depth npy --effects=-depth", "leave --depth out"},
                    {render + "--near 1e39", "finite number"},
                    {"info", "path"},
                    {"plan " + kScene + " --depth", "this is a data set"},
                    {"plan " + kScene + " --cameras a", "this is a data set"},
                    {"cost a.ply --quick --full", "--full"},
                    {"cost a.ply --seeds 2", "--train"},
                    {"cost a.ply b --size 64x64", "--size"},
                    {"cost --train " + kScene + " --train-options='--accuracy fast'",
                     "each row of the measurement"},
                    {"check --reference", "--dump"},
                    {"check --every-kernel --scene a --cameras b --dump c", "--every-kernel"},
                    {"check --scene a.ply", "belong together"},
                    {"check --json a --scene a.ply --cameras b --dump c", "--json"},
                    {"check --device no_such_device", "no_such_device"},
                    {"check --tune backward=no_such", "|buckets"},
                    {"devices --device no_such_device", "no_such_device"},
                    {"train " + kScene + " -o unused --lambda-dssim nan", "finite number"},
                    {"train " + kScene + " -o unused --opacity-reg=inf", "finite number"},
                    {"sim1d --signals ''", "--signals"},
                    {"psi --json ''", "--json: has an empty value"},
                    {"psi --json=", "--json: has an empty value"},
                    {"plan " + kScene + " --kernel sin", "no such kernel"},
                    {"plan " + ply + " --kernel sinc", "is for a data set, and this is a scene"},
                    {"convert " + ply + " " + ply, "is what is read"}});
}

TEST(Command, missing_files_are_named) {
    const std::string none = scratch() / "none";
    expect_refused({{"train " + none + " -o " + none + "_out", none},
                    {"train " + kScene + " -i no_photos -o " + none + "_out", "no_photos"},
                    {"train --resume -o " + none, "request.json"},
                    {"eval " + none + ".ply " + kScene, none + ".ply"},
                    {"render " + none + ".ply --cameras " + kScene + " -o " + none, none + ".ply"},
                    {"info " + none + ".ply", none + ".ply"},
                    {"info " + std::string(DARB_SOURCE_DIR) + "/README.md", "no splat file"},
                    {"info " + std::string(DARB_SOURCE_DIR) + "/assets", "holds no cameras"}});
    EXPECT_FALSE(fs::exists(none + "_out"));
    // What the file system itself refuses.
    const std::string long_name(300, 'x');
    expect_refused({{"info " + long_name, long_name + ": File name too long\n  "},
                    {"train " + long_name + " -o " + none + "_out", "File name too long"}});
}

TEST(Command, a_refused_option_does_not_steer_the_terminal) {
    const Outcome bad = darb("info a --no$(printf '\\033')[2J");
    EXPECT_EQ(bad.code, 2);
    EXPECT_EQ(bad.err.find('\x1b'), std::string::npos);
    EXPECT_NE(bad.err.find("--no\\x1b[2J"), std::string::npos) << bad.err;
}

TEST(Command, a_run_of_a_version_without_requests_says_how_to_go_on) {
    const fs::path run = scratch() / "old_run";
    write_file_atomic(run / "command.json", R"(["train","data","-o","out"])");
    expect_refused({{"train --resume -o " + run.string(), "Repeat the whole command"}});
    write_file_atomic(run / "request.json", "{}");
    expect_refused({{"train --resume -o " + run.string(), (run / "request.json").string()}});
}

TEST(Command, depths_of_another_folder_say_where_they_are_read_from) {
    const std::string train =
        fmt::format("train {} -o {} ", kScene, (scratch() / "unused").string());
    const std::string folder = (fs::path(kScene) / "depths").string();
    std::vector<BadCommand> commands;
    for (const char* option : {"-d depths", "--depths lidar"})
        commands.push_back({train + option, "Put them into " + folder});
    commands.push_back({train + "-d depths --effects -depth", "means nothing with --effects"});
    commands.push_back({train + "-d depths --effects none", "means nothing with --effects"});
    expect_refused(commands);
}

TEST(Command, depths_trains_with_the_measured_depths_of_the_data_set) {
    const fs::path set = scratch() / "with_depths";
    fs::remove_all(set);
    fs::copy(kScene, set, fs::copy_options::recursive);
    for (const auto& photo : fs::directory_iterator(set / "images")) {
        const ImageInfo size = read_image_info(photo.path());
        ImageF depth(size.width, size.height, 1);
        std::fill(depth.data.begin(), depth.data.end(), 3.0f);
        write_depth_png(set / "depth" / photo.path().filename().replace_extension(".png"), depth,
                        1e-3);
    }
    const std::string train =
        fmt::format("train {} -r 8 --iterations 2 -q -o {} ", set.string(), (set / "out").string());
    for (const std::string& option :
         {std::string("-d depth"), "--depths " + (set / "depth").string(),
          std::string("--depths depth --effects -exposure"), std::string("--effects +depth")}) {
        const Outcome o = darb(train + option);
        ASSERT_EQ(o.code, 0) << option << ": " << o.err;
        const json metrics = json::parse(read_text_file(set / "out" / "metrics.json"));
        bool on = false;
        for (const json& effect : metrics["effects"])
            on |= effect["effect"] == "depth" && effect["on"] == true;
        EXPECT_TRUE(on) << option;
    }
}

TEST(Command, files_and_folders_may_have_names_that_look_like_numbers) {
    const fs::path folder = scratch() / "numbers";
    fs::remove_all(folder);
    fs::create_directories(folder);
    const ScopeGuard back([before = fs::current_path()] { fs::current_path(before); });
    fs::current_path(folder);
    for (const char* name : {"inf", "nan", "1e999", "Infinity"}) {
        fs::copy(kScene, folder / name, fs::copy_options::recursive);
        const Outcome info = darb(fmt::format("info {}", name));
        EXPECT_EQ(info.code, 0) << info.err;
        EXPECT_NE(info.out.find("views"), std::string::npos) << info.out;
        const Outcome trained =
            darb(fmt::format("train {} -q -r 8 --iterations 2 -o run_{}", name, name));
        ASSERT_EQ(trained.code, 0) << trained.err;
        fs::rename(folder / ("run_" + std::string(name)), folder / "nan.run");
        const Outcome out = darb("convert nan.run nan.ply");
        EXPECT_EQ(out.code, 0) << out.err;
        const Outcome resumed = darb("train --resume -q -o nan.run");
        EXPECT_EQ(resumed.code, 0) << resumed.err;
        const ScopeGuard brought([&] { fs::remove_all(folder / "nan.run"); });
        fs::rename(folder / name, folder / "new place");
        expect_refused({{"train --resume -q -o nan.run", "with the place where its photos are"}});
        const Outcome there = darb("train 'new place' --resume -q -r 8 --iterations 2 -o nan.run");
        EXPECT_EQ(there.code, 0) << there.err;
        fs::remove_all(folder / "new place");
    }
    expect_refused({{"render a.ply -o frames --near nan", "--near nan: is no number"},
                    {"render a.ply -o frames --near=-inf", "--near"},
                    {"convert a.ply b.ply --scale 1e999", "--scale 1e999: is no number"}});
}

TEST(Command, a_quiet_run_is_warned_and_logs_its_forecast) {
    const fs::path run = scratch() / "quiet_run";
    const std::string train = fmt::format("train {} -q -r 8 -o {} ", kScene, run.string());
    const Outcome trained = darb(train + "--iterations 2");
    ASSERT_EQ(trained.code, 0) << trained.err;
    EXPECT_EQ(trained.err, "");
    const std::string log = read_text_file(run / "run.jsonl");
    const json start = json::parse(log.substr(0, log.find('\n')));
    EXPECT_GT(start.at("forecast").at("start_splats"), 0) << start;

    ::setenv("DARB_FAULT", "oom:splat shape", 1);  // it ends once the plan is there
    const ScopeGuard clear([] { ::unsetenv("DARB_FAULT"); });
    const Outcome large = darb(train + "--strategy budget --budget 1000000000");
    EXPECT_EQ(large.code, 2);
    EXPECT_NE(large.err.find("warning: more than the"), std::string::npos) << large.err;
    EXPECT_EQ(large.err.find("forecast:"), std::string::npos) << large.err;
}

TEST(Command, help_and_version_are_exit_code_0) {
    for (const char* arguments :
         {"--help", "train --help", "eval --help", "render --help", "info --help", "convert --help",
          "devices --help", "check --help", "--version"})
        EXPECT_EQ(darb(arguments).code, 0) << arguments;
}

TEST(Command, devices_marks_the_chosen_one) {
    const Outcome o = darb("devices");
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.out.find("* 0"), std::string::npos) << o.out;
    EXPECT_NE(o.out.find("chosen: 0"), std::string::npos) << o.out;
    EXPECT_NE(o.out.find("backward="), std::string::npos) << o.out;
}

TEST(Command, check_passes_on_this_device_slow) {
    const std::string file = scratch() / "check.json";
    const Outcome o = darb("check --json " + file);
    EXPECT_EQ(o.code, 0) << o.out;
    EXPECT_NE(o.out.find(", 0 failed: PASS"), std::string::npos) << o.out;
    const json check = json::parse(read_text_file(file));
    EXPECT_EQ(check["failed"], 0);
    EXPECT_GT(check["checks"].size(), 100U);
    for (const char* key : {"version", "device", "driver"}) EXPECT_NE(check[key], "") << key;
}

TEST(Command, info_describes_a_data_set) {
    const Outcome text = darb("info " + kScene);
    EXPECT_EQ(text.code, 0) << text.err;
    EXPECT_NE(text.out.find("COLMAP binary"), std::string::npos) << text.out;
    const json info = json::parse(darb("info --json - -r 2 " + kScene).out);
    EXPECT_EQ(info["views"], 48);
    EXPECT_EQ(info["points"], 4000);
    EXPECT_EQ(info["sizes"], json::parse(R"([{"width": 100, "height": 75, "views": 48}])"));
    EXPECT_EQ(info["lenses"][0]["model"], "PINHOLE");
    EXPECT_EQ(info["lenses"][0]["width"], 200);
    EXPECT_GT(info["extent"].get<double>(), 1.0);
    EXPECT_EQ(json::parse(darb("info --json - " + kScene + "/transforms_train.json").out)["views"],
              40);
}

TEST(Command, info_refuses_a_point_cloud_and_reads_a_camera_list) {
    const auto data = test::test_data_folder();
    if (!data) GTEST_SKIP() << test::kNoTestData;
    const std::string inria = *data / "fixtures" / "inria_miku_output";
    expect_refused({{"info " + inria + "/input.ply", "is a point cloud"}});
    const json info = json::parse(darb("info --json - " + inria + "/cameras.json").out);
    EXPECT_EQ(info["views"], 97);
    EXPECT_EQ(info["source"], "cameras.json");
}

TEST(Command, info_warns_of_odd_splats) {
    SplatModel model;
    model.resize(6);
    for (size_t i = 0; i < model.size(); ++i) {
        model.rotation[4 * i] = 1;
        model.position[3 * i] = static_cast<float>(i);
        for (size_t a = 0; a < 3; ++a) model.log_scale[3 * i + a] = -4;
    }
    model.position[0] = std::numeric_limits<float>::quiet_NaN();
    model.rotation[4] = 0;
    model.log_scale[6] = 5;        // huge, and a needle
    model.log_scale[9] = 0.65f;    // a needle
    model.opacity_logit[4] = 20;   // 1
    model.opacity_logit[5] = -20;  // 0
    const std::string file = scratch() / "odd.ply", none = scratch() / "none.ply";
    write_ply(file, model);
    const json info = json::parse(darb("info --json - " + file).out);
    EXPECT_EQ(info["splats"], 5);
    for (const auto& [key, count] : std::map<std::string, int>{{"dropped", 1},
                                                               {"zero_rotations", 1},
                                                               {"huge", 1},
                                                               {"needles", 2},
                                                               {"saturated", 1},
                                                               {"invisible", 1}})
        EXPECT_EQ(info[key], count) << key;
    EXPECT_EQ(info["warnings"].size(), 6U);
    write_ply(none, SplatModel{});
    const Outcome empty = darb("info " + none);
    EXPECT_EQ(empty.code, 0) << empty.err;
    EXPECT_NE(empty.out.find("there are no splats"), std::string::npos) << empty.out;
}

TEST(Command, train_without_a_report_writes_none) {
    const fs::path out = scratch() / "no_report";
    const std::string train =
        fmt::format("train {} -o {} -r 8 --iterations 1 -q ", kScene, out.string());
    EXPECT_EQ(darb(train + "--no-report").code, 0);
    EXPECT_TRUE(fs::exists(out / "metrics.json"));
    EXPECT_FALSE(fs::exists(out / "report.html"));
    EXPECT_EQ(darb(train).code, 0);
    EXPECT_TRUE(fs::exists(out / "report.html"));
}

TEST(Command, train_holds_out_with_eval_alone) {
    const std::string train = fmt::format("train {} -o {} -r 8 --iterations 1 --no-report ", kScene,
                                          (scratch() / "all").string());
    const Outcome all = darb(train), held_out = darb(train + "--eval");
    EXPECT_NE(all.err.find("48 photos to train on, 0 held out"), std::string::npos) << all.err;
    EXPECT_NE(all.err.find("own test views, 8, are trained on"), std::string::npos) << all.err;
    EXPECT_NE(held_out.err.find("40 photos to train on, 8 held out"), std::string::npos);
    EXPECT_EQ(held_out.err.find("are trained on"), std::string::npos) << held_out.err;
}

TEST(Command, train_begins_with_a_forecast) {
    const Outcome o = darb(
        fmt::format("train {} -o {} -r 4 --iterations 1", kScene, (scratch() / "one").string()));
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.err.find("forecast: 1 iterations, 4,000 splats at the end; "), std::string::npos)
        << o.err;
    EXPECT_NE(o.err.find("of device memory"), std::string::npos) << o.err;
}

}  // namespace
}  // namespace darb
