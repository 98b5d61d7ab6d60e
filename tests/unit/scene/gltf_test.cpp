// SPDX-License-Identifier: MIT
// glTF with KHR_gaussian_splatting: what is written can be read back, files in the style of other
// writers are read as they state, and hostile ones are refused.
#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>

#include "engine/core/files.h"
#include "engine/scene/dot_splat.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_file.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

SplatModel read(const FileBytes& file, SplatFile* facts = nullptr) {
    return parse_splats(file, "test", facts);
}
const Reader kReadGltf = [](std::span<const std::byte> file) {
    return parse_splats(file, "test.gltf");
};

FileBytes glb(const SplatModel& model) {
    return encode_splats(SplatFormat::gltf, model);
}

fs::path scratch_folder(const char* name) {
    const fs::path folder =
        fs::path(testing::TempDir()) / fmt::format("gltf_{}_{}", name, ::getpid());
    fs::remove_all(folder);
    fs::create_directories(folder);
    return folder;
}

std::string base64(const FileBytes& bytes) {
    const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (size_t i = 0; i < bytes.size(); i += 3) {
        unsigned word = 0;
        for (size_t k = 0; k < 3; ++k)
            word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned>(bytes[i + k]) : 0u);
        for (size_t k = 0; k < 4; ++k)
            text += i + k > bytes.size() ? '=' : digits[word >> (18 - 6 * k) & 63];
    }
    return text;
}

/// A .gltf made by hand: accessors are added, the buffer is a data URI.
struct Handmade {
    FileBytes buffer;
    json document = {{"asset", {{"version", "2.0"}}}, {"scenes", {{{"nodes", {0}}}}},
                     {"nodes", {{{"mesh", 0}}}},      {"meshes", {{{"primitives", json::array()}}}},
                     {"accessors", json::array()},    {"bufferViews", json::array()}};

    template <class T>
    size_t add(const std::vector<T>& values, int type, const char* shape, size_t count,
               bool normalized = false) {
        document["bufferViews"].push_back({{"buffer", 0},
                                           {"byteOffset", buffer.size()},
                                           {"byteLength", values.size() * sizeof(T)}});
        for (const T value : values) append_value(value, buffer);
        document["accessors"].push_back({{"bufferView", document["bufferViews"].size() - 1},
                                         {"componentType", type},
                                         {"type", shape},
                                         {"count", count},
                                         {"normalized", normalized}});
        return document["accessors"].size() - 1;
    }

    json& primitive() { return document["meshes"][0]["primitives"][0]; }

    FileBytes file() const {
        json whole = document;
        whole["buffers"] = {{{"byteLength", buffer.size()},
                             {"uri", "data:application/octet-stream;base64," + base64(buffer)}}};
        FileBytes bytes;
        append_text(whole.dump(), bytes);
        return bytes;
    }
};

/// Two splats; rotations are normalised bytes, opacities normalised shorts.
Handmade handmade() {
    Handmade made;
    json attributes = {
        {"POSITION", made.add<float>({1, 2, 3, -4, 5, -6}, 5126, "VEC3", 2)},
        {"KHR_gaussian_splatting:SCALE", made.add<float>({1, 0.5f, 2, 1, 1, 1}, 5126, "VEC3", 2)},
        {"KHR_gaussian_splatting:ROTATION",
         made.add<std::int8_t>({0, 0, 0, 127, 127, 0, 0, 0}, 5120, "VEC4", 2, true)},
        {"KHR_gaussian_splatting:OPACITY",
         made.add<std::uint16_t>({13107, 65535}, 5123, "SCALAR", 2, true)},
        {"KHR_gaussian_splatting:SH_DEGREE_0_COEF_0",
         made.add<float>({0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.6f}, 5126, "VEC3", 2)}};
    made.document["meshes"][0]["primitives"].push_back(
        {{"attributes", attributes},
         {"mode", 0},
         {"extensions", {{"KHR_gaussian_splatting", {{"kernel", "ellipse"}}}}}});
    return made;
}

