// SPDX-License-Identifier: MIT
// LCC: values by hand, levels of detail, and damage.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_file.h"
#include "tests/support/lcc_files.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;

class Lcc : public testing::Test {
  protected:
    void SetUp() override { fs::remove_all(folder_); }
    void TearDown() override { fs::remove_all(folder_); }

    SplatModel read(std::optional<std::size_t> level = {}, SplatFile* facts = nullptr) const {
        StoredUnits units;
        units.level = level;
        return load_splats(folder_ / "meta.lcc", facts, units);
    }
    std::string error_of_scene(const LccScene& scene) const {
        fs::remove_all(folder_);
        scene.write();
        const std::string error = error_of([&] { read(); });
        EXPECT_NE(error.find("\n  "), std::string::npos) << "no remedy in: " << error;
        return error;
    }

    const fs::path folder_ = fs::path(testing::TempDir()) / fmt::format("lcc_{}", ::getpid());
};

TEST_F(Lcc, values_are_those_of_the_white_paper) {
    lcc_scene(folder_, true).write();
    SplatFile facts;
    const SplatModel m = read({}, &facts);
    EXPECT_EQ(facts.format, SplatFormat::lcc);
    EXPECT_EQ(facts.up, "z");
    EXPECT_EQ(facts.dropped, 0u);
    EXPECT_NE(facts.details.find("originated from XGRIDS"), std::string::npos);
    ASSERT_EQ(m.size(), 4u) << "three of level 0, one of the environment";
    EXPECT_EQ(m.metres_per_unit, 1);
    EXPECT_EQ(m.sh_degree, 3);
    EXPECT_EQ(position_of(m, 1), glm::dvec3(0, 1, 0));
    EXPECT_EQ(position_of(m, 2), glm::dvec3(1, 0, 0));
    EXPECT_NEAR(m.log_scale[0], std::log(0.5), 1e-6);
    EXPECT_NEAR(m.log_scale[1], std::log(0.5 + 32768 / 65535.0), 1e-6);
    EXPECT_NEAR(m.log_scale[2], std::log(1.5), 1e-6);
    EXPECT_NEAR(0.5 + 0.28209479177387814 * m.sh_dc[0], 128 / 255.0, 1e-6);
    EXPECT_NEAR(opacity_of(m.opacity_logit[0]), 204 / 255.0, 1e-6);
    EXPECT_NEAR(m.rotation[0], 1, 2e-6) << "w x y z";
    EXPECT_NEAR(m.rotation[1], (512 / 1023.0 * 2 - 1) * std::sqrt(0.5), 1e-6);
    for (int c = 0; c < 15; ++c) {
        EXPECT_NEAR(m.sh_rest[3 * c], 1, 1e-6);
        EXPECT_NEAR(m.sh_rest[3 * c + 1], -1, 1e-6);
        EXPECT_NEAR(m.sh_rest[3 * c + 2], -1 + 2 * 1024 / 2047.0, 1e-6);
    }
    EXPECT_NEAR(m.log_scale[9], std::log(10), 1e-6) << "the environment has a range of its own";
    EXPECT_NEAR(m.sh_rest[3 * 45], -2, 1e-6);
}

// The largest component is left out: index 0 is x.
TEST_F(Lcc, the_place_of_the_largest_component_is_found) {
    LccScene scene = lcc_scene(folder_, false);
    for (std::uint32_t place = 0; place < 4; ++place) {
        const std::uint32_t bits = place << 30 | 512u << 20 | 512u << 10 | 512u;
        std::copy_n(std::as_bytes(std::span(&bits, 1)).begin(), 4, scene.data.begin() + 22);
        fs::remove_all(folder_);
        scene.write();
        const SplatModel m = read();
        EXPECT_NEAR(m.rotation[(place + 1) % 4], 1, 1e-5) << place;
    }
}

TEST_F(Lcc, each_level_is_read_when_it_is_asked_for) {
    lcc_scene(folder_, false).write();
    SplatFile facts;
    EXPECT_EQ(read({}, &facts).size(), 4u);
    EXPECT_TRUE(std::ranges::any_of(facts.notes, [](const std::string& note) {
        return note.find("--lod 1 to 1") != std::string::npos;
    }));
    const SplatModel coarse = read(1, &facts);
    ASSERT_EQ(coarse.size(), 2u);
    EXPECT_EQ(coarse.sh_degree, 0);
    EXPECT_EQ(position_of(coarse, 0), glm::dvec3(0, 0, 1));
    EXPECT_EQ(position_of(coarse, 1), glm::dvec3(100, 100, 100));
    const std::string error = error_of([&] { read(2); });
    EXPECT_NE(error.find("has 2 levels of detail, no level 2"), std::string::npos) << error;
    EXPECT_NE(error.find("--lod 0"), std::string::npos) << error;
}

TEST_F(Lcc, what_contradicts_itself_is_refused_by_name) {
    const LccScene whole = lcc_scene(folder_, true);
    const auto with_meta = [&](const char* key, const nlohmann::json& value) {
        LccScene scene = whole;
        scene.meta[key] = value;
        return error_of_scene(scene);
    };
    EXPECT_NE(with_meta("totalLevel", 0).find("0 levels"), std::string::npos);
    EXPECT_NE(with_meta("totalLevel", -1).find("no whole number"), std::string::npos);
    EXPECT_NE(with_meta("splats", {9, 1}).find("has 3 splats of level 0"), std::string::npos);
    EXPECT_NE(with_meta("encoding", "RAW").find("encoding RAW"), std::string::npos);
    EXPECT_NE(with_meta("fileType", "Huge").find("fileType Huge"), std::string::npos);
    EXPECT_NE(with_meta("attributes", nlohmann::json::array()).find("no scale"), std::string::npos);
    LccScene scene = whole;
    scene.data.resize(scene.data.size() - 32);
    EXPECT_NE(error_of_scene(scene).find("which holds 96"), std::string::npos);
    scene = whole;
    scene.shcoef.resize(64);
    EXPECT_NE(error_of_scene(scene).find("Shcoef.bin"), std::string::npos);
    scene = whole;
    scene.environment.pop_back();
    EXPECT_NE(error_of_scene(scene).find("no splats of 96"), std::string::npos);
    scene = whole;
    scene.index.pop_back();
    EXPECT_NE(error_of_scene(scene).find("no units of 36"), std::string::npos);
    scene = whole;
    scene.index[4] = std::byte{200};
    EXPECT_NE(error_of_scene(scene).find("unit 0"), std::string::npos);
    fs::remove(folder_ / "Index.bin");
    EXPECT_NE(error_of([&] { read(); }).find("needs index.bin"), std::string::npos);
}

TEST_F(Lcc, descriptions_cut_off_at_every_byte_are_refused) {
    const LccScene scene = lcc_scene(folder_, false);
    scene.write();
    FileBytes whole;
    append_text(scene.meta.dump(), whole);
    expect_truncation_is_refused(whole, [&](std::span<const std::byte> file) {
        return parse_splats(file, "test.lcc", nullptr, {}, folder_);
    });
    expect_damage_is_survived(
        whole,
        [&](std::span<const std::byte> file) {
            return parse_splats(file, "test.lcc", nullptr, {}, folder_);
        },
        300);
}

}  // namespace
}  // namespace darb::test
