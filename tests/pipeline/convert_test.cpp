// SPDX-License-Identifier: MIT
// Runs darb convert and darb info on scenes in every format: checks what is written, what is
// printed, and that pictures agree between formats.

#include <sys/stat.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <thread>

#include "engine/core/count_text.h"
#include "engine/data/image_io.h"
#include "engine/data/metrics.h"
#include "engine/data/point_cloud_ply.h"
#include "engine/render/renderer.h"
#include "engine/scene/camera.h"
#include "engine/scene/dot_splat.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/subject.h"
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
        ASSERT_EQ(darb("convert --no-measure " + ply + " " + scratch_file("to_" + from)).code, 0)
            << from;
        for (const auto& [to, to_name] : names) {
            const Outcome o = darb("convert --no-measure --force " + scratch_file("to_" + from) +
                                   " " + scratch_file("again_" + to));
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
        said[ply] =
            darb("convert " + ply + " " + scratch_file("seen.splat") + " --compare --force").out;
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
    EXPECT_EQ(darb("convert --no-measure " + ply + " " + scratch_file("k.compressed.ply")).err, "");
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

/// Rows that vary smoothly: harmonics that 4 bits show the steps of, in splats that fill the view.
SplatModel shaded_model(size_t count) {
    SplatModel model = sample_model(3, count);
    for (float& scale : model.log_scale) scale = -2.5f;
    for (float& logit : model.opacity_logit) logit = 3;
    for (size_t i = 0; i < model.sh_rest.size(); ++i) model.sh_rest[i] *= 0.3f;
    return model;
}

double worst_db_of(const std::string& said) {
    const size_t at = said.find(" dB at worst"), from = said.rfind(' ', at - 1);
    return at == std::string::npos ? -1 : std::stod(said.substr(from + 1));
}

TEST(Convert, spz_keeps_as_many_bits_as_pictures_need) {
    const std::string ply = scene_file("shaded.ply", shaded_model(300));
    const Outcome o = darb("convert " + ply + " " + scratch_file("shaded.spz"));
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.out.find("harmonics rounded at level "), std::string::npos) << o.out;
    const double found = worst_db_of(o.out);
    // The coarsest precision alone, against what was chosen.
    const SplatModel model = load_splats(ply);
    EncodeOptions coarsest;
    coarsest.precision = 0;
    const SplatModel coarse =
        parse_splats(encode_scene(SplatFormat::spz, model, "coarse", coarsest).file, "coarse");
    Renderer a(shared_device(), model), b(shared_device(), coarse);
    double coarse_db = 100;
    for (const Camera& camera : orbit_cameras(model, 8, 480, 360))
        coarse_db = std::min(coarse_db, psnr(b.render(camera), a.render(camera)));
    EXPECT_LT(coarse_db, 49) << "the case shows nothing";
    EXPECT_GT(found, coarse_db + 1) << o.out;
    const auto whole = fs::file_size(scratch_file("shaded.spz"));
    const Outcome small = darb("convert " + ply + " " + scratch_file("small.spz") +
                               fmt::format(" --max-size {}", whole / 2));
    ASSERT_EQ(small.code, 0) << small.err;
    EXPECT_LE(fs::file_size(scratch_file("small.spz")), whole / 2);
    EXPECT_LT(worst_db_of(small.out), found) << small.out;
    EXPECT_GT(worst_db_of(small.out), 5) << small.out;
}

TEST(Convert, every_lossy_format_says_its_loss_and_exact_ones_that_they_are) {
    const std::string ply = scene_file("said.ply", sample_model(1, 60));
    for (const char* name : {"said.compressed.ply", "said.splat", "said.spz", "said.sog",
                             "said_sog/meta.json", "said_lod/lod-meta.json"}) {
        const Outcome o = darb("convert " + ply + " " + scratch_file(name));
        ASSERT_EQ(o.code, 0) << o.err;
        EXPECT_NE(o.out.find("the file against the scene: "), std::string::npos) << name << o.out;
        EXPECT_GT(worst_db_of(o.out), 5) << name << o.out;
    }
    const Outcome exact = darb("convert " + ply + " " + scratch_file("same.ply"));
    EXPECT_NE(exact.out.find("has the values of the scene"), std::string::npos) << exact.out;
    const Outcome part =
        darb("convert " + ply + " " + scratch_file("part.ply") + " --max-size 6KB");
    EXPECT_NE(part.out.find(" merged from 60"), std::string::npos) << part.out << part.err;
    EXPECT_LE(fs::file_size(scratch_file("part.ply")), 6000u);
    EXPECT_GT(worst_db_of(part.out), 5) << part.out;
}