TEST(Gltf, what_is_written_is_read_back) {
    for (int degree = 0; degree <= 3; ++degree) {
        const SplatModel model = sample_model(degree, 7);
        SplatFile facts;
        const SplatModel got = read(glb(model), &facts);
        EXPECT_EQ(facts.format, SplatFormat::gltf);
        EXPECT_EQ(facts.version, 2);
        ASSERT_EQ(got.size(), 7u);
        EXPECT_EQ(got.sh_degree, degree);
        EXPECT_EQ(got.position, model.position);
        EXPECT_EQ(got.sh_dc, model.sh_dc);
        EXPECT_EQ(got.sh_rest, model.sh_rest);
        for (size_t i = 0; i < 7; ++i) {
            EXPECT_NEAR(opacity_of(got.opacity_logit[i]), opacity_of(model.opacity_logit[i]), 1e-6);
            EXPECT_NEAR(same_rotation(got, i, model, i), 1, 1e-6);
            for (size_t k = 0; k < 3; ++k)
                EXPECT_NEAR(got.log_scale[3 * i + k], model.log_scale[3 * i + k], 1e-6);
        }
    }
}

TEST(Gltf, every_kernel_comes_back_bit_by_bit) {
    for (const int kernel : {KERNEL_GAUSSIAN, KERNEL_RAISED_COSINE, KERNEL_SINC,
                             KERNEL_HALF_COSINE_SQUARED, KERNEL_INVERSE_QUADRATIC})
        for (const Footprint footprint : {Footprint::psi, Footprint::exact}) {
            SplatModel model = sample_model(2, 9);
            model.kernel = kernel;
            model.footprint = footprint;
            model.antialias = true;
            model.origin = {450012.25, -3, 5000012.5};
            for (float& part : model.rotation) part *= 3;  // any length is allowed
            const SplatModel got = read(glb(model));
            EXPECT_TRUE(same_splats(got, model)) << kernel_name(kernel);
            EXPECT_EQ(got.kernel, kernel);
            EXPECT_EQ(got.footprint, footprint);
        }
}

TEST(Gltf, other_programs_see_the_nearest_gaussians) {
    SplatModel model = sample_model(1, 5);
    model.kernel = KERNEL_RAISED_COSINE;
    FileBytes file = glb(model);
    const std::string name = "EXT_gaussian_splatting_kernel_radial";
    for (size_t i = 0; i + name.size() < file.size(); ++i)  // no longer known
        if (std::memcmp(&file[i], name.data(), name.size()) == 0) file[i] = std::byte{'X'};
    const SplatModel got = read(file), expected = as_gaussians(model, false);
    EXPECT_EQ(got.kernel, KERNEL_GAUSSIAN);
    for (size_t i = 0; i < 3 * got.size(); ++i)
        EXPECT_NEAR(got.log_scale[i], expected.log_scale[i], 1e-6);
    for (size_t i = 0; i < got.size(); ++i)
        EXPECT_NEAR(opacity_of(got.opacity_logit[i]), opacity_of(expected.opacity_logit[i]), 1e-6);
    const std::vector<std::string> losses = losses_of(SplatFormat::gltf, model);
    ASSERT_EQ(losses.size(), 1u);
    EXPECT_NE(losses[0].find("raised_cosine"), std::string::npos) << losses[0];
    EXPECT_TRUE(losses_of(SplatFormat::gltf, sample_model(3, 5)).empty());
}

TEST(Gltf, a_buffer_lies_beside_whatever_it_is_called) {
    const fs::path folder = scratch_folder("beside");
    const SplatModel model = sample_model(1, 4);
    for (const char* name : {"a.gltf", "a b%2f\"\n\xc3\xbc.gltf"}) {
        save_splats(folder / name, SplatFormat::gltf, model);
        SplatFile facts;
        EXPECT_EQ(load_splats(folder / name, &facts).position, model.position) << name;
        fs::path binary = folder / name;
        binary.replace_extension(".bin");
        EXPECT_EQ(facts.bytes, fs::file_size(folder / name) + fs::file_size(binary));
    }
    fs::remove(folder / "a.bin");
    EXPECT_NE(error_of([&] { load_splats(folder / "a.gltf"); }).find("a.bin"), std::string::npos);
    fs::remove_all(folder);
}

