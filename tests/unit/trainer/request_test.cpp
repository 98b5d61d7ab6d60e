// SPDX-License-Identifier: MIT
// A training request is saved and read back as it was, also where its folder has moved, and a file
// that is not one names the entry that is wrong.
#include "trainer/job/request.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <map>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/kernels/kernel_expression.h"
#include "engine/kernels/kernel_registry.h"
#include "trainer/options/option_table.h"
#include "trainer/options/strategy.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class Request : public testing::Test {
  protected:
    void SetUp() override {
        fs::create_directories(folder_ / "photos");
        fs::create_directories(folder_ / "run");
    }
    void TearDown() override { fs::remove_all(folder_); }

    TrainRequest unusual() const {
        TrainRequest r;
        r.dataset = (folder_ / "photos").string();
        r.output = folder_ / "run";
        r.data.images_folder = "images_4";
        r.data.resolution = 4;
        r.data.hold_out = true;
        r.data.held_out = parse_hold_out("every:5,arc:8");
        r.data.depth_scale = 0.1;  // no float holds it
        r.data.original_lens = true;
        r.data.original_where_wide = false;
        r.sequential = true;
        r.frames = 77;
        use_schedule(r, "3dgs");
        r.train.random_background = true;  // what the schedule turned off
        r.train.iterations = 1'234;
        r.train.seed = 18446744073709551615ull;
        r.train.lambda_dssim = 0.3f;
        r.train.max_splats = 4294967295u;
        r.train.average_from = 0.123456789;
        r.train.kernel =
            register_kernel(kernel_from_expression("expr: (1 - q/9)^3, support 9", "--kernel"));
        r.train.start = StartPoints::points;
        r.effects = "none,+exposure";
        r.refine_cameras = "on";
        r.antialiasing = true;
        r.region = "box:0,0,0,1,1,1";
        r.drop_outside = true;
        r.clean_isolated = 0.02;
        r.clean_haze = "0.1,5";
        r.clean_free_space = 4;
        r.device = "llvm";
        r.tune = "scan=thread";
        r.test_iterations = {5, 6};
        r.checkpoint_interval = 9;
        r.report = false;
        r.page = true;
        r.start_checkpoint = folder_ / "other.darb";
        return r;
    }
    void write(const Json& json) const {
        write_file_atomic(folder_ / "run" / kRequestFile, json.dump());
    }
    void expect_refused(const Json& json, const std::string& entry) const {
        write(json);
        try {
            read_request(folder_ / "run");
            FAIL() << "taken: " << json.dump().substr(0, 200);
        } catch (const Error& e) {
            EXPECT_NE(std::string(e.what()).find(entry), std::string::npos) << e.what();
            EXPECT_NE(std::string(e.what()).find(kRequestFile), std::string::npos) << e.what();
            EXPECT_NE(e.hint, "");
        }
    }

    const fs::path folder_ =
        fs::path(testing::TempDir()) / ("darb_request_" + std::to_string(::getpid()));
};

TEST_F(Request, comes_back_as_it_was_asked) {
    for (const bool usual : {true, false}) {
        TrainRequest asked = usual ? TrainRequest{} : unusual();
        asked.dataset = (folder_ / "photos").string();
        asked.output = folder_ / "run";
        write_file_atomic(asked.output / kRequestFile, request_text(asked));
        const TrainRequest read = read_request(asked.output);
        EXPECT_EQ(request_text(read), request_text(asked));
        EXPECT_EQ(settings_json(read.train), settings_json(asked.train));
        EXPECT_TRUE(read.resume);
        EXPECT_TRUE(fs::equivalent(read.dataset, asked.dataset)) << read.dataset;
        EXPECT_EQ(read.train.kernel, asked.train.kernel);
        EXPECT_EQ(read.data.depth_scale, asked.data.depth_scale);
        EXPECT_EQ(read.train.average_from, asked.train.average_from);
    }
}

TEST_F(Request, follows_its_folder_and_its_photos_when_both_move) {
    const TrainRequest asked = unusual();
    write_file_atomic(asked.output / kRequestFile, request_text(asked));
    fs::create_directories(folder_ / "moved");
    for (const char* name : {"photos", "run"}) fs::rename(folder_ / name, folder_ / "moved" / name);
    const TrainRequest read = read_request(folder_ / "moved" / "run");
    EXPECT_TRUE(fs::equivalent(read.dataset, folder_ / "moved" / "photos")) << read.dataset;
}

TEST_F(Request, names_the_entry_that_is_wrong) {
    const Json good = Json::parse(request_text(unusual()));
    write(good);
    EXPECT_NO_THROW(read_request(folder_ / "run"));
    for (const auto& [key, value] : good.items()) {
        if (key == "kernel_definition") continue;  // then the kernel's name says it
        Json without = good;
        without.erase(key);
        expect_refused(without, "\"" + key + "\"");
    }
    for (const auto& [pointer, value] :
         std::map<std::string, Json>{{"/train/iterations", "x"},
                                     {"/train/iterations", 0.5},
                                     {"/train/densify-grad-threshold", nullptr},
                                     {"/train/random-background", 1},
                                     {"/data/resolution", "wide"},
                                     {"/data/dataset", 7},
                                     {"/start", "somewhere"},
                                     {"/effects", "+nonsense"},
                                     {"/refine_cameras", "maybe"},
                                     {"/test_iterations", {1, "a"}},
                                     {"/accuracy/evaluation", "best"},
                                     {"/unknown", 1},
                                     {"/train/unknown", 1},
                                     {"/format", 99}}) {
        SCOPED_TRACE(pointer);
        Json bad = good;
        bad[Json::json_pointer(pointer)] = value;
        write(bad);
        EXPECT_THROW(read_request(folder_ / "run"), Error);
    }
    for (const char* text : {"", "{}", "[1]", "nonsense", "null"}) {
        write_file_atomic(folder_ / "run" / kRequestFile, text);
        EXPECT_THROW(read_request(folder_ / "run"), Error) << text;
    }
}

TEST_F(Request, a_schedule_counts_less_than_what_is_asked_beside_it) {
    EXPECT_EQ(effects_beside("auto", "auto"), "auto");
    EXPECT_EQ(effects_beside("+sh", "auto"), "+sh");
    EXPECT_EQ(effects_beside("+sh", "auto,-sh"), "+sh,-sh");
    EXPECT_EQ(effects_beside("auto", "auto,-sh"), "-sh");
    EXPECT_EQ(effects_beside("+sh", "none"), "none");
    TrainRequest r;
    r.effects = "+lens";
    use_schedule(r, "3dgs");
    EXPECT_TRUE(r.effects.ends_with(",+lens")) << r.effects;
    EXPECT_THROW(use_schedule(r, "2dgs"), Error);
}

TEST_F(Request, of_things_that_contradict_each_other_is_refused) {
    TrainRequest r;
    r.train.exposure_grid = true;
    EXPECT_NO_THROW(check_request(r));
    r.effects = "-exposure";
    EXPECT_THROW(check_request(r), Error);
    r = {};
    r.schedule = "3dgs";
    r.train.strategy = *strategy_from_name("mcmc");
    EXPECT_THROW(check_request(r), Error);
    r = {};
    r.train.learn_kernel = 5;
    EXPECT_NO_THROW(check_request(r));
    r.train.kernel = KERNEL_BETA;
    EXPECT_THROW(check_request(r), Error);
    r.train.kernel = KERNEL_SINC_2_PULSES;
    EXPECT_THROW(check_request(r), Error);
}

}  // namespace
}  // namespace darb::test
