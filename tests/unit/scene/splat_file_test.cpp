// SPDX-License-Identifier: MIT
#include "engine/scene/splat_file.h"

#include <fmt/format.h>
#include <unistd.h>

#include <limits>
#include <span>
#include <utility>

#include "engine/core/files.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/inflate.h"
#include "engine/scene/ply.h"
#include "engine/scene/ply_table.h"
#include "tests/support/splat_files.h"
#include "tests/support/test_data.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;

TEST(SplatFile, formats_are_told_apart_by_content) {
    const SplatModel model = sample_model(0, 40);
    for (const SplatFormat format :
         {SplatFormat::ply, SplatFormat::compressed_ply, SplatFormat::dot_splat, SplatFormat::spz,
          SplatFormat::gltf, SplatFormat::sog}) {
        SplatFile file;
        EXPECT_EQ(parse_splats(encode_splats(format, model), "no name", &file).size(), 40u);
        EXPECT_EQ(file.format, format);
        EXPECT_GT(file.bytes, 0u);
    }
}

TEST(SplatFile, other_content_is_refused_by_name) {
    const auto error = [](const std::string& text) {
        FileBytes bytes;
        append_text(text, bytes);
        return error_of([&] { parse_splats(bytes, "test"); });
    };
    EXPECT_NE(error("").find("empty"), std::string::npos);
    EXPECT_NE(error(std::string(64, 'x')).find("no splat file"), std::string::npos);
    EXPECT_NE(error("PK\3\4").find("zip"), std::string::npos);
    FileBytes text;
    append_text("something else", text);
    EXPECT_NE(error_of([&] { parse_splats(gzip(text), "test"); }).find("test"), std::string::npos);
    EXPECT_NE(error_of([] { load_splats("/no/such/file.spz"); }).find("/no/such/file.spz"),
              std::string::npos);
}

TEST(SplatFile, streamed_sog_without_its_files_is_refused_by_name) {
    FileBytes bytes;
    append_text(R"({"lodLevels": 2, "filenames": ["0_0/meta.json"]})", bytes);
    EXPECT_NE(error_of([&] { parse_splats(bytes, "x/lod-meta.json"); }).find("streamed SOG"),
              std::string::npos);
}

TEST(SplatFile, a_point_cloud_is_named_as_one) {
    const std::string text =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
        "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
        "end_header\n1 2 3 4 5 6\n";
    FileBytes bytes;
    append_text(text, bytes);
    EXPECT_NE(error_of([&] { parse_splats(bytes, "test"); }).find("is a point cloud"),
              std::string::npos);
    EXPECT_EQ(error_of([&] { parse_splats(std::span(bytes).first(60), "a.ply"); }).find("a.ply"),
              0u);
    int read = 0;
    const auto read_points = [&](const PlyHeader& header) {
        ++read;
        EXPECT_EQ(header.find("vertex")->count, 1u);
        return SplatModel();
    };
    parse_splats(bytes, "test", nullptr, {}, {}, read_points);
    EXPECT_EQ(read, 1);
    for (const SplatFormat format : {SplatFormat::ply, SplatFormat::compressed_ply})
        parse_splats(encode_splats(format, sample_model(0, 1)), "test", nullptr, {}, {},
                     read_points);
    EXPECT_EQ(read, 1);
}

TEST(SplatFile, a_dot_splat_that_begins_like_gzip_is_read) {
    FileBytes file = encode_splats(SplatFormat::dot_splat, sample_model(0, 2));
    const float x = 1.25f;  // its two low bytes do not matter
    set_value(x, 0, file);
    file[0] = std::byte{0x1f};
    file[1] = std::byte{0x8b};
    SplatFile facts;
    EXPECT_EQ(parse_splats(file, "no name", &facts).size(), 2u);
    EXPECT_EQ(facts.format, SplatFormat::dot_splat);
}