TEST(Gltf, integers_and_a_data_uri_are_read_by_hand) {
    const SplatModel model = read(handmade().file());
    ASSERT_EQ(model.size(), 2u);
    // y up and z backward become y down and z forward.
    EXPECT_EQ(model.position, (std::vector<float>{1, -2, -3, -4, -5, 6}));
    EXPECT_NEAR(opacity_of(model.opacity_logit[0]), 0.2, 1e-6);
    EXPECT_GT(model.opacity_logit[1], 20);
    EXPECT_NEAR(model.log_scale[1], std::log(0.5), 1e-6);
    EXPECT_EQ(model.sh_dc[4], 0.5f);
    // Half a turn about x after none, and after half a turn about x.
    EXPECT_NEAR(std::abs(model.rotation[1]), 1, 1e-6);
    EXPECT_NEAR(std::abs(model.rotation[4]), 1, 1e-6);
}

TEST(Gltf, nodes_carry_splats_to_their_places) {
    Handmade made = handmade();
    const double half = std::numbers::sqrt2 / 2;  // a quarter turn about z
    made.document["nodes"] = {
        {{"translation", {10, 0, 0}}, {"children", {1, 2}}},
        {{"mesh", 0}, {"scale", {2, 2, 2}}, {"rotation", {0, 0, half, half}}},
        {{"mesh", 0}, {"matrix", {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 7, 1}}}};
    const SplatModel model = read(made.file());
    ASSERT_EQ(model.size(), 4u);
    // The last child comes first: mirrored in x.
    EXPECT_NEAR(model.position[0], 10 - 1, 1e-5);
    EXPECT_NEAR(model.position[1], -2, 1e-5);
    EXPECT_NEAR(model.position[2], -(3 + 7), 1e-5);
    EXPECT_NEAR(model.position[6], 10 - 2 * 2, 1e-5);  // x y becomes -y x
    EXPECT_NEAR(model.position[7], -2, 1e-5);
    EXPECT_NEAR(model.position[8], -6, 1e-5);
    EXPECT_NEAR(model.log_scale[6], std::log(2), 1e-5);
    const glm::dmat3 before = covariance_of(read(handmade().file()), 0),
                     after = covariance_of(model, 2);
    EXPECT_NEAR(after[0][0], 4 * before[1][1], 1e-5);
    EXPECT_NEAR(after[1][1], 4 * before[0][0], 1e-5);
}

TEST(Gltf, primitives_of_several_degrees_and_meshes_between_them) {
    Handmade made = handmade();
    json second = made.primitive();
    for (int c = 0; c < 3; ++c)
        second["attributes"][fmt::format("KHR_gaussian_splatting:SH_DEGREE_1_COEF_{}", c)] =
            second["attributes"]["KHR_gaussian_splatting:SH_DEGREE_0_COEF_0"];
    made.document["meshes"][0]["primitives"].push_back(second);
    made.document["meshes"][0]["primitives"].push_back(
        {{"attributes", {{"POSITION", 0}}}, {"mode", 4}});
    SplatFile facts;
    const SplatModel model = read(made.file(), &facts);
    EXPECT_EQ(model.size(), 4u);
    EXPECT_EQ(model.sh_degree, 1);
    EXPECT_EQ(model.sh_rest[0], 0);
    EXPECT_NE(model.sh_rest[18], 0);
    ASSERT_EQ(facts.notes.size(), 1u);
    EXPECT_NE(facts.notes[0].find("1 primitives that are no splats"), std::string::npos);
}