TEST(Convert, without_a_device_scenes_are_written_and_the_loss_is_not_measured) {
    const std::string ply = scene_file("alone.ply", sample_model(2, 3000));
    ASSERT_EQ(::setenv("VK_DRIVER_FILES", "/nonexistent.json", 1), 0);
    ASSERT_EQ(::setenv("VK_ICD_FILENAMES", "/nonexistent.json", 1), 0);
    for (const char* name : {"alone.spz", "alone.sog", "alone.splat", "alone.ply.glb"}) {
        const Outcome o = darb("convert " + ply + " " + scratch_file(name));
        EXPECT_EQ(o.code, 0) << o.err;
        EXPECT_EQ(load_splats(scratch_file(name)).size(), 3000u);
        EXPECT_NE(o.out.find("not measured"), std::string::npos) << name << o.out;
        EXPECT_NE(o.err.find("not measured"), std::string::npos) << name << o.err;
        const Outcome quick = darb("convert --no-measure " + ply + " " + scratch_file(name));
        EXPECT_EQ(quick.code, 0) << quick.err;
        EXPECT_EQ(quick.err.find("Vulkan"), std::string::npos) << name << quick.err;
    }
    EXPECT_EQ(darb("convert " + ply + " " + scratch_file("named.spz") + " --device 0").code, 2);
    const Outcome few = darb("convert " + ply + " " + scratch_file("few.ply") + " --splats 9");
    EXPECT_EQ(few.code, 0) << few.err;
    EXPECT_EQ(load_splats(scratch_file("few.ply")).size(), 9u);
    ::unsetenv("VK_DRIVER_FILES");
    ::unsetenv("VK_ICD_FILENAMES");
}

TEST(Convert, a_page_shows_what_the_cameras_of_the_run_saw_as_they_were_held) {
    const fs::path run = scratch() / "held";
    fs::create_directories(run);
    const std::string ply = scene_file("held/scene.ply", sample_model(0, 60));
    const auto page_of = [&](const std::string& scene, const std::string& options = "") {
        const std::string file = scratch_file("held.html"), mark = "id=\"scene\">";
        const Outcome o = darb("convert --force " + scene + " " + file + options);
        EXPECT_EQ(o.code, 0) << o.err;
        const std::string page = read_text_file(file);
        const std::size_t from = page.find(mark) + mark.size();
        return json::parse(page.substr(from, page.find("</script>", from) - from));
    };
    const auto expect_up = [](const json& page, const glm::dvec3& up) {
        for (int i = 0; i < 3; ++i) EXPECT_NEAR(page["up"][i].get<double>(), up[i], 1e-9) << i;
    };
    // Held upside down, which no guess from the splats would find.
    json cameras = json::array();
    for (int i = 0; i < 3; ++i)
        cameras.push_back({{"id", i},
                           {"img_name", fmt::format("photo{}.jpg", i)},
                           {"width", 64},
                           {"height", 48},
                           {"position", {0.1 * i, 0, -4}},
                           {"rotation", {{-1, 0, 0}, {0, -1, 0}, {0, 0, 1}}},
                           {"fx", 60},
                           {"fy", 60}});
    write_file_atomic(run / "cameras.json", cameras.dump());
    const json held = page_of(ply);
    expect_up(held, {0, 1, 0});
    ASSERT_EQ(held["cameras"].size(), 3U);
    EXPECT_EQ(held["cameras"][0]["name"], "photo0.jpg");
    expect_up(page_of(ply, " --rotate 180,0,0"), {0, -1, 0});
    expect_up(page_of(ply, " --up z"), {0, -1, 0});
    write_file_atomic(run / "cameras.json", "[");
    EXPECT_EQ(page_of(ply)["cameras"].size(), 8U) << "a list that cannot be read costs no page";
    fs::remove(run / "cameras.json");
    std::string text = read_text_file(ply);
    text.insert(text.find("element"), "comment Vertical axis: z\n");
    write_file_atomic(ply, text);
    expect_up(page_of(ply), {0, 0, 1});
    expect_up(page_of(ply, " --up z --rotate 0,0,90"), {1, 0, 0});
}

