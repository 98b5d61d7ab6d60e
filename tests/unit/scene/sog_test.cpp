// SPDX-License-Identifier: MIT
#include "engine/scene/sog.h"

#include <fmt/format.h>
#include <unistd.h>
#include <webp/encode.h>
#include <zip.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "engine/core/files.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const Reader kReadSog = [](std::span<const std::byte> file) { return parse_sog(file, "test"); };

using Parts = std::map<std::string, FileBytes>;

FileBytes webp(int width, int height, const std::vector<int>& pixels) {
    std::vector<std::uint8_t> rgba(static_cast<size_t>(4 * width * height), 255);
    std::copy(pixels.begin(), pixels.end(), rgba.begin());
    std::uint8_t* out = nullptr;
    const size_t size = WebPEncodeLosslessRGBA(rgba.data(), width, height, 4 * width, &out);
    FileBytes bytes(size);
    std::memcpy(bytes.data(), out, size);
    WebPFree(out);
    return bytes;
}

json codebook(float first, float step) {
    json values;
    for (int i = 0; i < 256; ++i) values.push_back(first + step * static_cast<float>(i));
    return values;
}

/// Two splats with harmonics of degree 1.
json sample_meta() {
    return {
        {"version", 2},
        {"count", 2},
        {"antialias", true},
        {"asset", {{"generator", "by hand"}}},
        {"means",
         {{"mins", {-1, 0, 0}}, {"maxs", {1, 2, 4}}, {"files", {"means_l.webp", "means_u.webp"}}}},
        {"scales", {{"codebook", codebook(-10, 0.03125f)}, {"files", {"scales.webp"}}}},
        {"quats", {{"files", {"quats.webp"}}}},
        {"sh0", {{"codebook", codebook(-2, 0.015625f)}, {"files", {"sh0.webp"}}}},
        {"shN",
         {{"count", 66},
          {"bands", 1},
          {"codebook", codebook(-4, 0.03125f)},
          {"files", {"shN_centroids.webp", "shN_labels.webp"}}}}};
}

Parts sample_parts(const json& meta) {
    Parts parts;
    append_text(meta.dump(), parts["meta.json"]);
    parts["means_l.webp"] = webp(2, 1, {255, 0, 255, 255, 0, 0, 0, 255});
    parts["means_u.webp"] = webp(2, 1, {255, 0, 255, 255, 0, 128, 0, 255});
    parts["scales.webp"] = webp(2, 1, {0, 32, 255, 255, 1, 1, 1, 255});
    parts["quats.webp"] = webp(2, 1, {255, 0, 128, 253, 128, 128, 128, 252});
    parts["sh0.webp"] = webp(2, 1, {0, 128, 255, 51, 128, 128, 128, 255});
    std::vector<int> palette(4 * 192 * 2, 255);  // entry 65: the second row, pixels 3 to 5
    const std::vector<int> entry{128, 0, 160, 255, 129, 130, 131, 255, 132, 133, 134, 255};
    std::copy(entry.begin(), entry.end(), palette.begin() + 4 * (192 + 3));
    parts["shN_centroids.webp"] = webp(192, 2, palette);
    parts["shN_labels.webp"] = webp(2, 1, {65, 0, 0, 255, 66, 0, 0, 255});
    return parts;
}

FileBytes zip_of(const Parts& parts) {
    const fs::path path = fs::path(testing::TempDir()) / fmt::format("sog_{}.zip", ::getpid());
    fs::remove(path);
    zip_t* zip = zip_open(path.c_str(), ZIP_CREATE, nullptr);
    for (const auto& [name, bytes] : parts)
        zip_file_add(zip, name.c_str(), zip_source_buffer(zip, bytes.data(), bytes.size(), 0), 0);
    zip_close(zip);
    FileBytes bytes = read_file(path);
    fs::remove(path);
    return bytes;
}