TEST(Gltf, colours_fall_back_to_those_of_the_points) {
    Handmade made = handmade();
    json& attributes = made.primitive()["attributes"];
    attributes.erase("KHR_gaussian_splatting:SH_DEGREE_0_COEF_0");
    attributes["COLOR_0"] =
        made.add<std::uint8_t>({255, 0, 51, 9, 0, 0, 0, 0}, 5121, "VEC4", 2, true);
    SplatFile facts;
    const SplatModel model = read(made.file(), &facts);
    EXPECT_NEAR(model.sh_dc[0], 0.5 / 0.28209479, 1e-5);
    EXPECT_NEAR(model.sh_dc[2], (0.2 - 0.5) / 0.28209479, 1e-5);
    ASSERT_EQ(facts.notes.size(), 1u);
    EXPECT_NE(facts.notes[0].find("COLOR_0"), std::string::npos);
}

TEST(Gltf, what_is_not_followed_is_said) {
    Handmade made = handmade();
    made.primitive()["extensions"]["KHR_gaussian_splatting"] = {
        {"kernel", "cube\x1b"}, {"colorSpace", "lin_rec709_display"}, {"projection", "fisheye"}};
    made.primitive()["attributes"]["KHR_gaussian_splatting:SCALE"] =
        made.add<float>({-1, -2, -3, 0, -1, 0}, 5126, "VEC3", 2);
    SplatFile facts;
    const SplatModel model = read(made.file(), &facts);
    ASSERT_EQ(facts.notes.size(), 4u);
    EXPECT_EQ(facts.notes[0].find('\x1b'), std::string::npos);
    EXPECT_EQ(model.log_scale[1], -2);  // a draft's logarithms
}

struct Hostile {
    const char* what;
    std::function<void(Handmade&)> change;
    const char* said;
};

