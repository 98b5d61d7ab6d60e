// SPDX-License-Identifier: MIT
// Writing SOG: what is read back, from a zip and from a folder.
#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <set>

#include "engine/core/files.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/quantise.h"
#include "engine/scene/splat_file.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;

/// The splats in the order of the file.
SplatModel ordered(const SplatModel& model) {
    return pick_splats(model, chunk_order(model, 256));
}

double folded(double x) {
    return std::copysign(std::log1p(std::abs(x)), x);
}

void expect_near(const SplatModel& got, const SplatModel& model, double harmonics) {
    ASSERT_EQ(got.size(), model.size());
    ASSERT_EQ(got.sh_degree, model.sh_degree);
    EXPECT_EQ(got.antialias, model.antialias);
    double square = 0, whole = 0;
    for (size_t i = 0; i < model.size(); ++i) {
        for (int k = 0; k < 3; ++k) {
            const size_t at = 3 * i + static_cast<size_t>(k);
            EXPECT_NEAR(folded(position_of(got, i)[k]), folded(position_of(model, i)[k]), 6e-5);
            EXPECT_NEAR(got.log_scale[at], model.log_scale[at], 0.03);
            EXPECT_NEAR(got.sh_dc[at], model.sh_dc[at], 0.02);
        }
        EXPECT_NEAR(opacity_of(got.opacity_logit[i]), opacity_of(model.opacity_logit[i]),
                    0.51 / 255);
        EXPECT_GT(same_rotation(got, i, model, i), 1 - 3e-5);
    }
    for (size_t i = 0; i < model.sh_rest.size(); ++i) {
        square += std::pow(double{got.sh_rest[i]} - model.sh_rest[i], 2);
        whole += std::pow(double{model.sh_rest[i]}, 2);
    }
    EXPECT_LE(square, harmonics * harmonics * whole);
}

// Up to 1,024 splats, each has its own row in the palette.
TEST(SogWrite, a_scene_comes_back_from_a_zip) {
    for (int degree = 0; degree <= 3; ++degree) {
        SplatModel model = sample_model(degree, 700);
        model.antialias = degree == 1;
        SplatFile facts;
        const FileBytes zip = encode_splats(SplatFormat::sog, model, "a.sog");
        expect_near(parse_splats(zip, "test", &facts), ordered(model), 0.02);
        EXPECT_EQ(facts.format, SplatFormat::sog);
        EXPECT_EQ(facts.version, 2);
        EXPECT_NE(facts.details.find("darb"), std::string::npos);
        EXPECT_TRUE(facts.notes.empty());
    }
}

TEST(SogWrite, a_scene_comes_back_from_a_folder) {
    const fs::path folder = fs::path(testing::TempDir()) / fmt::format("sog_out_{}", ::getpid());
    const SplatModel model = sample_model(1, 90);
    save_splats(folder / "meta.json", SplatFormat::sog, model);
    SplatFile facts;
    expect_near(load_splats(folder, &facts), ordered(model), 0.02);
    EXPECT_EQ(facts.details.substr(0, 6), "folder");
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename());
    EXPECT_EQ(names, (std::set<std::string>{"meta.json", "means_l.webp", "means_u.webp",
                                            "quats.webp", "scales.webp", "sh0.webp",
                                            "shN_centroids.webp", "shN_labels.webp"}));
    fs::remove_all(folder);
}

TEST(SogWrite, a_palette_stands_for_more_splats_than_it_has_rows) {
    const SplatModel model = sample_model(1, 1900);  // 1,024 rows
    const SplatModel got = parse_splats(encode_splats(SplatFormat::sog, model), "test");
    expect_near(got, ordered(model), 0.5);
}

TEST(SogWrite, the_same_scene_gives_the_same_bytes) {
    const SplatModel model = sample_model(2, 300);
    EXPECT_EQ(encode_splats(SplatFormat::sog, model), encode_splats(SplatFormat::sog, model));
}

TEST(SogWrite, odd_scenes_are_written_too) {
    SplatModel model = sample_model(3, 5);
    model.opacity_logit = {-40, 40, 0, -40, 40};  // an alpha of 0 keeps its colour
    for (float& value : model.sh_dc) value = 0.25f;
    const SplatModel got = parse_splats(encode_splats(SplatFormat::sog, model), "test");
    for (const float value : got.sh_dc) EXPECT_NEAR(value, 0.25f, 1e-6);
    EXPECT_EQ(parse_splats(encode_splats(SplatFormat::sog, sample_model(0, 1)), "test").size(), 1u);
    EXPECT_NE(error_of([] {
                  encode_splats(SplatFormat::sog, sample_model(1, 0));
              }).find("without splats"),
              std::string::npos);
}

TEST(SogWrite, what_has_no_place_is_said) {
    SplatModel model = sample_model(3, 5);
    EXPECT_TRUE(losses_of(SplatFormat::sog, model).empty());
    model.kernel = KERNEL_SINC;
    model.origin.x = 1e6;
    EXPECT_EQ(losses_of(SplatFormat::sog, model).size(), 2u);
}

TEST(SogWrite, files_cut_off_at_every_byte_are_refused) {
    expect_truncation_is_refused(
        encode_splats(SplatFormat::sog, sample_model(1, 3)),
        [](std::span<const std::byte> file) { return parse_splats(file, "test.sog"); });
}

}  // namespace
}  // namespace darb::test