void expect_sample(const SplatModel& model, const SogFacts& facts) {
    ASSERT_EQ(model.size(), 2u);
    EXPECT_EQ(model.sh_degree, 1);
    EXPECT_TRUE(model.antialias);
    EXPECT_EQ(facts.generator, "by hand");
    EXPECT_NEAR(model.position[0], std::exp(1) - 1, 1e-6);
    EXPECT_EQ(model.position[1], 0.f);
    EXPECT_NEAR(model.position[2], std::exp(4) - 1, 1e-5);
    EXPECT_NEAR(model.position[3], -(std::exp(1) - 1), 1e-6);
    EXPECT_NEAR(model.position[4], std::exp(2 * 32768 / 65535.0) - 1, 1e-6);
    EXPECT_EQ(model.log_scale[0], -10.f);
    EXPECT_EQ(model.log_scale[1], -9.f);
    EXPECT_EQ(model.log_scale[2], -10 + 255 * 0.03125f);
    EXPECT_EQ(model.sh_dc[1], 0.f);
    EXPECT_NEAR(model.opacity_logit[0], std::log(0.25), 1e-5);
    // x is the largest, w = sqrt(1/2), y = -sqrt(1/2), z = 1/255 sqrt(1/2); nothing is left for x.
    EXPECT_NEAR(model.rotation[0], std::sqrt(0.5), 1e-6);
    EXPECT_NEAR(model.rotation[2], -std::sqrt(0.5), 1e-6);
    EXPECT_NEAR(model.rotation[3], std::sqrt(0.5) / 255, 1e-6);
    EXPECT_NEAR(model.rotation[4], 1, 1e-4);
    const std::vector<float> harmonics{0,        -4,     1,        0.03125f, 0.0625f,
                                       0.09375f, 0.125f, 0.15625f, 0.1875f};
    EXPECT_EQ(std::vector<float>(model.sh_rest.begin(), model.sh_rest.begin() + 9), harmonics);
    EXPECT_EQ(model.sh_rest[9], 0.f);  // label 66 of 66
    EXPECT_EQ(facts.notes.size(), 1u);
}

TEST(Sog, a_zip_and_a_folder_decoded_by_hand) {
    const Parts parts = sample_parts(sample_meta());
    SogFacts facts;
    const FileBytes zip = zip_of(parts);
    EXPECT_TRUE(looks_like_zip(zip));
    expect_sample(parse_sog(zip, "test", &facts), facts);
    const fs::path folder = fs::path(testing::TempDir()) / fmt::format("sog_{}", ::getpid());
    for (const auto& [name, bytes] : parts) write_file_atomic(folder / name, bytes);
    expect_sample(read_sog_folder(folder, &facts), facts);
    fs::remove(folder / "quats.webp");
    EXPECT_NE(error_of([&] { read_sog_folder(folder); }).find("quats.webp"), std::string::npos);
    fs::remove_all(folder);
}

TEST(Sog, without_harmonics_the_degree_is_0) {
    json meta = sample_meta();
    meta.erase("shN");
    EXPECT_EQ(kReadSog(zip_of(sample_parts(meta))).sh_degree, 0);
    meta["count"] = 0;
    EXPECT_EQ(kReadSog(zip_of(sample_parts(meta))).size(), 0u);
}

TEST(Sog, anti_aliasing_goes_by_either_name) {
    const auto antialias = [](const char* key, const json& value) {
        json meta = sample_meta();
        meta.erase("antialias");
        meta[key] = value;
        return kReadSog(zip_of(sample_parts(meta))).antialias;
    };
    EXPECT_TRUE(antialias("model", "antialiased"));
    EXPECT_FALSE(antialias("model", "default"));
    EXPECT_FALSE(antialias("model", nullptr));
    EXPECT_FALSE(antialias("antialias", nullptr));
    EXPECT_FALSE(antialias("antialias", false));
}

TEST(Sog, a_zip_of_something_else_is_named_as_such) {
    Parts parts;
    append_text("text", parts["readme.txt"]);
    std::string error = error_of([&] { kReadSog(zip_of(parts)); });
    EXPECT_NE(error.find("not a SOG scene"), std::string::npos) << error;
    append_text("ply", parts["scene/point_cloud.ply"]);
    error = error_of([&] { kReadSog(zip_of(parts)); });
    EXPECT_NE(error.find("holds scene/point_cloud.ply"), std::string::npos) << error;
    EXPECT_NE(error.find("Unpack it"), std::string::npos) << error;
}

TEST(Sog, null_in_a_codebook_drops_the_splats_that_use_it_alone) {
    json meta = sample_meta();
    meta["scales"]["codebook"][1] = nullptr;  // the second splat's
    SogFacts facts;
    EXPECT_EQ(parse_sog(zip_of(sample_parts(meta)), "test", &facts).size(), 1u);
    EXPECT_EQ(facts.dropped, 1u);
    meta["scales"]["codebook"][1] = 0;
    meta["scales"]["codebook"][200] = nullptr;  // nobody's
    EXPECT_EQ(kReadSog(zip_of(sample_parts(meta))).size(), 2u);
}

TEST(Sog, any_count_of_the_palette_is_bounded_by_its_picture) {
    json meta = sample_meta();
    for (const std::uint64_t count :
         {std::uint64_t{0}, std::uint64_t{1} << 31, std::uint64_t{1} << 63}) {
        meta["shN"]["count"] = count;
        SogFacts facts;
        const SplatModel model = parse_sog(zip_of(sample_parts(meta)), "test", &facts);
        EXPECT_EQ(model.size(), 2u);
        EXPECT_EQ(model.sh_rest[1], count == 0 ? 0.f : -4.f);
    }
}

