// darb convert and darb info on scenes of every format: what is written, what is said, and pictures
// of the same object in two formats.

#include <sys/stat.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <thread>

#include "engine/data/image_io.h"
#include "engine/data/metrics.h"
#include "engine/data/point_cloud_ply.h"
#include "engine/data/point_splats.h"
#include "engine/render/renderer.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/gaussian_scene.h"
#include "engine/scene/splat_file.h"
#include "tests/support/run_command.h"
#include "tests/support/shared_device.h"
#include "tests/support/splat_files.h"
#include "tests/support/test_data.h"

namespace darb::test {
namespace {

using nlohmann::json;

/// A scene of small splats, as a file.
std::string scene_file(const std::string& name, const SplatModel& model) {
    const std::string path = scratch() / name;
    save_splats(path, *format_to_write(path), model);
    return path;
}

TEST(Convert, every_format_to_every_other) {
    const std::string ply = scene_file("all.ply", sample_model(2, 300));
    const std::map<std::string, std::string> names = {
        {"all.ply", "PLY"}, {"all.compressed.ply", "compressed PLY"},
        {"all.spz", "SPZ"}, {"all.glb", "glTF"},
        {"all.sog", "SOG"}, {"all.splat", ".splat"}};
    for (const auto& [from, from_name] : names) {
        ASSERT_EQ(darb("convert " + ply + " " + scratch_file("to_" + from)).code, 0) << from;
        for (const auto& [to, to_name] : names) {
            const Outcome o =
                darb("convert " + scratch_file("to_" + from) + " " + scratch_file("again_" + to));
            ASSERT_EQ(o.code, 0) << o.err;
            const json info = json::parse(darb("info --json - " + scratch_file("again_" + to)).out);
            EXPECT_EQ(info["format"], to_name);
            EXPECT_EQ(info["splats"], 300);
            EXPECT_EQ(info["sh_degree"], from == "all.splat" || to == "all.splat" ? 0 : 2);
        }
    }
    EXPECT_EQ(read_file(scratch_file("to_all.ply")).size(), read_file(ply).size());
}

// Cameras around a scene look at it wherever it is. (.splat keeps positions as they are.)
TEST(Convert, a_comparison_sees_a_scene_far_from_the_origin) {
    const std::string near = scene_file("near.ply", sample_model(0, 200)),
                      far = scratch_file("far.ply");
    ASSERT_EQ(darb("convert " + near + " " + far + " --translate 10000,0,0").code, 0);
    std::map<std::string, std::string> said;
    for (const std::string& ply : {near, far})
        said[ply] = darb("convert " + ply + " " + scratch_file("seen.splat") + " --compare").out;
    const auto psnr_of = [&](const std::string& ply) {
        return std::stod(said[ply].substr(said[ply].find("scene: ") + 7));
    };
    EXPECT_LT(psnr_of(near), 90) << said[near];
    EXPECT_NEAR(psnr_of(far), psnr_of(near), 3) << said[far];
}

TEST(Convert, edits_are_made_in_the_stated_order) {
    const SplatModel before = sample_model(3, 50);
    const std::string ply = scene_file("edit.ply", before);
    const Outcome o = darb("convert " + ply + " " + scratch_file("edited.ply") +
                           " --up y --rotate 0,0,90 --scale 2 --translate -1,2,3.5 --max-sh 1"
                           " --crop -100,-100,-100,100,100,100 --prune-opacity 0.4");
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.out.find("--prune-opacity"), std::string::npos) << o.out;
    SplatModel expected = before;
    prune_opacity(0.4, expected);
    ASSERT_GT(expected.size(), 5u);
    const SplatModel got = load_splats(scratch_file("edited.ply"));
    ASSERT_EQ(got.size(), expected.size());
    EXPECT_EQ(got.sh_degree, 1);
    for (size_t i = 0; i < got.size(); ++i) {
        // Half a turn about z, then a quarter: x y z becomes y -x z.
        const glm::dvec3 p = position_of(expected, i);
        EXPECT_LT(glm::distance(position_of(got, i),
                                glm::dvec3(2 * p.y - 1, -2 * p.x + 2, 2 * p.z + 3.5)),
                  1e-5);
    }
    ASSERT_EQ(
        darb("convert " + ply + " " + scratch_file("cropped.ply") + " --crop 0,-9,-9,9,9,9").code,
        0);
    for (const float x : load_splats(scratch_file("cropped.ply")).position)
        EXPECT_LE(std::abs(x), 1);
    ASSERT_EQ(darb("convert " + ply + " " + scratch_file("up.ply") + " --up -z").code, 0);
    EXPECT_NEAR(load_splats(scratch_file("up.ply")).position[1], before.position[2], 1e-6);
}

TEST(Convert, what_gets_lost_is_said) {
    SplatModel model = sample_model(1, 20);
    model.kernel = KERNEL_RAISED_COSINE;
    model.footprint = Footprint::exact;
    model.antialias = true;
    const std::string ply = scene_file("kernel.ply", model);
    EXPECT_NE(darb("convert " + ply + " " + scratch_file("k.spz")).err.find("raised_cosine"),
              std::string::npos);
    EXPECT_EQ(json::parse(darb("info --json - " + scratch_file("k.spz")).out)["render_mode"],
              "mip");
    EXPECT_EQ(darb("convert " + ply + " " + scratch_file("k.compressed.ply")).err, "");
    const json kept = json::parse(darb("info --json - " + scratch_file("k.compressed.ply")).out);
    EXPECT_EQ(kept["kernel"], "raised_cosine");
    EXPECT_EQ(kept["footprint"], "exact");
    EXPECT_EQ(kept["render_mode"], "mip");
    const std::string lost = darb("convert " + ply + " " + scratch_file("k.splat")).err;
    for (const char* word : {"raised_cosine", "anti-aliasing", "harmonics"})
        EXPECT_NE(lost.find(word), std::string::npos) << word << " in\n" << lost;
}

TEST(Convert, splats_that_are_not_drawn_are_left_out_and_counted) {
    SplatModel model = sample_model(0, 20);
    std::fill_n(model.rotation.begin(), 4, 0.0f);
    const std::string ply = scene_file("unturned.ply", model);
    for (const char* name : {"u.spz", "u.splat", "u.compressed.ply"}) {
        const Outcome o = darb("convert " + ply + " " + scratch_file(name));
        EXPECT_NE(o.err.find("1 splats with a rotation of length 0"), std::string::npos) << o.err;
        EXPECT_NE(o.out.find(", 19 splats, "), std::string::npos) << o.out;
    }
}

TEST(Convert, kernels_become_gaussians_with_the_error_printed) {
    SplatModel model = sample_model(0, 60);
    model.kernel = KERNEL_RAISED_COSINE;
    const std::string ply = scene_file("rc.ply", model);
    const Outcome o = darb("convert " + ply + " " + scratch_file("rc_gaussian.splat") +
                           " --kernel gaussian --compare");
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.out.find("renders of both kernels: "), std::string::npos) << o.out;
    EXPECT_NE(o.out.find("the file against the scene: "), std::string::npos) << o.out;
    EXPECT_EQ(o.err.find("kernel"), std::string::npos) << o.err;
    const SplatModel gaussians = load_splats(scratch_file("rc_gaussian.splat"));
    const GaussianEquivalent fit = gaussian_equivalent(KERNEL_RAISED_COSINE, Footprint::psi, false);
    EXPECT_NEAR(gaussians.log_scale[0], model.log_scale[0] + 0.5 * std::log(fit.covariance), 1e-5);
}

