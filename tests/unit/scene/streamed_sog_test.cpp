// SPDX-License-Identifier: MIT
// Streamed SOG: levels in files, and a tree that says where their splats are.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "engine/core/files.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/merge_splats.h"
#include "engine/scene/splat_file.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class StreamedSog : public testing::Test {
  protected:
    void SetUp() override { fs::remove_all(folder_); }
    void TearDown() override { fs::remove_all(folder_); }

    json meta() const { return json::parse(read_text_file(folder_ / "lod-meta.json")); }
    /// The result of reading after a change to lod-meta.json.
    std::string error_after(const std::string& pointer, const json& value) const {
        json changed = meta();
        changed[json::json_pointer(pointer)] = value;
        const fs::path other = folder_ / "other";
        fs::create_directories(other);
        for (const char* part : {"0_0", "1_0"})
            if (fs::exists(folder_ / part) && !fs::exists(other / part))
                fs::copy(folder_ / part, other / part);
        write_file_atomic(other / "lod-meta.json", changed.dump());
        return error_of([&] { load_splats(other); });
    }

    fs::path folder_ = fs::path(testing::TempDir()) / fmt::format("streamed_{}", ::getpid());
};

/// Checks the leaves under a node: every range lies in its file, and every bound in its parent's.
void check_node(const json& node, std::vector<size_t>& counts) {
    for (int axis = 0; axis < 3; ++axis)
        EXPECT_LE(node["bound"]["min"][axis], node["bound"]["max"][axis]);
    if (node.contains("children"))
        for (const json& child : node["children"]) {
            for (int axis = 0; axis < 3; ++axis) {
                EXPECT_GE(child["bound"]["min"][axis], node["bound"]["min"][axis]);
                EXPECT_LE(child["bound"]["max"][axis], node["bound"]["max"][axis]);
            }
            check_node(child, counts);
        }
    if (!node.contains("lods")) return;
    for (const auto& [level, lod] : node["lods"].items())
        counts[std::stoul(level)] += lod["count"].get<size_t>();
}

