// SPDX-License-Identifier: MIT
// What a run leaves in its folder for later: paths that move with it, files that no run writes, a
// failed report, and a start without memory. For the command.
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <vector>

#include "engine/core/count_text.h"
#include "engine/core/error.h"
#include "engine/data/point_cloud_ply.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_file.h"
#include "tests/support/run_command.h"
#include "trainer/step/checkpoint.h"

namespace darb::test {
namespace {

using nlohmann::json;
using Bytes = std::vector<std::byte>;

class RunFiles : public testing::Test {
  protected:
    void SetUp() override {
        fs::create_directories(data());
        const fs::path scene = fs::path(DARB_SOURCE_DIR) / "assets" / "scene";
        fs::copy(scene / "images", data() / "images");
        fs::copy(scene / "sparse", data() / "sparse", fs::copy_options::recursive);
    }
    void TearDown() override { fs::remove_all(folder_); }

    fs::path data() const { return folder_ / "photos"; }
    fs::path run() const { return folder_ / "out" / "run"; }
    static constexpr const char* kOptions = " -r 8 -q --iterations 4 --eval";
    Outcome train(const std::string& options = "") const {
        return darb(fmt::format("train '{}' -o '{}' {} {}", data().string(), run().string(),
                                kOptions, options));
    }
    Outcome resume() const { return darb("train --resume -q -o " + run().string()); }
    void edit(const char* name, const std::function<void(json&)>& change) const {
        json content = json::parse(read_text_file(run() / name));
        change(content);
        std::ofstream(run() / name) << content.dump();
    }
    void expect_input_error(const Outcome& o, const std::vector<std::string>& parts) const {
        EXPECT_EQ(o.code, 2) << o.err;
        for (const std::string& part : parts)
            EXPECT_NE(o.err.find(part), std::string::npos) << "no '" << part << "' in: " << o.err;
        EXPECT_EQ(o.err.find("json.exception"), std::string::npos) << o.err;
        EXPECT_NE(o.err.find("\n  "), std::string::npos) << "no remedy: " << o.err;
    }
    void forget_points() const {
        fs::remove_all(data() / "sparse" / "0");
        fs::copy(fs::path(DARB_SOURCE_DIR) / "assets" / "scene" / "transforms_train.json",
                 data() / "transforms_train.json");
    }
    // Trained for 2 iterations and then interrupted.
    void leave_unfinished(const std::string& options = "") const {
        ASSERT_EQ(train("--checkpoint-iterations 2 " + options).code, 0);
        fs::rename(run() / "chkpnt2.darb", run() / "checkpoint.darb");
        edit("metrics.json", [](json& m) {
            m["iteration"] = 2;
            m["interrupted"] = true;
        });
    }