TEST(Convert, bad_options_are_refused) {
    const std::string ply = scene_file("bad.ply", sample_model(0, 3)),
                      to = " " + scratch_file("x.ply ");
    expect_refused(
        {{"convert " + ply, "output"},
         {"convert " + ply + " " + scratch_file("x.ksplat"), "no format that can be written"},
         {"convert " + ply + to + "--spz-version 3", "--spz-version"},
         {"convert " + ply + " " + scratch_file("x.spz") + " --spz-version 2", "--spz-version"},
         {"convert " + scratch_file("none.ply") + to, "none.ply"},
         {"convert " + ply + to + "--up w", "no axis"},
         {"convert " + ply + to + "--crop 1,2,3", "not 6 numbers"},
         {"convert " + ply + to + "--translate 1,2,3,4", "not 3 numbers"},
         {"convert " + ply + to + "--rotate 1,2,", "not 3 numbers"},
         {"convert " + ply + to + "--rotate 1,nan,2", "not 3 numbers"},
         {"convert " + ply + to + "--scale -1", "--scale"},
         {"convert " + ply + to + "--max-sh 4", "--max-sh"},
         {"convert " + ply + to + "--kernel sinc", "--kernel"},
         {"convert " + ply + to + "--prune-opacity 2", "--prune-opacity"}});
    EXPECT_FALSE(fs::exists(scratch_file("x.ply")));
    for (const std::string& edit :
         {std::string("--crop 50,50,50,60,60,60"), std::string("--prune-opacity 1")}) {
        expect_refused({{"convert " + ply + " " + scratch_file("none.ply") + " " + edit,
                         edit + ": keeps none of "}});
        EXPECT_FALSE(fs::exists(scratch_file("none.ply")));
    }
}

