// SPDX-License-Identifier: MIT
// What darb does with a scene that it has trained: eval, render, check --dump, info, and resuming.

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "engine/core/files.h"
#include "engine/data/image_io.h"
#include "engine/scene/ply.h"
#include "tests/support/run_command.h"
#include "tests/support/test_data.h"

namespace darb {
namespace {

using nlohmann::json;
using namespace test;

using test::kScene;

// A scene of 20 iterations. 3DGS's names of the options, with underscores.
class TrainedCommand : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        const Outcome o =
            darb(fmt::format("train -s {} -m {} -r 2 --eval --iterations 20 --test_iterations 20 "
                             "--densify_from_iter 500 --strategy adc -i images -w --quiet",
                             kScene, output()));
        ASSERT_EQ(o.code, 0) << o.err;
        EXPECT_EQ(o.err, "");
    }
    static std::string output() { return scratch() / "run"; }
    static std::string ply() { return output() + "/point_cloud/iteration_20/point_cloud.ply"; }
};

TEST_F(TrainedCommand, eval_reports_what_training_reported) {
    const std::string file = scratch() / "eval.json";
    const Outcome o = darb(fmt::format("eval {} {} -r 2 -w --json {}", ply(), kScene, file));
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.out.find("mean of 8"), std::string::npos) << o.out;
    const json eval = json::parse(read_text_file(file));
    const json trained = json::parse(read_text_file(output() + "/metrics.json"))["evaluations"][0];
    EXPECT_NEAR(eval["mean"]["psnr_db"].get<double>(), trained["psnr_db"].get<double>(), 1e-6);
    EXPECT_NEAR(eval["mean"]["ssim"].get<double>(), trained["ssim"].get<double>(), 1e-6);
    ASSERT_EQ(eval["views"].size(), 8U);
    EXPECT_EQ(eval["views"][0]["name"], "view_03.png");
    ASSERT_EQ(eval.at("off_path").at("views").size(), 16U);
    EXPECT_EQ(eval["off_path"]["views"][0]["name"], "images/between_0.png");
    // As that folder, named as a data set, is measured.
    const std::string away = scratch() / "away.json";
    ASSERT_EQ(darb(fmt::format("eval {} {}/off_path -r 2 -w --json {}", ply(), kScene, away)).code,
              0);
    EXPECT_EQ(eval["off_path"]["mean"], json::parse(read_text_file(away)).at("mean"));
    EXPECT_GT(eval["views"][0]["psnr_db"].get<double>(), 5.0);
}

TEST_F(TrainedCommand, eval_measures_at_other_sizes) {
    const std::string command = fmt::format("eval {} {} -w ", ply(), kScene);
    const std::string file = scratch() / "scales.json", whole = scratch() / "whole.json";
    const Outcome o = darb(command + "-r 4 --scales 4,0.5,1 --json " + file);
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.out.find("1/2    25 x 19"), std::string::npos) << o.out;
    const json rows = json::parse(read_text_file(file)).at("scales");
    ASSERT_EQ(rows.size(), 3U);
    // Four times a quarter is the whole photo, and half of it what -r 8 loads.
    ASSERT_EQ(darb(command + "-r 1 --json " + whole).code, 0);
    const json first = json::parse(read_text_file(whole));
    EXPECT_EQ(rows[0].at("scale"), 4);
    EXPECT_EQ(rows[0].at("width"), 200);
    EXPECT_EQ(rows[0].at("mean"), first.at("mean"));
    EXPECT_EQ(rows[0].at("views"), first.at("views"));
    ASSERT_EQ(darb(command + "-r 8 --json " + whole).code, 0);
    EXPECT_EQ(rows[1].at("mean"), json::parse(read_text_file(whole)).at("mean"));
    expect_refused({{command + "-r 2 --scales 4", "4 times 100 px is 400 px"}});
}

