// SPDX-License-Identifier: MIT
// darb compare, psi and sim1d as a user runs them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/run_command.h"

namespace darb::test {
namespace {

TEST(CompareCommand, Runs_areTrainedReportedAndNotRepeated_slow) {
    const fs::path out = scratch() / "compare";
    const std::string command =
        "compare " + kScene +
        " --kernels gaussian,sinc --iterations 10,20 -r 4 --scales 0.5,1,2 -o " + out.string() +
        " --effects=none --lpips " + (out / "missing.safetensors").string();
    const Outcome first = darb(command);
    ASSERT_EQ(first.code, 0) << first.err;
    EXPECT_NE(first.out.find("missing.safetensors does not exist"), std::string::npos) << first.out;
    for (const char* name : {"compare.json", "compare.html"}) {  // to be shared
        const std::string text = read_text_file(out / name);
        for (const std::string& folder : {scratch().string(), std::string(DARB_SOURCE_DIR) + "/"})
            EXPECT_EQ(text.find(folder), std::string::npos) << name;
    }
    const nlohmann::json a = read_json(out / "compare.json");
    EXPECT_EQ(a["datasets"][0]["runs"][0]["folder"], "scene/gaussian/seed0");
    const auto& medians = a["datasets"][0]["medians"];
    ASSERT_EQ(medians.size(), 4u);
    for (const auto& row : medians) {
        EXPECT_GT(row["psnr_db"]["median"].get<double>(), 5);
        EXPECT_GT(row["model_mb"]["median"].get<double>(), 0.1);
        EXPECT_TRUE(row["lpips"].is_null());
        EXPECT_NEAR(row["psnr_db_at_1"]["median"].get<double>(),
                    row["psnr_db"]["median"].get<double>(), 1e-6);
        EXPECT_GT(row["off_path_psnr_db"]["median"].get<double>(), 5);
        EXPECT_NE(row["psnr_db_at_2"]["median"], row["psnr_db_at_0.5"]["median"]);
    }
    for (const auto& run : a["datasets"][0]["runs"]) {
        EXPECT_EQ(run["failure"], "");
        EXPECT_GT(run["blending"]["blended_per_pixel"].get<double>(), 0.1);
        EXPECT_GT(run["blending"]["pairs_per_splat"].get<double>(), 0.5);
        EXPECT_GT(run["blending"]["ns_per_splat_pixel"].get<double>(), 0);
    }
    const std::string page = read_text_file(out / "compare.html");
    EXPECT_NE(page.find("Where the errors differ most"), std::string::npos);
    EXPECT_NE(page.find("<th>at 1/2 (dB)</th>"), std::string::npos);
    EXPECT_EQ(page.find("http"), page.find("http://www.w3.org"));  // nothing from outside

    const fs::path metrics = out / "scene/sinc/seed0/metrics.json";
    const auto written = fs::last_write_time(metrics);
    fs::remove_all(out / "scene/gaussian");
    const Outcome second = darb(command);
    ASSERT_EQ(second.code, 0) << second.err;
    EXPECT_NE(second.err.find("scene: sinc, seed 0: is there"), std::string::npos) << second.err;
    EXPECT_EQ(fs::last_write_time(metrics), written);
    // The same seed gives the same bits, trained before or now.
    EXPECT_EQ(read_json(out / "compare.json")["datasets"][0]["medians"][2]["psnr_db"],
              medians[2]["psnr_db"]);

    const Outcome other = darb(command + " --train-options '--opacity-lr 0.01'");
    EXPECT_EQ(other.code, 2);
    EXPECT_NE(other.out.find("of a run with other settings: opacity_lr"), std::string::npos)
        << other.out;
}

TEST(CompareCommand, RunOfDarbTrain_counts_slow) {
    const fs::path out = scratch() / "compare_train";
    const std::string options = " --iterations 12 -r 8 --effects=none ";
    ASSERT_EQ(darb("train " + kScene + " --eval --kernel parabolic -q" + options + " -o " +
                   (out / "scene/parabolic/seed0").string())
                  .code,
              0);
    const Outcome compared =
        darb("compare " + kScene + " --kernels parabolic" + options + " -o " + out.string());
    EXPECT_EQ(compared.code, 0) << compared.err;
    EXPECT_NE(compared.err.find("parabolic, seed 0: is there"), std::string::npos) << compared.err;
    EXPECT_EQ(compared.out.find("LPIPS  "), std::string::npos) << compared.out;  // no weights

    // A link keeps its name, an evaluation that was not made is named, and what cannot be measured
    // leaves the run as it is.
    const fs::path link = scratch() / "truck";
    fs::create_directory_symlink(kScene, link);
    fs::rename(out / "scene", out / "truck");
    write_file_atomic(out / "truck/parabolic/seed0/point_cloud/iteration_12/point_cloud.ply",
                      std::string_view("broken"));
    const Outcome again =
        darb("compare " + link.string() +
             " --kernels parabolic --iterations 6,12 -r 8 --effects=none -o " + out.string());
    EXPECT_EQ(again.code, 2);
    const nlohmann::json set = read_json(out / "compare.json")["datasets"][0];
    EXPECT_EQ(set["name"], "truck");
    EXPECT_EQ(set["paper"].size(), 10u);
    EXPECT_EQ(set["runs"][0]["failure"], "");
    EXPECT_TRUE(set["medians"][1]["psnr_db"]["median"].is_number());
    const std::string notes = set["runs"][0]["notes"];
    EXPECT_NE(notes.find("without an evaluation after 6 iterations"), std::string::npos) << notes;
    EXPECT_NE(notes.find("Without blending: "), std::string::npos) << notes;
}

TEST(CompareCommand, AddedSplatsAndMergedReports_slow) {
    const fs::path out = scratch() / "compare_added", paper = scratch() / "figures";
    const std::string command = "compare " + kScene +
                                " --kernels gaussian --iterations 4 -r 8 --effects=none "
                                "--blending-views 0 -o " +
                                out.string();
    ASSERT_EQ(darb(command).code, 0);
    const fs::path ply = out / "scene/gaussian/seed0/point_cloud/iteration_4/point_cloud.ply";
    const Outcome added =
        darb(command + " --flip --paper " + paper.string() + " --add other_one=" + ply.string());
    ASSERT_EQ(added.code, 0) << added.err;
    EXPECT_NE(added.out.find("other_one (not trained here)"), std::string::npos) << added.out;
    const nlohmann::json set = read_json(out / "compare.json")["datasets"][0];
    const auto &trained = set["runs"][0], &other = set["runs"][1];
    EXPECT_FALSE(other["trained_here"].get<bool>());
    EXPECT_TRUE(other["at"][0]["training_s"].is_null());
    for (const char* value : {"psnr_db", "ssim", "flip"})  // the same splats
        EXPECT_NEAR(other["at"][0][value].get<double>(), trained["at"][0][value].get<double>(),
                    1e-3)
            << value;
    const std::string tex = read_text_file(paper / "quality-scene-4.tex");
    EXPECT_NE(tex.find("other\\_one (not trained here)"), std::string::npos) << tex;
    for (const char* name : {"quality-scene-4.csv", "scene-held-out-psnr-training-time-s.pdf",
                             "scene-held-out-psnr-training-time-s.svg", "report.tex"})
        EXPECT_TRUE(fs::exists(paper / name)) << name;
    EXPECT_NE(read_text_file(out / "compare.html").find("held-out pictures"), std::string::npos);

    fs::copy_file(out / "compare.json", scratch() / "again.json");
    const std::string merge = "compare --merge " + (out / "compare.json").string() + " " +
                              (scratch() / "again.json").string() + " -o ";
    const Outcome merged = darb(merge + (scratch() / "merged").string());
    ASSERT_EQ(merged.code, 0) << merged.err;
    EXPECT_NE(merged.out.find("2 cells are in two reports: 2 agree as printed, 2 of them bit"),
              std::string::npos)
        << merged.out;
    EXPECT_EQ(read_json(scratch() / "merged/compare.json")["repeated"].size(), 2u);
    nlohmann::json longer = read_json(scratch() / "again.json");
    longer["iterations"] = {5};
    write_file_atomic(scratch() / "again.json", longer.dump());
    expect_refused({{merge + "x", "after 4 iterations and the other after 5"},
                    {merge + out.string(), "compare.json"},
                    {"compare --merge one.json -o x", "names one report"},
                    {command + " --add gaussian=" + ply.string(), "cannot be called"},
                    {command + " --add 3dgs", "is not NAME=FILE"},
                    {command + " --add a=/nowhere.ply", "/nowhere.ply"},
                    {command + " --paper " + ply.string(), "takes a folder"}});
}

TEST(CompareCommand, CamerasThatKeepTheirLens_areBlendedWithIt_slow) {
    const fs::path set = scratch() / "fisheye", out = scratch() / "compare_fisheye";
    fs::create_directories(set);
    fs::create_directory_symlink(kScene + "/images", set / "images");
    nlohmann::json cameras = read_json(kScene + "/transforms_train.json");
    cameras["camera_model"] = "OPENCV_FISHEYE";
    cameras["k1"] = 0.02;
    write_file_atomic(set / "transforms_train.json", cameras.dump());
    const Outcome compared =
        darb("compare " + set.string() +
             " --kernels gaussian --iterations 2 -r 8 --train-options=--lens=original "
             "--blending-views 1 -o " +
             out.string());
    ASSERT_EQ(compared.code, 0) << compared.err;
    const nlohmann::json run = read_json(out / "compare.json")["datasets"][0]["runs"][0];
    EXPECT_EQ(run["failure"], "");
    const nlohmann::json metrics = read_json(out / "fisheye/gaussian/seed0/metrics.json");
    EXPECT_TRUE(metrics["start"]["settings"]["effects"]["lens"].get<bool>());
    EXPECT_GT(run["blending"]["blended_per_pixel"].get<double>(), 0.1);
}

TEST(CompareCommand, MorePulses_areTrainedStoredAndSetAgainstOne_long) {
    const fs::path out = scratch() / "compare_pulses";
    const Outcome compared = darb("compare " + kScene +
                                  " --kernels gaussian,sinc --pulses 1,3 -r 8 "
                                  "--iterations 6 --effects=none --blending-views 1 -o " +
                                  out.string());
    ASSERT_EQ(compared.code, 0) << compared.err;
    const nlohmann::json set = read_json(out / "compare.json")["datasets"][0];
    EXPECT_EQ(set["medians"].size(), 3u);
    ASSERT_EQ(set["pulses"].size(), 1u);
    for (const auto& row : set["pulses"]) {
        EXPECT_TRUE(row["psnr_db_difference"].is_number());
        EXPECT_GT(row["peak_ratio"].get<double>(), 0.5);
    }
    const fs::path scene =
        out / "scene/sinc_3_pulses/seed0/point_cloud/iteration_6/point_cloud.ply";
    EXPECT_NE(read_text_file(scene).find("SplatKernel: sinc_3_pulses"), std::string::npos);
    const std::string render = "render " + scene.string() + " -r 8 --cameras " + kScene + " -o " +
                               (out / "frames").string();
    EXPECT_EQ(darb(render).code, 0);
    const Outcome exact = darb(render + " --footprint exact");
    EXPECT_EQ(exact.code, 2);
    EXPECT_NE(exact.err.find("sinc_3_pulses"), std::string::npos) << exact.err;
}

TEST(TrainCommand, PulsesThatAKernelHasNot_areNamedWithExitCode2) {
    for (const char* flags : {"--kernel gaussian --pulses 2", "--kernel sinc --pulses 4",
                              "--kernel sinc --pulses 2 --footprint exact"}) {
        const Outcome bad = darb("train " + kScene + " -o x " + flags);
        EXPECT_EQ(bad.code, 2) << flags;
        EXPECT_NE(bad.err.find("--pulses"), std::string::npos) << bad.err;
    }
}

TEST(CompareCommand, BadInput_isNamedWithExitCode2) {
    EXPECT_EQ(darb("compare").code, 2);
    EXPECT_EQ(darb("compare /nowhere -o x").code, 2);
    EXPECT_EQ(darb("compare " + kScene + " -o x --kernels triangle").code, 2);
    const Outcome bad = darb("compare " + kScene + " -o x --train-options=--frobnicate");
    EXPECT_EQ(bad.code, 2);
    EXPECT_NE(bad.err.find("frobnicate"), std::string::npos) << bad.err;
}

TEST(CompareCommand, DataSetThatCannotBeLoaded_isAFailureInTheReport) {
    const fs::path empty = scratch() / "empty_set", out = scratch() / "compare_empty";
    fs::create_directories(empty);
    const Outcome one = darb("compare " + empty.string() + " -o " + out.string());
    EXPECT_EQ(one.code, 2) << one.err;
    EXPECT_NE(read_text_file(out / "compare.html").find("every kernel"), std::string::npos);
}

TEST(CompareCommand, RunThatCannotBeRead_isSaidWhereProgressIsNot) {
    const fs::path out = scratch() / "compare_unread";
    write_file_atomic(out / "scene/gaussian/seed0/metrics.json", "[]");
    const Outcome one = darb(
        "compare " + kScene + " --kernels gaussian --iterations 4 -r 8 --blending-views 0 -q -o " +
        out.string() + " --train-options '--images " + kScene + "/images --sh-degree 1'");
    EXPECT_EQ(one.code, 2);
    EXPECT_NE(one.err.find("metrics.json"), std::string::npos) << one.err;
    // What was typed names no folder of the machine in what is shared.
    EXPECT_NE(read_json(out / "compare.json").dump().find("--images images --sh-degree 1."),
              std::string::npos);
    for (const char* name : {"compare.json", "compare.html"})
        for (const std::string& folder : {kScene, out.string()})
            EXPECT_EQ(read_text_file(out / name).find(folder), std::string::npos) << name;
}

TEST(PsiCommand, TableJsonAndPage_agree) {
    const fs::path numbers = scratch() / "psi.json", page = scratch() / "psi.html";
    const fs::path paper = scratch() / "psi_paper";
    const Outcome psi =
        darb("psi --kernel raised_cosine,sinc --samples 4 --cells 32 --json " + numbers.string() +
             " --html " + page.string() + " --paper " + paper.string());
    EXPECT_NE(read_text_file(paper / "psi.csv").find("\nraised_cosine,"), std::string::npos);
    EXPECT_NE(read_text_file(paper / "psi.tex").find("raised\\_cosine & "), std::string::npos);
    ASSERT_EQ(psi.code, 0) << psi.err;
    EXPECT_NE(psi.out.find("0.655153"), std::string::npos) << psi.out;
    EXPECT_NE(psi.out.find("psi = 1"), std::string::npos) << psi.out;
    EXPECT_NEAR(read_json(numbers)["kernels"][1]["exact"].get<double>(), 1.176219, 5e-7);
    EXPECT_NE(read_text_file(page).find("<svg"), std::string::npos);
    expect_refused({{"psi --kernel triangle", "no such kernel"},
                    {"psi --kernel sinc_2_pulses", "more than one pulse"}});
}

TEST(Sim1dCommand, TableJsonAndPage_areWritten) {
    const fs::path numbers = scratch() / "sim1d.json", page = scratch() / "sim1d.html";
    const Outcome sim = darb(
        "sim1d --signals triangle --kernels gaussian,generalised_exponential "
        "-N 1,2 --seeds 2 --steps 50 --samples 100 --json " +
        numbers.string() + " --html " + page.string());
    ASSERT_EQ(sim.code, 0) << sim.err;
    EXPECT_EQ(read_json(numbers)["rows"].size(), 4u);
    EXPECT_NE(read_text_file(page).find("N = 2"), std::string::npos);
    expect_refused({{"sim1d --signals noise", "no such signal"},
                    {"sim1d --kernels raised_cosine_2_pulses", "more than one pulse"}});
}

}  // namespace
}  // namespace darb::test