    const fs::path folder_ = scratch() / "run_files";
};

TEST_F(RunFiles, name_no_folder_of_the_machine_and_move_with_the_data) {
    leave_unfinished("--images " + (data() / "images").string());
    for (const auto& entry : fs::recursive_directory_iterator(run())) {
        const std::string name = entry.path().extension().string();
        if (!entry.is_regular_file() || name == ".ply" || name == ".png" || name == ".darb")
            continue;
        EXPECT_EQ(read_text_file(entry.path()).find(folder_.string()), std::string::npos)
            << entry.path();
    }
    const fs::path moved = scratch() / "moved";
    fs::remove_all(moved);
    fs::rename(folder_, moved);
    const Outcome o = darb("train --resume -q -o " + (moved / "out" / "run").string());
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_TRUE(fs::exists(moved / "out/run/point_cloud/iteration_4/point_cloud.ply"));
    fs::remove_all(moved);
}

TEST_F(RunFiles, a_report_that_failed_is_written_by_resume) {
    ASSERT_EQ(train().code, 0);
    const std::string report = read_text_file(run() / "report.html");
    const std::string metrics = read_text_file(run() / "metrics.json");
    fs::remove(run() / "report.html");
    const Outcome o = resume();
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(read_text_file(run() / "report.html"), report);
    EXPECT_EQ(read_text_file(run() / "metrics.json"), metrics);
}

TEST_F(RunFiles, values_of_another_type_are_errors_of_input) {
    leave_unfinished();
    const std::string log = read_text_file(run() / "run.jsonl");
    const auto with_line = [&](const std::string& line) {
        std::ofstream(run() / "run.jsonl") << log << line << "\n" << log;
        const Outcome o = resume();
        std::ofstream(run() / "run.jsonl") << log;
        return o;
    };
    const int line = int(std::count(log.begin(), log.end(), '\n')) + 1;
    const std::string where = fmt::format("run.jsonl, line {}", line);
    expect_input_error(with_line(R"({"event": 7})"), {where, "'event' is no text: 7"});
    expect_input_error(with_line(R"({"event": "iteration", "iteration": "9"})"),
                       {where, "'iteration'"});
    expect_input_error(with_line(R"({"event": "evaluation", "iteration": 1, "views": [3]})"),
                       {where, "no JSON object"});
    expect_input_error(with_line("[1]"), {where});
    expect_input_error(with_line("{\"event"), {where});
    const std::string request = read_text_file(run() / "request.json");
    for (const char* text : {"{}", "[1]", "nonsense"}) {
        std::ofstream(run() / "request.json") << text;
        expect_input_error(resume(), {"request.json"});
    }
    std::ofstream(run() / "request.json") << request;
    ASSERT_EQ(resume().code, 0) << "as it was";
    edit("metrics.json", [](json& m) { m["interrupted"] = "no"; });
    expect_input_error(resume(), {"metrics.json", "'interrupted' is neither true nor false"});
    edit("metrics.json", [](json& m) {
        m["interrupted"] = false;
        m["iteration"] = 1e300;
    });
    expect_input_error(resume(), {"metrics.json", "'iteration' is no whole number"});
}

// Steps of the opacity's logit by 2, downwards for all that no photo holds up.
TEST_F(RunFiles, what_is_too_transparent_to_be_drawn_is_not_saved) {
    const Outcome o =
        darb(fmt::format("train '{}' -o '{}' -r 8 --iterations 4 --eval --opacity-lr 2 "
                         "--opacity-reg 10 --save-iterations 2 "
                         "--checkpoint-iterations 4",
                         data().string(), run().string()));
    ASSERT_EQ(o.code, 0) << o.err;
    const json metrics = json::parse(read_text_file(run() / "metrics.json"));
    const auto saved = metrics.at("saved_splats").get<std::size_t>(),
               undrawn = metrics.at("undrawn_splats").get<std::size_t>(),
               all = metrics.at("splats").get<std::size_t>();
    EXPECT_GT(undrawn, 0u);
    EXPECT_EQ(saved + undrawn, all);
    EXPECT_EQ(load_splats(run() / "point_cloud" / "iteration_4" / "point_cloud.ply").size(), saved);
    EXPECT_EQ(read_checkpoint(run() / "chkpnt4.darb").state.model.size(), all)
        << "a run goes on with all of them";
    EXPECT_NE(
        o.out.find(fmt::format("drawn {} were left out, and 0 had left", count_text(undrawn))),
        std::string::npos)
        << o.out;
}

/// The splats that a run saved, in a sphere and outside of it.
struct Regional {
    std::size_t inside = 0, outside = 0;
};
Regional counted_by(const fs::path& run, int iteration, const glm::dvec3& centre, double radius) {
    const SplatModel m = load_splats(run / "point_cloud" / fmt::format("iteration_{}", iteration) /
                                     "point_cloud.ply");
    Regional counts;
    for (std::size_t i = 0; i < m.size(); ++i)
        ++(glm::distance(position_of(m, i), centre) <= radius ? counts.inside : counts.outside);
    return counts;
}

// So low a threshold lets every splat grow that a frame has seen.
TEST_F(RunFiles, a_region_grows_alone_and_what_is_outside_of_it_may_go) {
    const std::string options = fmt::format(
        "train '{}' -o '{}' -r 8 --iterations 8 --eval --densify-from-iter 1 "
        "--densification-interval 2 --densify-until-iter 7 --densify-grad-threshold 1e-9 "
        "--save-iterations 1 --opacity-reg 0 --scale-reg 0 --clearance 0 -q ",
        data().string(), run().string());
    const glm::dvec3 centre(0, 0, 0);
    constexpr double kRadius = 1.2;
    const auto trained = [&](const std::string& more) {
        const Outcome o = darb(options + more);
        ASSERT_EQ(o.code, 0) << o.err;
    };
    trained("");
    const Regional start = counted_by(run(), 1, centre, kRadius);
    const Regional everywhere = counted_by(run(), 8, centre, kRadius);
    ASSERT_GT(start.outside, 50u);
    ASSERT_GT(everywhere.outside, start.outside + 20);
    trained("--roi sphere:0,0,0,1.2");
    const Regional alone = counted_by(run(), 8, centre, kRadius);
    EXPECT_LE(alone.outside, start.outside + 5) << "a few may move across its border";
    EXPECT_GT(alone.inside, start.inside + 20);
    EXPECT_EQ(read_json(run() / "request.json").at("roi"), "sphere:0,0,0,1.2");
    trained("--roi sphere:0,0,0,1.2 --drop-outside --clean-haze 0.2,1.5");
    const Regional cut = counted_by(run(), 8, centre, kRadius);
    EXPECT_EQ(cut.outside, 0u);
    EXPECT_LT(cut.inside, alone.inside) << "haze went as well";
    EXPECT_GT(cut.inside, 0u);
    const std::string log = read_text_file(run() / "run.jsonl");
    const std::size_t at = log.find("\"event\":\"cleaned\"");
    ASSERT_NE(at, std::string::npos);
    const std::size_t begin = log.rfind('\n', at) + 1;
    const json cleaned = json::parse(log.substr(begin, log.find('\n', at) - begin));
    ASSERT_EQ(cleaned.at("rules").size(), 3u);
    EXPECT_EQ(cleaned.at("rules")[0].at("splats"), alone.outside);
    EXPECT_GT(cleaned.at("rules")[2].at("light_share"), 0.0);
    EXPECT_LT(cleaned.at("psnr_after"), cleaned.at("psnr_before"));
    expect_input_error(darb(options + "--roi sphere:500,0,0,1"), {"--roi", "points lies in it"});
    expect_input_error(darb(options + "--roi cube:1"), {"--roi cube:1", "is no region"});
    expect_input_error(darb(options + "--clean-haze 3,1"), {"--clean-haze", "0 to 1"});
}

// Splats without rates gain nothing; the look after iteration 3 says so, which ends the run.
TEST_F(RunFiles, a_run_without_gain_ends_itself_and_a_resumed_one_at_the_same_iteration) {
    const std::string options = fmt::format(
        "train '{}' -o '{}' -r 8 --iterations 20 --eval --end-without-gain 2 --densify-until-iter "
        "1 --average-from 0.5 "
        "--position-lr-init 1e-20 --position-lr-final 1e-20 --scaling-lr 0 --rotation-lr 0 "
        "--opacity-lr 0 "
        "--feature-lr 0 --resolution-ramp off",
        data().string(), run().string());
    const Outcome o = darb(options + " --checkpoint-iterations 2 4");
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.out.find("the run ended itself: held-out photos have gained less than 0.02 dB "
                         "since iteration 1"),
              std::string::npos)
        << o.out;
    const json metrics = json::parse(read_text_file(run() / "metrics.json"));
    EXPECT_EQ(metrics.at("iteration"), 6) << "3, and as long a mean as half of a run";
    EXPECT_EQ(metrics.at("interrupted"), false);
    EXPECT_NE(metrics.at("ended_early").get<std::string>().find("+0.000 dB"), std::string::npos);
    const Bytes whole = read_file(run() / "point_cloud" / "iteration_6" / "point_cloud.ply");
    EXPECT_EQ(resume().code, 0);
    EXPECT_FALSE(fs::exists(run() / "earlier.1")) << "nothing is left to do";
    for (const int from : {2, 4}) {  // before and after it was decided
        fs::copy_file(run() / fmt::format("chkpnt{}.darb", from), run() / "checkpoint.darb",
                      fs::copy_options::overwrite_existing);
        fs::remove_all(run() / "point_cloud");
        edit("metrics.json", [&](json& m) {
            m["iteration"] = from;
            m["interrupted"] = true;
        });
        const Outcome again = resume();
        EXPECT_EQ(again.code, 0) << again.err;
        EXPECT_EQ(json::parse(read_text_file(run() / "metrics.json")).at("iteration"), 6) << from;
        EXPECT_EQ(read_file(run() / "point_cloud" / "iteration_6" / "point_cloud.ply"), whole)
            << from;
    }
    expect_input_error(
        darb(fmt::format("train '{}' -o '{}' -r 8 --iterations 4 --end-without-gain 2",
                         data().string(), (folder_ / "other").string())),
        {"--end-without-gain 2", "no photo is held out", "--eval"});
}

TEST_F(RunFiles, a_line_that_a_kill_cut_off_does_not_count) {
    leave_unfinished();
    std::ofstream(run() / "run.jsonl", std::ios::app) << "{\"event\": \"itera";
    const Outcome o = resume();
    EXPECT_EQ(o.code, 0) << o.err;
}

// Complete according to its checksum, but from no run that these options make.
TEST_F(RunFiles, a_checkpoint_that_contradicts_its_settings_is_refused) {
    leave_unfinished();
    const fs::path path = run() / "checkpoint.darb";
    const Checkpoint good = read_checkpoint(path);
    const auto refused = [&](const std::string& reason,
                             const std::function<void(Checkpoint&)>& change) {
        Checkpoint bad = good;
        change(bad);
        write_checkpoint(path, bad);
        expect_input_error(resume(), {"checkpoint.darb", reason});
    };
    refused("the kernel sinc", [](Checkpoint& c) { c.state.model.kernel = KERNEL_SINC; });
    refused("beyond the end", [](Checkpoint& c) { c.state.iteration = 5; });
    refused("no use for", [](Checkpoint& c) { c.state.exposure.assign(36, 0.0f); });
    refused("none of them with finite numbers", [](Checkpoint& c) {
        for (float& value : c.state.model.position) value = std::nanf("");
    });
    refused("does not look for a gain", [](Checkpoint& c) { c.gain.looks = {{1, 20.0}}; });
    refused("no JSON object", [](Checkpoint& c) { c.settings = "[]"; });
    refused("'strategy' is no text", [](Checkpoint& c) {
        json settings = json::parse(c.settings);
        settings["strategy"] = 3;
        c.settings = settings.dump();
    });
    write_checkpoint(path, good);
    EXPECT_EQ(resume().code, 0);
}

TEST_F(RunFiles, a_start_without_room_is_refused_with_the_number_that_fits) {
    forget_points();
    const std::string train =
        fmt::format("train '{}' -o '{}' -r 8 -q --iterations 1 --no-report --random-points ",
                    data().string(), run().string());
    const Outcome o = darb(train + "4000000000");
    expect_input_error(o, {"--random-points 4000000000", "of device memory", " fits."});
    EXPECT_FALSE(fs::exists(run() / "checkpoint.darb"));
    EXPECT_EQ(darb(train + "2000").code, 0);
    fs::remove_all(run());
    expect_input_error(darb(train + "2000 --start points"), {"no points for --start points"});
    EXPECT_FALSE(fs::exists(run() / "checkpoint.darb"));
}

TEST_F(RunFiles, without_points_splats_start_on_surfaces_where_photos_show_enough_long) {
    forget_points();
    const auto started = [&](const std::string& options) {
        fs::remove_all(run());
        const Outcome o = darb(fmt::format("train '{}' -o '{}' --iterations 1 --no-report {}",
                                           data().string(), run().string(), options));
        EXPECT_EQ(o.code, 0) << o.err;
        const bool dense = (o.out + o.err).find("start: dense, ") != std::string::npos;
        EXPECT_EQ(fs::exists(run() / "dense_start" / "points.ply"), dense) << o.err;
        return dense;
    };
    EXPECT_TRUE(started("-r 2"));
    EXPECT_FALSE(started("-r 8")) << "photos of 25 px";
    EXPECT_FALSE(started("-r 2 --random-points 2000"));
    EXPECT_FALSE(started("-r 2 --start random"));
    // A fisheye lens stays in the pictures where it is asked for, and stereo does not compare such.
    json cameras = json::parse(read_text_file(data() / "transforms_train.json"));
    cameras.merge_patch(
        {{"camera_model", "OPENCV_FISHEYE"}, {"k1", 0.01}, {"k2", 0}, {"k3", 0}, {"k4", 0}});
    std::ofstream(data() / "transforms_train.json") << cameras.dump();
    EXPECT_FALSE(started("-r 2 --lens original"));
}

// A run that began on surfaces and has no points to begin from again: it goes on with its splats.
TEST_F(RunFiles, a_run_without_points_goes_on_without_looking_for_surfaces_again_long) {
    forget_points();
    const std::string options = fmt::format("train '{}' -o '{}' -r 4 --eval --iterations ",
                                            data().string(), run().string());
    const Outcome first = darb(options + "4 --checkpoint-iterations 2");
    ASSERT_EQ(first.code, 0) << first.err;
    const Bytes whole = read_file(run() / "point_cloud" / "iteration_4" / "point_cloud.ply");
    fs::rename(run() / "chkpnt2.darb", run() / "checkpoint.darb");
    fs::remove_all(run() / "point_cloud");
    edit("metrics.json", [](json& m) {
        m["iteration"] = 2;
        m["interrupted"] = true;
    });
    const Outcome o = darb("train --resume -o " + run().string());
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_EQ((o.out + o.err).find("stereo"), std::string::npos) << o.err;
    EXPECT_EQ(read_file(run() / "point_cloud" / "iteration_4" / "point_cloud.ply"), whole);
}

TEST_F(RunFiles, a_dense_start_leaves_its_points_and_pictures_and_a_resumed_run_goes_on_long) {
    leave_unfinished("--start dense");
    std::size_t dropped = 0;
    EXPECT_GT(read_point_cloud_ply(run() / "dense_start" / "points.ply", dropped).size(), 100u);
    EXPECT_EQ(dropped, 0u);
    EXPECT_FALSE(fs::is_empty(run() / "dense_start"));
    fs::remove_all(run() / "dense_start");
    const Outcome o = resume();
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_FALSE(fs::exists(run() / "dense_start")) << "found once more";
}

}  // namespace
}  // namespace darb::test