TEST(SplatFile, harmonics_of_degree_4_are_left_out_of_a_ply_with_a_note) {
    std::string text = "ply\nformat ascii 1.0\nelement vertex 1\n", row;
    for (const char* name : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0",
                             "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"}) {
        text += fmt::format("property float {}\n", name);
        row += "1 ";
    }
    for (int i = 0; i < 72; ++i) {
        text += fmt::format("property float f_rest_{}\n", i);
        row += fmt::format("{} ", i);
    }
    FileBytes bytes;
    append_text(text + "end_header\n" + row + "\n", bytes);
    SplatFile file;
    const SplatModel model = parse_splats(bytes, "test", &file);
    EXPECT_EQ(model.sh_degree, 3);
    ASSERT_EQ(model.sh_rest.size(), 45u);
    for (size_t c = 0; c < 15; ++c)
        for (size_t k = 0; k < 3; ++k)
            EXPECT_EQ(model.sh_rest[3 * c + k], static_cast<float>(24 * k + c));
    ASSERT_EQ(file.notes.size(), 1u);
    EXPECT_NE(file.notes[0].find("degree 4"), std::string::npos);
}

TEST(SplatFile, names_choose_what_is_written) {
    EXPECT_EQ(format_to_write("a/b.ply"), SplatFormat::ply);
    EXPECT_EQ(format_to_write("b.Compressed.PLY"), SplatFormat::compressed_ply);
    EXPECT_EQ(format_to_write("b.splat"), SplatFormat::dot_splat);
    EXPECT_EQ(format_to_write("b.SPZ"), SplatFormat::spz);
    EXPECT_EQ(format_to_write("b.GLB"), SplatFormat::gltf);
    EXPECT_EQ(format_to_write("b.sog"), SplatFormat::sog);
    EXPECT_EQ(format_to_write("b/meta.json"), SplatFormat::sog);
    EXPECT_EQ(format_to_write("b/lod-meta.json"), SplatFormat::streamed_sog);
    EXPECT_FALSE(format_to_write("b/other-meta.json"));
    EXPECT_FALSE(format_to_write("ply"));
}

#define DARB_SPLAT_FORMAT(name) SplatFormat::name,
constexpr SplatFormat kFormats[] = {DARB_SPLAT_FORMATS(DARB_SPLAT_FORMAT)};
#undef DARB_SPLAT_FORMAT

// A format that cannot be written is asked for by no name; a name that asks for a format writes
// what its reader reads.
TEST(SplatFile, a_row_of_the_table_answers_everywhere) {
    const std::string all = endings_to_write();
    const fs::path folder = fs::path(testing::TempDir()) / fmt::format("table_{}", ::getpid());
    const SplatModel model = sample_model(0, 40);
    for (const SplatFormat format : kFormats) {
        EXPECT_FALSE(format_name(format).empty());
        EXPECT_NE(error_of([] { parse_splats({}, "none"); }).find("is empty"), std::string::npos);
        const std::string refused = error_of([] {
            FileBytes text;
            append_text("no such thing", text);
            parse_splats(text, "none");
        });
        EXPECT_NE(refused.find(format_name(format)), std::string::npos) << refused;
        if (error_of([&] {
                encode_scene(format, model, "none");
            }).find("can be read, but not written") != std::string::npos)
            continue;
        for (const std::string& ending : endings_of(format)) {
            const std::string name = ending.starts_with('.') ? "scene" + ending : ending;
            EXPECT_EQ(format_to_write(name), format) << name;
            EXPECT_NE(all.find(ending), std::string::npos) << all;
            save_splats(folder / ending / name, format, model);
            SplatFile file;
            EXPECT_EQ(load_splats(folder / ending / name, &file).size(), 40u) << name;
            EXPECT_EQ(file.format, format) << name;
        }
    }
    fs::remove_all(folder);
}