TEST_F(TrainedCommand, eval_tells_the_light_that_few_views_prove) {
    const std::string file = scratch() / "light.json";
    const Outcome o = darb(fmt::format(
        "eval {} {} -r 4 -w --hold-out arc:4 --light-share --json {}", ply(), kScene, file));
    ASSERT_EQ(o.code, 0) << o.err;
    const json eval = json::parse(read_text_file(file)), light = eval.at("light_of_few_views");
    EXPECT_EQ(light.at("fewer_than"), 3);
    EXPECT_EQ(light.at("of_splats"), read_ply(ply()).size());
    EXPECT_LT(light.at("splats").get<int>(), light.at("of_splats").get<int>());
    for (const char* mean : {"mean", "arc", "off_path"}) {
        EXPECT_GE(light.at(mean).get<double>(), 0) << mean;
        EXPECT_LT(light.at(mean).get<double>(), 1) << mean;
    }
    EXPECT_GT(light.at("off_path").get<double>(), light.at("mean").get<double>());
    EXPECT_NE(o.out.find("fewer than 3 training views see"), std::string::npos) << o.out;
    // An arc beside the data set's own test views.
    double sum = 0;
    int in_arc = 0;
    for (const json& view : eval.at("views"))
        if (view.value("in_arc", false)) {
            sum += view.at("psnr_db").get<double>();
            ++in_arc;
        }
    EXPECT_EQ(in_arc, 12) << "a quarter of 48";
    EXPECT_EQ(eval.at("arc").at("views"), 12);
    EXPECT_NEAR(eval.at("arc").at("psnr_db").get<double>(), sum / 12, 1e-9);
}

TEST_F(TrainedCommand, eval_takes_the_split_asked_for) {
    const std::string command = fmt::format("eval {} {} -r 4 --split ", output(), kScene);
    EXPECT_NE(darb(command + "train").out.find("mean of 40"), std::string::npos);
    const std::string single = scratch() / "single";
    json cameras = json::parse(read_text_file(kScene + "/transforms_train.json"));
    cameras["frames"].erase(cameras["frames"].begin() + 1, cameras["frames"].end());
    cameras["frames"][0]["file_path"] = kScene + "/images/view_00.png";
    write_file_atomic(single + "/transforms.json", cameras.dump());
    expect_refused({{fmt::format("eval {} {} --split train", ply(), single), "split 'train'"}});
}

TEST_F(TrainedCommand, check_dumps_a_view) {
    const std::string dump = scratch() / "dump";
    const std::string command =
        fmt::format("check --scene {} --cameras {}/cameras.json --dump {}", ply(), output(), dump);
    EXPECT_EQ(darb(command + " --view 2").code, 0);
    EXPECT_EQ(darb(command + "/double --view 2 --reference").code, 0);
    for (const char* name :
         {"image", "d_xyz", "d_f_dc", "d_f_rest", "d_opacity", "d_scale", "d_rot"}) {
        const fs::path file = fs::path(dump) / (std::string(name) + ".npy");
        const fs::path reference = fs::path(dump) / "double" / (std::string(name) + ".npy");
        EXPECT_EQ(fs::file_size(reference) - 128, 2 * (fs::file_size(file) - 128)) << name;
    }
    expect_refused({{command + " --view 48", "--view takes 0 to 47"}});
}

TEST_F(TrainedCommand, render_takes_every_kind_of_cameras) {
    const std::string own = scratch() / "own", transforms = scratch() / "transforms";
    const Outcome o =
        darb(fmt::format("render {} --cameras {}/cameras.json -o {} -w", ply(), output(), own));
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.out.find("48 frames"), std::string::npos) << o.out;
    EXPECT_EQ(count_png(own), 48U);
    EXPECT_EQ(read_image_info(own + "/view_00.png").width, 100);
    const Outcome t =
        darb(fmt::format("render {} --cameras {}/transforms_test.json -r 4 "
                         "--sh_degree 0 --near 0.5 -o {}",
                         ply(), kScene, transforms));
    ASSERT_EQ(t.code, 0) << t.err;
    EXPECT_EQ(count_png(transforms), 8U);
    if (const auto data = test::test_data_folder()) {
        const std::string list = *data / "fixtures" / "inria_miku_output" / "cameras.json";
        const std::string foreign = scratch() / "foreign";
        ASSERT_EQ(
            darb(fmt::format("render {} --cameras {} -r 64 -o {}", ply(), list, foreign)).code, 0);
        EXPECT_EQ(count_png(foreign), 97U);
        EXPECT_EQ(read_image_info(foreign + "/20240212_003919.png").width, 64);
    }
}