std::string error_of_meta(const std::string& pointer, const json& value) {
    json meta = sample_meta();
    meta[json::json_pointer(pointer)] = value;
    return error_of([&] { kReadSog(zip_of(sample_parts(meta))); });
}

TEST(Sog, wrong_meta_json_says_why) {
    EXPECT_NE(error_of_meta("/version", 1).find("version 1"), std::string::npos);
    for (const std::uint64_t count : {std::uint64_t{1} << 31, std::uint64_t{1} << 63})
        EXPECT_NE(error_of_meta("/count", count).find("declares"), std::string::npos);
    EXPECT_EQ(error_of_meta("/count", 0), "no error");
    EXPECT_NE(error_of_meta("/count", 5).find("too small for 5"), std::string::npos);
    EXPECT_NE(error_of_meta("/count", -1).find("count"), std::string::npos);
    EXPECT_NE(error_of_meta("/count", 1e30).find("count"), std::string::npos);
    EXPECT_NE(error_of_meta("/means", json::object()).find("files"), std::string::npos);
    EXPECT_NE(error_of_meta("/means/maxs/0", 1e30).find("range"), std::string::npos);
    EXPECT_NE(error_of_meta("/means/files/0", "other.webp").find("no such entry"),
              std::string::npos);
    EXPECT_NE(error_of_meta("/sh0/codebook", json::array()).find("codebook"), std::string::npos);
    EXPECT_NE(error_of_meta("/shN/bands", 3).find("px wide"), std::string::npos);
    EXPECT_NE(error_of_meta("/scales/codebook/3", "x").find("meta.json"), std::string::npos);
    Parts parts = sample_parts(sample_meta());
    parts["meta.json"].pop_back();
    EXPECT_NE(error_of([&] { kReadSog(zip_of(parts)); }).find("meta.json"), std::string::npos);
}

TEST(Sog, a_folder_and_a_zip_read_no_file_outside_them) {
    json meta = sample_meta();
    meta["quats"]["files"][0] = "../quats.webp";
    const fs::path folder = fs::path(testing::TempDir()) / fmt::format("sog_out_{}", ::getpid());
    for (const auto& [name, bytes] : sample_parts(meta)) write_file_atomic(folder / name, bytes);
    EXPECT_NE(error_of([&] { read_sog_folder(folder); }).find("no file of its folder"),
              std::string::npos);
    fs::remove_all(folder);
    for (const char* name : {"../quats.webp", "/quats.webp", "a/quats.webp", ".."}) {
        meta["quats"]["files"][0] = name;
        Parts parts = sample_parts(meta);
        parts[name] = parts["quats.webp"];  // the zip has such a member
        EXPECT_NE(error_of([&] { kReadSog(zip_of(parts)); }).find("no file of its folder"),
                  std::string::npos)
            << name;
    }
}

TEST(Sog, large_pictures_for_few_splats_are_refused) {
    Parts parts = sample_parts(sample_meta());
    parts["sh0.webp"] = webp(1100, 1100, {});
    EXPECT_NE(error_of([&] { kReadSog(zip_of(parts)); }).find("1100 x 1100"), std::string::npos);
    parts["sh0.webp"] = FileBytes(100);
    EXPECT_NE(error_of([&] { kReadSog(zip_of(parts)); }).find("no WebP"), std::string::npos);
}

TEST(Sog, a_flipped_bit_is_an_error_or_changes_nothing) {
    const FileBytes whole = zip_of(sample_parts(sample_meta()));
    const SplatModel model = parse_sog(whole, "test");
    std::size_t changed = 0, refused = 0;
    for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
        FileBytes file = whole;
        file[bit / 8] ^= std::byte(1 << bit % 8);
        try {
            changed += same_splats(parse_sog(file, "test"), model) ? 0 : 1;
        } catch (const Error&) {
            ++refused;
        }
    }
    EXPECT_EQ(changed, 0u) << "of " << 8 * whole.size() << ", " << refused << " refused";
    EXPECT_GT(refused, 4 * whole.size());
}

TEST(Sog, a_zip_names_no_file_in_another_folder) {
    json meta = sample_meta();
    meta["quats"]["files"] = {"a/quats.webp"};
    Parts parts = sample_parts(meta);
    parts["a/quats.webp"] = parts["quats.webp"];
    EXPECT_NE(error_of([&] { parse_sog(zip_of(parts), "test"); }).find("no file of its folder"),
              std::string::npos);
}

TEST(Sog, truncated_or_damaged_is_an_error) {
    const FileBytes zip = zip_of(sample_parts(sample_meta()));
    expect_truncation_is_refused(zip, kReadSog);
    expect_damage_is_survived(zip, kReadSog, 500);
}

}  // namespace
}  // namespace darb::test