TEST(Convert, what_is_read_is_not_written_over) {
    const std::string run = scratch_file("run"),
                      inner = run + "/point_cloud/iteration_7/point_cloud.ply",
                      ply = scene_file("kept.ply", sample_model(0, 3)), sog = scratch_file("sog"),
                      data = scratch_file("data"), photo = data + "/a.png";
    save_splats(inner, SplatFormat::ply, sample_model(0, 3));
    ImageU8 picture;
    picture.width = picture.height = 8;
    picture.channels = 3;
    picture.data.resize(8 * 8 * 3);
    write_png(photo, picture);
    write_file_atomic(data + "/transforms.json",
                      R"({"camera_angle_x": 0.7, "frames": [{"file_path": "a.png",
                      "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,3],[0,0,0,1]]}]})");
    std::map<std::string, std::vector<std::byte>> before;
    for (const std::string& file : {inner, ply, sog + "/meta.json", sog + "/a.webp", photo}) {
        if (!fs::exists(file)) write_file_atomic(file, "{}");
        before[file] = read_file(file);
    }
    fs::create_symlink(ply, scratch_file("link.ply"));
    const auto over = [](const std::string& command) {
        return BadCommand{command, "is what is read"};
    };
    expect_refused(
        {over("convert " + run + " " + inner + " --scale 2"),
         over("convert " + scratch_file("link.ply") + " " + ply),
         over("info " + ply + " --json " + ply), over("info " + run + " --json " + inner),
         over("info " + sog + " --json " + sog + "/meta.json"),
         over("info " + sog + "/meta.json --json " + sog + "/a.webp"),
         over("eval " + ply + " none --json " + ply), over("cost " + ply + " --html " + ply),
         over("render " + ply + " --cameras " + data + " -o " + data)});
    for (const auto& [file, bytes] : before) EXPECT_EQ(read_file(file), bytes) << file;
}

TEST(Convert, a_pipe_takes_the_scene_and_stderr_what_is_said) {
    const std::string ply = scene_file("piped.ply", sample_model(0, 30)),
                      pipe = scratch_file("pipe.ply");
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    std::vector<std::byte> got;
    std::jthread reader([&] {
        std::ifstream file(pipe, std::ios::binary);
        for (char c; file.get(c);) got.push_back(static_cast<std::byte>(c));
    });
    const Outcome o = darb("convert " + ply + " " + pipe + " --crop 0,-9,-9,9,9,9");
    reader.join();
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(o.out, "");
    EXPECT_NE(o.err.find("--crop 0,-9,-9,9,9,9: "), std::string::npos) << o.err;
    EXPECT_NE(o.err.find(fmt::format("{} bytes", got.size())), std::string::npos) << o.err;
    EXPECT_GT(parse_splats(got, "pipe").size(), 0u);
}

TEST(Convert, several_files_are_written_and_none_that_is_read) {
    const std::string ply = scene_file("many.ply", sample_model(1, 40));
    for (const char* name : {"many/meta.json", "streamed/lod-meta.json", "gltf/a b.gltf"}) {
        const Outcome o = darb("convert " + ply + " '" + scratch_file(name) + "' --compare");
        ASSERT_EQ(o.code, 0) << o.err;
        EXPECT_NE(o.out.find("the file against the scene: "), std::string::npos) << o.out;
        const json info = json::parse(darb("info --json - '" + scratch_file(name) + "'").out);
        EXPECT_EQ(info["splats"], 40);
        EXPECT_GT(info["bytes"], fs::file_size(scratch_file(name)));
    }
    fs::copy_file(scratch_file("gltf/a b.bin"), scratch_file("gltf/c.bin"));
    fs::copy_file(scratch_file("many/meta.json"), scratch_file("many/kept.json"));
    for (const std::string& command :
         {"convert " + scratch_file("many") + " " + scratch_file("many/meta.json"),
          "convert '" + scratch_file("gltf/a b.gltf") + "' " + scratch_file("gltf/c.gltf")})
        expect_refused({{command, "is what is read"}});
    EXPECT_EQ(read_file(scratch_file("many/meta.json")), read_file(scratch_file("many/kept.json")));
}