TEST_F(TrainedCommand, render_shows_all_directions_and_train_takes_them) {
    json cameras = json::parse(read_text_file(output() + "/cameras.json"));
    cameras.erase(cameras.begin() + 4, cameras.end());
    for (json& camera : cameras)  // of 90 degrees, as a face of the cube is
        camera["width"] = camera["height"] = 2 * camera["fx"].get<double>();
    const std::string folder = scratch() / "around";
    write_file_atomic(folder + "/cameras.json", cameras.dump());
    const std::string render = fmt::format("render {} --cameras {}/cameras.json ", ply(), folder);
    ASSERT_EQ(darb(render + "-o " + folder + "/flat").code, 0);
    // As many pixels a degree as the camera has.
    const int height = static_cast<int>(std::lround(3.14159 * cameras[0]["fx"].get<double>()));
    const std::string around_it =
        fmt::format("--projection equirectangular --size {}x{} -o {}", 2 * height, height, folder);
    const Outcome o = darb(render + around_it + "/images");
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(o.out.find("off_centre"), std::string::npos) << o.out;
    // The middle of the panorama is what the camera sees in its middle.
    for (const char* name : {"view_00", "view_01", "view_02", "view_03"}) {
        const ImageU8 flat = read_image(fmt::format("{}/flat/{}.png", folder, name));
        const ImageU8 around = read_image(fmt::format("{}/images/{}.png", folder, name));
        ASSERT_EQ(around.width, 2 * height);
        const auto mean = [](const ImageU8& image, int x0, int y0, int reach, int c) {
            double sum = 0;
            for (int y = -reach; y < reach; ++y)
                for (int x = -reach; x < reach; ++x) sum += image.at(x0 + x, y0 + y, c);
            return sum / (4 * reach * reach);
        };
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(mean(flat, flat.width / 2, flat.height / 2, 4, c),
                        mean(around, height, height / 2, 4, c), 6)
                << name;
    }
    const int side = cameras[0]["width"];
    ASSERT_EQ(darb(fmt::format("{}--projection cubemap --size {}x{} -o {}/cube", render, side, side,
                               folder))
                  .code,
              0);
    EXPECT_EQ(count_png(folder + "/cube"), 24U);
    EXPECT_EQ(read_image(folder + "/cube/view_02_front.png").data,
              read_image(folder + "/flat/view_02.png").data);

    json frames = json::array();
    for (const json& camera : cameras) {
        const json &r = camera["rotation"], &p = camera["position"];
        json matrix = json::array();
        for (std::size_t row = 0; row < 3; ++row)
            matrix.push_back(
                {r[row][0], -r[row][1].get<double>(), -r[row][2].get<double>(), p[row]});
        matrix.push_back({0, 0, 0, 1});
        const fs::path name = camera["img_name"].get<std::string>();
        frames.push_back({{"file_path", "images/" + name.stem().string() + ".png"},
                          {"transform_matrix", matrix}});
    }
    write_file_atomic(folder + "/transforms.json",
                      json{{"camera_model", "EQUIRECTANGULAR"}, {"frames", frames}}.dump());
    const std::string again = folder + "/again";
    const Outcome same = darb(
        fmt::format("render {} --cameras {}/transforms.json {}/again", ply(), folder, around_it));
    ASSERT_EQ(same.code, 0) << same.err;
    EXPECT_EQ(read_image(again + "/images_view_02.png").data,
              read_image(folder + "/images/view_02.png").data);
    const Outcome run =
        darb(fmt::format("train {0} -o {0}/run --iterations 8 --no-report -r 48 "
                         "--start random --random-points 500",
                         folder));
    EXPECT_EQ(run.code, 0) << run.err;
    EXPECT_EQ(json::parse(read_text_file(folder + "/run/cameras.json")).size(), 24U);
    expect_refused({{render + "--projection equirectangular --size 300x200 -o x", "--size 400x200"},
                    {render + "--projection equirectangular -r 2 -o x", "--size in place of -r"},
                    {render + "--size 300x200 -o x", "sizes of their own"},
                    {fmt::format("render {} --projection cubemap -o x", ply()), "--cameras"}});
}