TEST(SplatFile, the_length_of_a_unit_is_kept_where_there_is_a_place) {
    SplatModel model = sample_model(1, 40);
    model.metres_per_unit = 0.1234567890123;
    const fs::path folder =
        fs::temp_directory_path() / ("darb_unit_length_" + std::to_string(::getpid()));
    for (const auto& [format, name] :
         {std::pair(SplatFormat::ply, "a.ply"), std::pair(SplatFormat::compressed_ply, "b.ply"),
          std::pair(SplatFormat::gltf, "c.glb"), std::pair(SplatFormat::sog, "d.sog"),
          std::pair(SplatFormat::streamed_sog, "e/lod-meta.json")}) {
        fs::create_directories((folder / name).parent_path());
        write_encoded(folder / name, encode_scene(format, model, name));
        EXPECT_EQ(load_splats(folder / name).metres_per_unit, model.metres_per_unit) << name;
    }
    fs::remove_all(folder);
    for (const SplatFormat format : {SplatFormat::spz, SplatFormat::dot_splat})
        EXPECT_NE(losses_of(format, model).back().find("a unit is 0.1235 m"), std::string::npos);
    transform_splats({.scale = 2}, model);
    EXPECT_EQ(model.metres_per_unit, 0.1234567890123 / 2) << "units are half as long now";
    EXPECT_EQ(pick_splats(model, {0, 1}).metres_per_unit, model.metres_per_unit);
}

TEST(SplatFile, a_length_of_a_unit_that_is_none_is_left_out) {
    const std::vector<std::byte> file = encode_splats(SplatFormat::ply, sample_model(0, 2));
    const std::string text(reinterpret_cast<const char*>(file.data()), file.size());
    const std::string known = "comment SplatFootprint";
    for (const char* bad : {"-1", "0", "nan", "1e999", "2 m", "much"}) {
        std::string changed = text;
        changed.insert(changed.find(known),
                       std::string("comment SplatMetresPerUnit: ") + bad + "\n");
        SplatFile facts;
        const auto bytes = std::as_bytes(std::span(changed.data(), changed.size()));
        EXPECT_EQ(parse_splats(bytes, "test", &facts).metres_per_unit, 0) << bad;
        ASSERT_FALSE(facts.notes.empty()) << bad;
        EXPECT_NE(facts.notes[0].find("is no length"), std::string::npos) << facts.notes[0];
    }
}

TEST(SplatFile, what_a_format_has_no_place_for_is_said) {
    SplatModel model = sample_model(2, 5);
    for (float& dc : model.sh_dc) dc = 0;
    EXPECT_TRUE(losses_of(SplatFormat::spz, model).empty());
    EXPECT_EQ(losses_of(SplatFormat::dot_splat, model).size(), 1u);  // harmonics
    model.kernel = KERNEL_SINC;
    model.antialias = true;
    model.sh_dc[0] = 3;
    EXPECT_TRUE(losses_of(SplatFormat::ply, model).empty());
    EXPECT_TRUE(losses_of(SplatFormat::compressed_ply, model).empty());
    ASSERT_EQ(losses_of(SplatFormat::spz, model).size(), 1u);
    EXPECT_NE(losses_of(SplatFormat::spz, model)[0].find("sinc"), std::string::npos);
    EXPECT_EQ(losses_of(SplatFormat::dot_splat, model).size(), 4u);
    model.origin.x = 1e6;
    EXPECT_EQ(losses_of(SplatFormat::spz, model).size(), 2u);
}

TEST(SplatFile, what_lies_outside_the_ranges_of_spz_is_counted) {
    SplatModel model = sample_model(1, 5);
    for (float& dc : model.sh_dc) dc = 3.3f;
    for (float& harmonic : model.sh_rest) harmonic = -1;
    EXPECT_TRUE(losses_of(SplatFormat::spz, model).empty());
    model.log_scale[0] = -13;
    model.log_scale[4] = 6.5f;
    model.sh_dc[2] = 3.5f;
    model.sh_rest[0] = model.sh_rest[1] = model.sh_rest[8] = 1.1f;
    model.position[3] = 4096;
    const std::vector<std::string> losses = losses_of(SplatFormat::spz, model);
    const char* expected[] = {
        "2 scales outside 4.5e-05 to 379 are cut to it, by up to 20.1 times",
        "1 colours outside -0.44 to 1.44 are cut to it",
        "3 coefficients of harmonics outside -1 to 0.99 are cut to it",
        ("positions reach 4096: all are rounded to steps of 0.000976562; --crop leaves out what "
         "lies far off")};
    ASSERT_EQ(losses.size(), std::size(expected));
    for (size_t i = 0; i < losses.size(); ++i) EXPECT_EQ(losses[i], expected[i]);
}