TEST(Convert, spz_is_written_in_both_versions) {
    const std::string ply = scene_file("versions.ply", sample_model(2, 60));
    ASSERT_EQ(darb("convert " + ply + " " + scratch_file("v3.spz") + " --spz-version 3").code, 0);
    ASSERT_EQ(darb("convert " + ply + " " + scratch_file("v4.spz")).code, 0);
    SplatFile three, four;
    const SplatModel old = load_splats(scratch_file("v3.spz"), &three),
                     now = load_splats(scratch_file("v4.spz"), &four);
    EXPECT_EQ(three.version, 3);
    EXPECT_EQ(four.version, 4);
    EXPECT_TRUE(same_splats(old, now));
}

TEST(Convert, info_writes_a_file_and_names_the_format) {
    const std::string spz = scene_file("info.spz", sample_model(1, 30));
    const Outcome o = darb("info " + spz + " --json " + scratch_file("info.json"));
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.out.find("SPZ version 4"), std::string::npos) << o.out;
    const json info = json::parse(read_text_file(scratch_file("info.json")));
    EXPECT_EQ(info["version"], 4);
    EXPECT_EQ(info["splats"], 30);
}

/// 640 x 480 px, 45 degrees wide, at (-0.06, -1.6, 4), looking along -z with y down the picture.
Camera biker_camera() {
    Camera camera;
    camera.width = 640;
    camera.height = 480;
    camera.fx = camera.fy = 320 / std::tan(std::numbers::pi / 8);
    camera.cx = 320;
    camera.cy = 240;
    // x right and y up, z backward of a camera turned half about z: right -x, down y, forward -z.
    camera.rotation = glm::dmat3(-1, 0, 0, 0, 1, 0, 0, 0, -1);
    camera.translation = -(camera.rotation * glm::dvec3(-0.06, -1.6, 4));
    return camera;
}

TEST(Convert, biker_looks_alike_in_two_formats) {
    const auto folder = test_data_folder();
    if (!folder) GTEST_SKIP() << kNoTestData;
    ImageF images[2];
    const char* names[2] = {"biker.compressed.ply", "biker.spz"};
    for (int i = 0; i < 2; ++i) {
        const SplatModel model = load_splats(*folder / "splats" / names[i]);
        images[i] = Renderer(shared_device(), model).render(biker_camera());
    }
    // There is something to see: the biker covers a fifth of the frame.
    double covered = 0;
    for (size_t i = 0; i < images[0].data.size(); i += 3) covered += images[0].data[i] > 0.02f;
    EXPECT_GT(covered, 0.1 * 640 * 480);
    const double db = psnr(images[1], images[0]);
    RecordProperty("psnr_db", std::to_string(db));
    EXPECT_GT(db, 50) << "both are quantised, in different ways";
}

TEST(Convert, a_point_cloud_becomes_splats_that_show) {
    PointCloud cloud;
    for (int i = 0; i < 64; ++i) {
        for (const int v : {i % 8, i / 8, 40}) cloud.position.push_back(v * 0.1);
        for (const int v : {255, 128, 0}) cloud.colour.push_back(static_cast<std::uint8_t>(v));
    }
    const SplatModel model = points_as_splats(cloud);
    ASSERT_EQ(model.size(), 64u);
    for (size_t i = 0; i < 3 * model.size(); ++i)
        EXPECT_NEAR(std::exp(model.log_scale[i]), 0.1 / 3, 0.02);
    Camera camera;
    camera.width = camera.height = 64;
    camera.fx = camera.fy = 300;
    camera.cx = camera.cy = 32;
    camera.translation = {-0.35, -0.35, 0};
    const ImageF image = Renderer(shared_device(), model).render(camera);
    float most[3] = {0, 0, 0};
    for (size_t i = 0; i < image.data.size(); ++i)
        most[i % 3] = std::max(most[i % 3], image.data[i]);
    EXPECT_GT(most[0], 0.8f);
    EXPECT_NEAR(most[1], most[0] * 128 / 255, 0.01);
    EXPECT_LT(most[2], 0.01f);
    EXPECT_EQ(points_as_splats({}).size(), 0u);
}

}  // namespace
}  // namespace darb::test