TEST(Gltf, hostile_documents_are_refused_by_name) {
    const auto node = [](const json& fields) {
        return [fields](Handmade& m) { m.document["nodes"][0].update(fields); };
    };
    const auto accessor = [](const json& fields) {
        return [fields](Handmade& m) { m.document["accessors"][0].update(fields); };
    };
    const std::vector<Hostile> cases = {
        {"cycle", node({{"children", {0}}}), "met twice"},
        {"no such node", node({{"children", {7}}}), "7"},
        {"no such mesh", node({{"mesh", 3}}), "3"},
        {"negative mesh", node({{"mesh", -1}}), "mesh"},
        {"bent", node({{"matrix", {1, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}}), "bends"},
        {"flat", node({{"scale", {1, 1, 0}}}), "differently"},
        {"nothing", node({{"scale", {0, 0, 0}}}), "differently"},
        {"beyond", accessor({{"count", 3}}), "within its buffer"},
        {"far beyond", accessor({{"count", 0xffffffffffffffffu}}), "within its buffer"},
        {"offset", accessor({{"byteOffset", 0xfffffffffffffffcu}}), "within its buffer"},
        {"sparse", accessor({{"sparse", {{"count", 1}}}}), "sparse"},
        {"type", accessor({{"type", "MAT4"}}), "MAT4"},
        {"component", accessor({{"componentType", 5130}}), "5130"},
        {"large component", accessor({{"componentType", 54121}}), "54121"},
        {"wrapped component", accessor({{"componentType", 65536 + 5126}}), "70662"},
        {"double", accessor({{"componentType", 5125}}), "POSITION"},
        {"few", [](Handmade& m) { m.document["accessors"][3]["count"] = 1; }, "1 values"},
        {"needs", [](Handmade& m) { m.document["extensionsRequired"] = {"EXT_meshopt\x07"}; },
         "EXT_meshopt\\x07"},
        {"version", [](Handmade& m) { m.document["asset"]["version"] = "3.0"; }, "3.0"},
        {"mode", [](Handmade& m) { m.primitive()["mode"] = 4; }, "mode 0"},
        {"hole",
         [](Handmade& m) {
             for (const int c : {0, 1})
                 m.primitive()["attributes"]
                              [fmt::format("KHR_gaussian_splatting:SH_DEGREE_1_COEF_{}", c)] = 4;
         },
         "SH_DEGREE_1_COEF_2"},
        {"no splats", [](Handmade& m) { m.primitive().erase("extensions"); }, "no splats"},
        {"stride", [](Handmade& m) { m.document["bufferViews"][0]["byteStride"] = 4; },
         "within its buffer"},
    };
    for (const Hostile& hostile : cases) {
        Handmade made = handmade();
        hostile.change(made);
        const FileBytes file = made.file();
        const std::string error = error_of([&] { kReadGltf(file); });
        EXPECT_EQ(error.find("test.gltf"), 0u) << hostile.what << ": " << error;
        EXPECT_NE(error.find(hostile.said), std::string::npos) << hostile.what << ": " << error;
    }
}

// Each instance is 16 bytes of JSON and as many splats as the mesh has.
TEST(Gltf, a_mesh_that_is_named_often_is_no_way_to_fill_the_memory) {
    Handmade made = handmade();
    json nodes = json::array(), roots = json::array();
    const SplatModel large = sample_model(0, 4000);
    made.document["accessors"][0]["bufferView"] = made.document["bufferViews"].size();
    made.document["accessors"][0]["count"] = 4000;
    made.add(large.position, 5126, "VEC3", 4000);
    for (int i = 0; i < 5000; ++i) {
        nodes.push_back({{"mesh", 0}});
        roots.push_back(i);
    }
    made.document["nodes"] = nodes;
    made.document["scenes"][0]["nodes"] = roots;
    const std::string error = error_of([&] { kReadGltf(made.file()); });
    EXPECT_NE(error.find("declares"), std::string::npos) << error;
}

TEST(Gltf, json_that_is_nested_without_end_is_refused) {
    FileBytes file;
    append_text("{\"asset\":" + std::string(1'000'000, '['), file);
    EXPECT_NE(error_of([&] { kReadGltf(file); }).find("nested"), std::string::npos);
}

TEST(Gltf, only_files_beside_it_are_read) {
    const fs::path folder = scratch_folder("outside");
    Handmade made = handmade();
    json whole = made.document;
    write_file_atomic(folder / "secret.bin", made.buffer);
    fs::create_directories(folder / "in" / "below");
    write_file_atomic(folder / "in" / "below" / "x.bin", made.buffer);
    const auto error = [&](const std::string& uri) {
        whole["buffers"] = {{{"byteLength", made.buffer.size()}, {"uri", uri}}};
        write_file_atomic(folder / "in" / "a.gltf", whole.dump());
        return error_of([&] { load_splats(folder / "in" / "a.gltf"); });
    };
    EXPECT_EQ(error("below/x.bin"), "no error");
    for (const std::string& uri :
         {std::string("../secret.bin"), std::string("%2e%2e/secret.bin"),
          std::string("below/../../secret.bin"), (folder / "secret.bin").string(),
          "file://" + (folder / "secret.bin").string(), std::string("http://example.org/x.bin"),
          std::string("..\\secret.bin"), std::string("x%00.bin"), std::string("")})
        EXPECT_NE(error(uri).find("no file beside"), std::string::npos)
            << uri << ": " << error(uri);
    EXPECT_NE(error("%zz").find("two digits"), std::string::npos);
    EXPECT_NE(error("data:text/plain,abc").find("not base64"), std::string::npos);
    EXPECT_NE(error("data:;base64,AA*A").find("beyond base64"), std::string::npos);
    EXPECT_NE(error("data:;base64,AAAA").find("has 3 bytes of"), std::string::npos);
    FileBytes file;
    append_text(whole.dump(), file);
    fs::remove_all(folder);
}

TEST(Gltf, files_cut_off_at_every_byte_are_refused) {
    expect_truncation_is_refused(glb(sample_model(1, 2)), [](std::span<const std::byte> file) {
        return parse_splats(file, "test");
    });
    expect_truncation_is_refused(handmade().file(), kReadGltf);
}

TEST(Gltf, damaged_files_are_survived) {
    SplatModel model = sample_model(1, 3);
    model.kernel = KERNEL_SINC;
    expect_damage_is_survived(glb(model), kReadGltf, 1500);
    expect_damage_is_survived(handmade().file(), kReadGltf, 1500);
}

}  // namespace
}  // namespace darb::test