TEST(SplatFile, double_positions_of_a_ply_are_said_with_a_remedy) {
    SplatModel model = sample_model(0, 5);
    model.origin = {450012, 0, -5000012};
    const std::vector<std::string> losses = losses_of(SplatFormat::ply, model);
    ASSERT_EQ(losses.size(), 1u);
    EXPECT_NE(losses[0].find("double"), std::string::npos) << losses[0];
    EXPECT_NE(losses[0].find("--translate -450012,0,5000012"), std::string::npos) << losses[0];
}

TEST(SplatFile, positions_beyond_spz_name_the_file) {
    SplatModel model = sample_model(0, 2);
    model.position[0] = 1e9f;
    const fs::path path = fs::path(testing::TempDir()) / "far.spz";
    for (const std::string& error :
         {error_of([&] { save_splats(path, SplatFormat::spz, model); }),
          error_of([&] { losses_of(SplatFormat::spz, model, path.string()); })})
        EXPECT_EQ(error.find(path.string() + ": positions reach 1e+09"), 0u) << error;
}

constexpr SplatFormat kQuantised[] = {SplatFormat::compressed_ply, SplatFormat::dot_splat,
                                      SplatFormat::spz, SplatFormat::sog, SplatFormat::gltf};

TEST(SplatFile, splats_without_a_rotation_are_left_out_where_they_would_get_one) {
    SplatModel model = sample_model(0, 4);
    for (size_t k = 0; k < 4; ++k) {
        model.rotation[4 + k] = 0;
        model.rotation[8 + k] = 4e-7f;  // has length 8e-7: not drawn either
    }
    EXPECT_EQ(parse_splats(encode_splats(SplatFormat::ply, model), "test").size(), 4u);
    EXPECT_TRUE(losses_of(SplatFormat::ply, model).empty());
    for (const SplatFormat format : kQuantised) {
        EXPECT_EQ(parse_splats(encode_splats(format, model), "test").size(), 2u)
            << format_name(format);
        const std::vector<std::string> losses = losses_of(format, model);
        ASSERT_FALSE(losses.empty()) << format_name(format);
        EXPECT_EQ(losses[0].find("2 splats with a rotation of length 0"), 0u) << losses[0];
    }
}

TEST(SplatFile, opacities_of_0_and_1_stay_so) {
    SplatModel model = sample_model(0, 2);
    model.opacity_logit = {-30, 30};
    for (const SplatFormat format : kQuantised) {
        std::vector<float> opacity =
            parse_splats(encode_splats(format, model), "test").opacity_logit;
        std::sort(opacity.begin(), opacity.end());
        EXPECT_EQ(opacity, model.opacity_logit) << format_name(format);
    }
}

TEST(SplatFile, files_are_written_whole_and_nan_is_left_out) {
    const fs::path path = fs::path(testing::TempDir()) / fmt::format("darb_{}.spz", ::getpid());
    SplatModel model = sample_model(1, 6);
    model.opacity_logit[2] = std::numeric_limits<float>::quiet_NaN();
    save_splats(path, SplatFormat::spz, model);
    SplatFile file;
    EXPECT_EQ(load_splats(path, &file).size(), 5u);
    EXPECT_EQ(file.version, 4);
    EXPECT_EQ(file.bytes, fs::file_size(path));
    EXPECT_FALSE(fs::exists(path.string() + ".tmp"));
    fs::remove(path);
    EXPECT_NE(error_of([&] {
                  save_splats("/proc/none/x.spz", SplatFormat::spz, model);
              }).find("cannot be written"),
              std::string::npos);
}

struct RealScene {
    const char* path;
    SplatFormat format;
    int version;
    size_t splats;
    int sh_degree;
};