TEST(Convert, a_file_that_is_there_is_replaced_by_the_same_scene_alone) {
    const std::string a = scene_file("a.ply", sample_model(0, 30)),
                      b = scene_file("b.ply", sample_model(0, 40)),
                      out = scratch_file("once.splat"), to = " " + out + " --no-measure",
                      there = "already exists";
    ASSERT_EQ(darb("convert " + a + to).code, 0);
    EXPECT_EQ(darb("convert " + a + to).code, 0) << "the same again";
    save_splats(a, SplatFormat::ply, sample_model(0, 31));
    EXPECT_EQ(darb("convert " + a + to).code, 0) << "the same scene, trained on";
    expect_refused({{"convert " + b + to, there},
                    {"convert " + b + " " + a, there},
                    {"convert " + a + " " + b + " -o" + to, there}});
    EXPECT_EQ(load_splats(out).size(), 31u);
    EXPECT_EQ(darb("convert --force " + b + to).code, 0);
    EXPECT_EQ(load_splats(out).size(), 40u);
    fs::remove(out);
    save_splats(out, SplatFormat::dot_splat, sample_model(0, 50));  // somebody else's by now
    expect_refused({{"convert " + b + to, there}});
    const std::string folder = scratch_file("folder.ply"), loop = scratch_file("loop.ply"),
                      hard = scratch_file("hard.ply");
    fs::create_directories(folder);
    fs::create_symlink(loop, loop);
    fs::create_hard_link(a, hard);
    write_file_atomic(scratch_file("lod.2.ply"), "mine");
    write_file_atomic(scratch_file("sogs/quats.webp"), "mine");
    expect_refused(
        {{"convert --force " + a + " " + folder, "is a folder"},
         {"convert --force " + a + " " + loop, "symbolic links"},
         {"convert --force " + a + " " + hard, "is what is read"},
         {"convert " + a + " " + scratch_file("lod.ply") + " --levels 2", there},
         {"convert " + a + " " + scratch_file("sogs/meta.json") + " --no-measure", there}});
    EXPECT_FALSE(fs::exists(scratch_file("lod.1.ply")));
    EXPECT_FALSE(fs::exists(scratch_file("sogs/meta.json")));
    write_file_atomic(scratch_file("empty.splat"), "");
    EXPECT_EQ(darb("convert --no-measure " + a + " " + scratch_file("empty.splat")).code, 0);
}

TEST(Convert, several_scenes_become_one) {
    SplatModel first = sample_model(1, 30), second = sample_model(3, 20, 2), far = second;
    for (float& p : second.position) p += 3;
    far.origin = {4e5, 0, 5e6};
    const std::string a = scene_file("join_a.ply", first), b = scene_file("join_b.ply", second),
                      c = scene_file("join_c.ply", far), out = scratch_file("joined.ply");
    const Outcome o = darb("convert " + a + " " + b + " -o " + out);
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.err.find("degree 1; those up to 3 are zero"), std::string::npos) << o.err;
    const SplatModel joined = load_splats(out);
    ASSERT_EQ(joined.size(), 50u);
    EXPECT_EQ(joined.sh_degree, 3);
    EXPECT_TRUE(std::equal(first.position.begin(), first.position.end(), joined.position.begin()));
    EXPECT_TRUE(
        std::equal(second.position.begin(), second.position.end(), joined.position.begin() + 90));
    EXPECT_TRUE(
        std::equal(second.sh_rest.begin(), second.sh_rest.end(), joined.sh_rest.begin() + 30 * 45));
    for (size_t i = 0; i < 30; ++i)
        for (size_t k = 0; k < 45; ++k)
            EXPECT_EQ(joined.sh_rest[45 * i + k], k < 9 ? first.sh_rest[9 * i + k] : 0);
    const std::string apart = scratch_file("apart.ply");
    const Outcome wide = darb("convert " + a + " " + c + " -o " + apart);
    ASSERT_EQ(wide.code, 0) << wide.err;
    EXPECT_NE(wide.err.find("rounded by"), std::string::npos) << wide.err;
    const SplatModel both = load_splats(apart);
    for (size_t i = 0; i < 30; ++i)
        EXPECT_LT(glm::distance(position_of(both, i), position_of(first, i)), 0.5);
    SplatModel cosine = first;
    cosine.kernel = KERNEL_RAISED_COSINE;
    const std::string k = scene_file("join_k.ply", cosine), new_out = scratch_file("gaussian.ply");
    expect_refused({{"convert " + a + " " + k + " -o " + new_out, "--kernel gaussian"},
                    {"convert " + a + " " + a + " -o " + new_out, "is named twice"},
                    {"convert " + a + " " + b + " " + new_out, "-o OUT"},
                    {"convert --force " + a + " " + b + " -o " + b, "is what is read"}});
    EXPECT_EQ(darb("convert --kernel gaussian " + a + " " + k + " -o " + new_out).code, 0);
    EXPECT_EQ(load_splats(new_out).kernel, KERNEL_GAUSSIAN);
    EXPECT_EQ(load_splats(new_out).size(), 60u);
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
    EXPECT_NE(o.err.find(fmt::format("{} bytes", count_text(got.size()))), std::string::npos)
        << o.err;
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
