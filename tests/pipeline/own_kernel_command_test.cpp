// SPDX-License-Identifier: MIT
// A user's own kernels, given to each command.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "engine/kernels/kernel_expression.h"
#include "tests/support/run_command.h"

namespace darb::test {
namespace {

const std::string kCubic = "'expr: (1 - q/9)^3, support 9, name cubic'";

class OwnKernelCommand : public testing::Test {
  protected:
    void SetUp() override {
        if (!has_expressions()) GTEST_SKIP() << "built without muParser";
    }
};

TEST_F(OwnKernelCommand, psi_and_sim1d_show_it_beside_the_family) {
    const fs::path file = scratch() / "psi.json", page = scratch() / "psi.html";
    const Outcome psi = darb("psi --samples 2 --cells 16 --kernels sinc," + kCubic + " --json " +
                             file.string() + " --html " + page.string());
    ASSERT_EQ(psi.code, 0) << psi.err;
    EXPECT_NE(psi.out.find("expr: (1 - q/9)^3, support 9, name cubic"), std::string::npos);
    const nlohmann::json kernels = read_json(file)["kernels"];
    ASSERT_EQ(kernels.size(), 2u);
    EXPECT_EQ(kernels[1]["kernel"], "cubic");
    EXPECT_NEAR(kernels[1]["exact"].get<double>(), 9.0 / 11, 1e-12);  // R^2 / (2 * 3 + 5)
    const nlohmann::json fit = read_json(file)["in_the_shaders"][1];
    EXPECT_EQ(fit["form"], "(1 - t)^3 P2(t)");
    EXPECT_LT(fit["error"].get<double>(), 1e-7);
    EXPECT_NE(read_text_file(page).find("cubic"), std::string::npos);

    const fs::path study = scratch() / "sim1d.json";
    const Outcome sim = darb("sim1d -N 3 --seeds 1 --steps 50 --signals square --kernels " +
                             kCubic + ",generalised_exponential --json " + study.string());
    ASSERT_EQ(sim.code, 0) << sim.err;
    EXPECT_NE(sim.out.find("cubic"), std::string::npos) << sim.out;
}

TEST_F(OwnKernelCommand, A_run_keeps_it_in_every_file_and_resumes_with_it_alone) {
    const fs::path out = scratch() / "run", frames = scratch() / "frames";
    const std::string train = "train " + kScene + " -r 8 -q --effects none -o " + out.string();
    ASSERT_EQ(darb(train + " --iterations 2 --kernel " + kCubic).code, 0);
    const Outcome info = darb("info " + out.string());
    EXPECT_NE(info.out.find("cubic"), std::string::npos) << info.out;
    std::ifstream lines(out / "run.jsonl");
    std::string first;
    std::getline(lines, first);
    const nlohmann::json settings = nlohmann::json::parse(first)["settings"];
    EXPECT_EQ(settings["kernel"], "cubic");
    EXPECT_EQ(settings["kernel_definition"]["function"]["support"], 9);
    const Outcome drawn =
        darb("render " + out.string() + " --cameras " + kScene + " -r 8 -o " + frames.string());
    EXPECT_EQ(drawn.code, 0) << drawn.err;

    const Outcome again = darb("train --resume -o " + out.string());
    EXPECT_EQ(again.code, 0) << again.err;
    const Outcome more = darb(train + " --iterations 4 --resume --kernel " + kCubic);
    EXPECT_EQ(more.code, 2);  // iterations differ, the kernel does not
    EXPECT_EQ(more.err.find("kernel"), std::string::npos) << more.err;
    const Outcome other = darb(train +
                               " --iterations 2 --resume --kernel "
                               "'expr: (1 - q/9)^4, support 9, name cubic'");
    EXPECT_EQ(other.code, 2);
    EXPECT_NE(other.err.find("kernel_definition"), std::string::npos) << other.err;

    const Outcome spz = darb("convert " + out.string() + " " + (scratch() / "a.spz").string());
    EXPECT_EQ(spz.code, 0);
    EXPECT_NE(spz.err.find("no place for the kernel cubic"), std::string::npos) << spz.err;
    const Outcome gaussians = darb("convert " + out.string() + " " +
                                   (scratch() / "b.ply").string() + " --kernel gaussian");
    EXPECT_EQ(gaussians.code, 0) << gaussians.err;
    EXPECT_NE(gaussians.out.find("kernel cubic to gaussian"), std::string::npos) << gaussians.out;
}

TEST(OwnKernelFileCommand, A_table_trains_and_draws_another_scene) {
    const fs::path file = scratch() / "ramp.json", out = scratch() / "table";
    nlohmann::json table = nlohmann::json::array();
    for (int i = 0; i <= 24; ++i) {
        const double t = i / 24.0;
        table.push_back({6 * t, (1 - t) * (1 - t) * (1 + t)});
    }
    write_file_atomic(file, nlohmann::json{{"table", table}}.dump());
    const std::string with = " --kernel-file " + file.string();
    const Outcome run =
        darb("train " + kScene + " -r 8 -q --iterations 2 -o " + out.string() + with);
    ASSERT_EQ(run.code, 0) << run.err;
    EXPECT_NE(darb("info " + out.string()).out.find("ramp"), std::string::npos);
    const Outcome again = darb("train --resume -q -o " + out.string());
    EXPECT_EQ(again.code, 0) << again.err;  // the path of the file as seen from the folder
    const Outcome drawn = darb("render " + out.string() + " --kernel sinc --cameras " + kScene +
                               " -r 8 -o " + (scratch() / "sinc").string());
    EXPECT_EQ(drawn.code, 0) << drawn.err;
    const Outcome plan = darb("plan " + kScene + " --no-price --json -" + with);
    EXPECT_EQ(plan.code, 0) << plan.err;
}

TEST_F(OwnKernelCommand, check_runs_its_values_walks_and_hard_cases_long) {
    const fs::path file = scratch() / "check.json";
    const Outcome check = darb("check --kernel " + kCubic + " --json " + file.string());
    EXPECT_EQ(check.code, 0) << check.out << check.err;
    std::set<std::string> groups;
    const nlohmann::json rows = read_json(file)["checks"];
    for (const nlohmann::json& row : rows) groups.insert(row["group"]);
    for (const char* group : {"kernels", "walk, cubic psi", "walk, cubic exact",
                              "hard cases, cubic psi", "hard cases, cubic exact"})
        EXPECT_TRUE(groups.contains(group)) << group;
}

TEST_F(OwnKernelCommand, Bad_kernels_are_refused_with_their_place) {
    const std::string train = "train " + kScene + " -o " + (scratch() / "bad").string();
    write_file_atomic(scratch() / "bad.json", std::string("{\"table\": [[0, 1], [1, 2], [3, 0]]}"));
    const std::string file = (scratch() / "bad.json").string();
    expect_refused({
        {train + " --kernel 'expr: (1 - q/9^3, support 9'",
         "expr: (1 - q/9^3, support 9\n          ^\n"},
        {train + " --kernel 'expr: 1 - q/9, support 0'", "a support of 0\n"},
        {train + " --kernel 'sinc, gaussian'", "names 2 kernels"},
        {train + " --kernel sinc_2_pulses", "has more than one pulse"},
        {train + " --kernel no_such", "no such kernel"},
        {train + " --pulses 2 --kernel " + kCubic, "there is no such kernel"},
        {train + " --kernel-file " + file, "row 2 of its table, q 1, w 2: w grows"},
        {train + " --kernel-file " + file + ".none", "bad.json.none"},
        {"psi --kernels 'sinc, expr: 1 - q/4, support 9'", "is negative"},
        {"sim1d --kernels 'expr: 1 + q, support 9'", "grows"},
        {"compare " + kScene + " -o " + (scratch() / "bad").string() + " --kernels 'expr: 1'",
         "has no support"},
        {"plan " + kScene + " --kernel 'expr: 1 - q/9, support 9, name sinc'",
         "is a name of the family"},
        {"check --kernel 'expr: q, support 9'", "is 0 at its centre"},
    });
}

}  // namespace
}  // namespace darb::test