TEST(SplatFile, real_scenes_of_every_format_are_read) {
    const auto folder = test_data_folder();
    if (!folder) GTEST_SKIP() << kNoTestData;
    const RealScene scenes[] = {
        {"biker.compressed.ply", SplatFormat::compressed_ply, 0, 152746, 0},
        {"toy-cat.compressed.ply", SplatFormat::compressed_ply, 0, 23261, 3},
        {"grimlock.compressed.ply", SplatFormat::compressed_ply, 0, 224112, 0},
        {"biker.spz", SplatFormat::spz, 4, 152746, 0},
        {"gs_Skull_redux.splat", SplatFormat::dot_splat, 0, 86818, 0},
        {"Unicorn_Stuffy_cleaned.sog", SplatFormat::sog, 2, 49602, 3},
        {"playbot_sog", SplatFormat::sog, 2, 125000, 2},
        {"playbot_sog/meta.json", SplatFormat::sog, 2, 125000, 2}};
    for (const RealScene& scene : scenes) {
        SplatFile file;
        const SplatModel model = load_splats(*folder / "splats" / scene.path, &file);
        EXPECT_EQ(file.format, scene.format) << scene.path;
        EXPECT_EQ(file.version, scene.version) << scene.path;
        EXPECT_EQ(model.size(), scene.splats) << scene.path;
        EXPECT_EQ(model.sh_degree, scene.sh_degree) << scene.path;
        EXPECT_EQ(file.dropped, 0u) << scene.path;
        EXPECT_TRUE(file.notes.empty()) << scene.path;
    }
}

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

// The expanded file was made by another program.
TEST(SplatFile, compressed_ply_agrees_with_an_independent_expansion) {
    const auto folder = test_data_folder();
    if (!folder) GTEST_SKIP() << kNoTestData;
    for (const char* name : {"biker", "toy-cat"}) {
        const fs::path base = *folder / "splats" / name;
        SplatModel a = load_splats(base.string() + ".compressed.ply");
        // It keeps opacities 1/512 away from 0 and 1.
        for (float& logit : a.opacity_logit)
            logit = std::clamp(logit, -std::log(511.0f), std::log(511.0f));
        const SplatModel b = load_splats(base.string() + ".decoded.ply");
        ASSERT_EQ(a.size(), b.size());
        ASSERT_EQ(a.sh_degree, b.sh_degree);
        const auto near = [&](const std::vector<float>& x, const std::vector<float>& y,
                              double most) {
            double worst = 0;
            for (size_t i = 0; i < x.size(); ++i)
                worst = std::max(worst, std::abs(double{x[i]} - y[i]));
            EXPECT_LE(worst, most) << name;
        };
        near(a.position, b.position, 1e-6);
        near(a.log_scale, b.log_scale, 2e-6);
        near(a.opacity_logit, b.opacity_logit, 1e-5);
        near(a.sh_dc, b.sh_dc, 1e-5);
        // It takes byte / 255, where the writers of the format take the middle of a 256th.
        near(a.sh_rest, b.sh_rest, 8 * 0.5 / 256 + 1e-6);
        for (size_t i = 0; i < a.size(); ++i)
            ASSERT_GT(same_rotation(a, i, b, i), 1 - 1e-6) << name << " " << i;
    }
}

TEST(SplatFile, biker_is_the_same_in_two_formats) {
    const auto folder = test_data_folder();
    if (!folder) GTEST_SKIP() << kNoTestData;
    const SplatModel a = load_splats(*folder / "splats/biker.compressed.ply");
    const SplatModel b = load_splats(*folder / "splats/biker.spz");
    ASSERT_EQ(a.size(), b.size());
    std::vector<double> distance, shape;
    for (size_t i = 0; i < a.size(); ++i) {
        distance.push_back(glm::distance(position_of(a, i), position_of(b, i)));
        const glm::dmat3 p = covariance_of(a, i), q = covariance_of(b, i);
        double square = 0, size = 0;
        for (int k = 0; k < 3; ++k) {
            square += glm::dot(p[k] - q[k], p[k] - q[k]);
            size += glm::dot(p[k], p[k]);
        }
        shape.push_back(std::sqrt(square / size));
    }
    EXPECT_LT(median(distance), 2e-4);  // 1/4096 a step
    EXPECT_LT(median(shape), 0.05);     // 1/32 in a log scale is 6 % of a variance
}

}  // namespace
}  // namespace darb::test