TEST_F(TrainedCommand, frames_of_equal_names_are_kept_apart) {
    json cameras = json::parse(read_text_file(output() + "/cameras.json"));
    cameras.erase(cameras.begin() + 3, cameras.end());
    cameras[0]["img_name"] = "a/b.png";
    cameras[1]["img_name"] = "a_b.jpg";
    cameras[2]["img_name"] = "../../a";
    const std::string list = scratch() / "list.json", frames = scratch() / "frames";
    write_file_atomic(list, cameras.dump());
    ASSERT_EQ(darb(fmt::format("render {} --cameras {} -r 4 -o {}", ply(), list, frames)).code, 0);
    for (const char* name : {"a_b.png", "a_b_2.png", ".._.._a.png"})
        EXPECT_TRUE(fs::exists(fs::path(frames) / name)) << name;
    EXPECT_EQ(count_png(frames), 3U);
}

TEST_F(TrainedCommand, what_a_data_set_notes_is_said) {
    const fs::path set = scratch() / "noted" / "transforms.json";
    json cameras = json::parse(read_text_file(kScene + "/transforms_test.json"));
    for (json& frame : cameras["frames"])
        frame["file_path"] = kScene + "/" + frame["file_path"].get<std::string>();
    cameras["frames"][0]["file_path"] = "no_photo.png";
    cameras["k1"] = 1e-3;
    write_file_atomic(set, cameras.dump());
    const Outcome e = darb(fmt::format("eval {} {} -r 8 --split all", ply(), set.string()));
    EXPECT_EQ(e.code, 0) << e.err;
    EXPECT_NE(e.err.find("note: Skipped: 1 frame whose photo"), std::string::npos) << e.err;
    const Outcome r =
        darb(fmt::format("render {} --cameras {} -r 8 -o {} --depth png "
                         "--depth-unit 1e-6",
                         ply(), set.string(), (scratch() / "noted_out").string()));
    EXPECT_EQ(r.code, 0) << r.err;
    EXPECT_NE(r.err.find("note: Undistorted at load: 8 photos"), std::string::npos) << r.err;
    EXPECT_NE(r.err.find("pixels of the depth PNGs lie beyond their last step at 0.065535 "
                         "world units"),
              std::string::npos)
        << r.err;
}

TEST_F(TrainedCommand, info_describes_the_scene) {
    const Outcome text = darb("info " + output());
    EXPECT_EQ(text.code, 0) << text.err;
    EXPECT_NE(text.out.find("gaussian, footprint psi"), std::string::npos) << text.out;
    const json info = json::parse(darb("info --json - " + ply()).out);
    EXPECT_EQ(info["splats"], 4000);
    EXPECT_EQ(info["bytes"], fs::file_size(ply()));
    EXPECT_EQ(info["sh_degree"], 0) << "no degree is admitted within 20 iterations";
    EXPECT_EQ(info["warnings"], json::array());
    for (const char* key : {"p1", "p10", "p50", "p90", "p99"}) {
        EXPECT_GT(info["scale"][key].get<double>(), 0) << key;
        EXPECT_GT(info["opacity"][key].get<double>(), 0) << key;
    }
    for (size_t axis = 0; axis < 3; ++axis)
        EXPECT_LT(info["bounds"]["low"][axis], info["bounds"]["high"][axis]) << axis;
}

TEST_F(TrainedCommand, finished_run_resumes_to_the_same_end) {
    const Outcome o = darb("train --resume -o " + output());
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.err.find("at iteration 20"), std::string::npos) << o.err;
}

}  // namespace
}  // namespace darb