TEST_F(StreamedSog, levels_are_written_and_the_finest_is_read) {
    const SplatModel model = sample_model(0, 40'000);
    EncodeOptions options;
    options.coarser = {merge_splats(model, 2000)};
    write_encoded(folder_ / "lod-meta.json",
                  encode_scene(SplatFormat::streamed_sog, model, "lod-meta.json", options));
    const json said = meta();
    EXPECT_EQ(said["version"], 1);
    EXPECT_EQ(said["lodLevels"], 2);
    EXPECT_EQ(said["counts"], json({40'000, 2000}));
    EXPECT_EQ(said["count"], 42'000);
    EXPECT_EQ(said["filenames"], json({"0_0/meta.json", "1_0/meta.json"}));
    EXPECT_TRUE(said["tree"].contains("children"));
    std::vector<size_t> counts(2);
    check_node(said["tree"], counts);
    EXPECT_EQ(counts, (std::vector<size_t>{40'000, 2000}));
    EXPECT_EQ(load_splats(folder_ / "1_0").size(), 2000u);
    SplatFile facts;
    const SplatModel got = load_splats(folder_, &facts);
    EXPECT_EQ(facts.format, SplatFormat::streamed_sog);
    ASSERT_EQ(got.size(), model.size());
    std::vector<float> before = model.position, after = got.position;
    std::ranges::sort(before);
    std::ranges::sort(after);
    for (size_t i = 0; i < before.size(); ++i) ASSERT_NEAR(before[i], after[i], 2e-4);
    EXPECT_EQ(facts.notes.size(), 1u);
    StoredUnits units;
    units.level = 1;
    EXPECT_EQ(load_splats(folder_, &facts, units).size(), 2000u);
    EXPECT_EQ(facts.notes.size(), 0u);
    EXPECT_NE(facts.details.find("level 1"), std::string::npos);
    units.level = 2;
    const std::string error = error_of([&] { load_splats(folder_, &facts, units); });
    EXPECT_NE(error.find("has 2 levels of detail, no level 2"), std::string::npos) << error;
    EXPECT_NE(error.find("--lod 0"), std::string::npos) << error;
    save_splats(folder_ / "one.ply", SplatFormat::ply, model);
    EXPECT_NE(error_of([&] {
                  load_splats(folder_ / "one.ply", &facts, units);
              }).find("has no levels of detail"),
              std::string::npos);
}

/// Checks that the rows that each leaf names lie within its box. Returns the number of leaves.
int check_rows(const json& node, const std::vector<SplatModel>& files) {
    int leaves = 0;
    if (node.contains("children"))
        for (const json& child : node["children"]) leaves += check_rows(child, files);
    if (!node.contains("lods")) return leaves;
    for (const auto& [level, lod] : node["lods"].items()) {
        const SplatModel& file = files[lod["file"].get<size_t>()];
        const size_t offset = lod["offset"], count = lod["count"];
        for (size_t i = offset; i < offset + count; ++i)
            for (int axis = 0; axis < 3; ++axis) {
                const double x = position_of(file, i)[axis];
                EXPECT_GE(x, node["bound"]["min"][axis].get<double>() - 1e-3) << i;
                EXPECT_LE(x, node["bound"]["max"][axis].get<double>() + 1e-3) << i;
                if (testing::Test::HasFailure()) return leaves;
            }
    }
    return leaves + 1;
}

TEST_F(StreamedSog, rows_of_a_leaf_are_those_of_its_file) {
    SplatModel model = sample_model(0, 40'000);
    std::ranges::fill(model.log_scale, -7.0f);  // boxes of leaves hardly overlap
    EncodeOptions options;
    options.file_splats = 20'000;
    write_encoded(folder_ / "lod-meta.json",
                  encode_scene(SplatFormat::streamed_sog, model, "lod-meta.json", options));
    const json said = meta();
    std::vector<SplatModel> files;
    for (const std::string name : said["filenames"])
        files.push_back(load_splats(folder_ / fs::path(name).parent_path()));
    ASSERT_GT(files.size(), 3u);
    for (const SplatModel& file : files) EXPECT_LE(file.size(), 20'000u);
    EXPECT_GT(check_rows(said["tree"], files), 3);
}

TEST_F(StreamedSog, levels_are_merged_where_none_are_given) {
    save_splats(folder_ / "lod-meta.json", SplatFormat::streamed_sog, sample_model(1, 4000));
    EXPECT_EQ(meta()["counts"], json({4000, 1000}));
}

TEST_F(StreamedSog, hostile_trees_are_refused_by_name) {
    save_splats(folder_ / "lod-meta.json", SplatFormat::streamed_sog, sample_model(0, 30));
    EXPECT_EQ(error_after("/asset/generator", "x"), "no error");
    for (const char* name : {"../0_0/meta.json", "/0_0/meta.json", "http://a/meta.json", "0_0/x",
                             "0_0\\..\\meta.json", ""})
        EXPECT_NE(error_after("/filenames/0", name).find("folder below"), std::string::npos)
            << name;
    EXPECT_NE(error_after("/version", 2).find("version 2"), std::string::npos);
    EXPECT_NE(error_after("/tree/lods/0/file", 9).find("9"), std::string::npos);
    EXPECT_NE(error_after("/tree/lods/0/count", 31).find("rows 0 to 31"), std::string::npos);
    EXPECT_NE(error_after("/tree/lods/0/count", 1'000'000'000).find("declares"), std::string::npos);
    EXPECT_NE(error_after("/tree/lods/0/offset", 0xffffffffffffffffu).find("rows"),
              std::string::npos);
    EXPECT_NE(error_after("/tree/lods/0/offset", -1).find("no whole number"), std::string::npos);
    json deep = 1;
    for (int i = 0; i < 300; ++i) deep = json::array({deep});
    EXPECT_NE(error_after("/tree", deep).find("nested"), std::string::npos);
}

TEST_F(StreamedSog, files_cut_off_at_every_byte_are_refused) {
    save_splats(folder_ / "lod-meta.json", SplatFormat::streamed_sog, sample_model(0, 30));
    const FileBytes whole = read_file(folder_ / "lod-meta.json");
    const std::string where = "test/lod-meta.json";
    expect_truncation_is_refused(whole, [&](std::span<const std::byte> file) {
        return parse_splats(file, where, nullptr, {}, folder_);
    });
}

}  // namespace
}  // namespace darb::test
