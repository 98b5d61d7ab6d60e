// SPDX-License-Identifier: MIT
#include "engine/scene/dot_splat.h"

#include <fmt/format.h>

#include <limits>

#include "engine/scene/splat_file.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

const Reader kReadDotSplat = [](std::span<const std::byte> file) {
    return parse_dot_splat(file, "test");
};

FileBytes one_dot_splat(float x = 1, float scale = 0.5f) {
    FileBytes file;
    for (const float v : {x, -2.f, 3.f, scale, 1.f, 0.f}) append_value(v, file);
    for (const int b : {255, 0, 128, 51, 128, 255, 128, 128}) file.push_back(std::byte(b));
    return file;
}

TEST(DotSplat, one_splat_decoded_by_hand) {
    const SplatModel model = kReadDotSplat(one_dot_splat());
    ASSERT_EQ(model.size(), 1u);
    EXPECT_EQ(model.position, (std::vector<float>{1, -2, 3}));
    EXPECT_NEAR(model.log_scale[0], std::log(0.5), 1e-6);
    EXPECT_EQ(model.log_scale[1], 0.f);
    EXPECT_EQ(model.log_scale[2], -20.f);  // a scale of 0
    EXPECT_NEAR(model.sh_dc[0], 0.5 / 0.28209479, 1e-5);
    EXPECT_NEAR(model.sh_dc[1], -0.5 / 0.28209479, 1e-5);
    EXPECT_NEAR(model.sh_dc[2], (128 / 255.0 - 0.5) / 0.28209479, 1e-6);
    EXPECT_NEAR(model.opacity_logit[0], std::log(0.2 / 0.8), 1e-5);
    EXPECT_EQ(model.rotation, (std::vector<float>{0, 127 / 128.f, 0, 0}));  // x
}

TEST(DotSplat, round_trips_within_the_stated_errors) {
    const SplatModel model = sample_model(3, 500);
    const FileBytes file = encode_dot_splat(model);
    EXPECT_EQ(file.size(), 32 * model.size());
    EXPECT_TRUE(looks_like_dot_splat(file));
    const SplatModel read = kReadDotSplat(file);
    EXPECT_EQ(read.sh_degree, 0);
    EXPECT_EQ(read.position, model.position);
    for (size_t i = 0; i < model.size(); ++i) {
        for (size_t k = 0; k < 3; ++k) {
            EXPECT_NEAR(read.log_scale[3 * i + k], model.log_scale[3 * i + k], 1e-6);
            EXPECT_NEAR(read.sh_dc[3 * i + k], model.sh_dc[3 * i + k], 1.001 / 510 / 0.28209479);
        }
        EXPECT_NEAR(opacity_of(read.opacity_logit[i]), opacity_of(model.opacity_logit[i]),
                    1.001 / 510);
        EXPECT_GT(same_rotation(read, i, model, i), 1 - 1e-4);
    }
    EXPECT_EQ(encode_dot_splat(read).size(), file.size());
}

TEST(DotSplat, splats_without_sense_are_dropped_and_counted) {
    FileBytes file = one_dot_splat();
    for (const FileBytes& other :
         {one_dot_splat(std::numeric_limits<float>::quiet_NaN()), one_dot_splat(1, -1.f),
          one_dot_splat(1, std::numeric_limits<float>::infinity()), one_dot_splat(7)})
        file.insert(file.end(), other.begin(), other.end());
    size_t dropped = 0;
    const SplatModel model = parse_dot_splat(file, "test", &dropped);
    EXPECT_EQ(dropped, 3u);
    ASSERT_EQ(model.size(), 2u);
    EXPECT_EQ(model.position[3], 7.f);
}

TEST(DotSplat, scales_beyond_what_is_drawn_are_written_as_drawn) {
    SplatModel model = sample_model(0, 2);
    model.log_scale[0] = 100;
    const SplatModel read = kReadDotSplat(encode_dot_splat(model));
    ASSERT_EQ(read.size(), 2u);
    EXPECT_NEAR(read.log_scale[0], 20, 1e-5);
}

TEST(DotSplat, lengths_that_32_does_not_divide_are_refused) {
    const FileBytes file = encode_dot_splat(sample_model(0, 3));
    for (size_t length = 0; length <= file.size(); ++length) {
        const std::span<const std::byte> part(file.data(), length);
        const std::string error = error_of([&] { kReadDotSplat(part); });
        EXPECT_EQ(error == "no error", length % 32 == 0) << length << ": " << error;
    }
    expect_damage_is_survived(file, kReadDotSplat, 500);
}

TEST(DotSplat, other_content_does_not_look_like_it) {
    EXPECT_FALSE(looks_like_dot_splat({}));
    EXPECT_FALSE(looks_like_dot_splat(FileBytes(64)));  // rotations of length sqrt 4
    FileBytes text;
    append_text(std::string(320, 'a'), text);
    EXPECT_FALSE(looks_like_dot_splat(text));
    EXPECT_FALSE(looks_like_dot_splat(FileBytes(33)));
}

// A file whose first 5,837 bytes were cut off, and as many at its end as make its size right.
TEST(DotSplat, records_out_of_phase_are_refused) {
    const FileBytes whole = encode_dot_splat(sample_model(0, 400));
    for (const std::size_t gone : {std::size_t{5'837}, std::size_t{1}, std::size_t{31}}) {
        FileBytes cut(whole.begin() + static_cast<std::ptrdiff_t>(gone), whole.end());
        const std::string at = fmt::format("begin at byte {}", (32 - gone % 32) % 32);
        EXPECT_NE(error_of([&] { parse_dot_splat(cut, "test.splat"); }).find(at), std::string::npos)
            << gone;
        cut.resize(cut.size() / 32 * 32);
        const std::string error = error_of([&] { parse_splats(cut, "test.splat"); });
        EXPECT_NE(error.find(at), std::string::npos) << error;
        EXPECT_NE(error.find("from its beginning"), std::string::npos) << error;
    }
    const FileBytes aligned(whole.begin() + 32 * 7, whole.end());
    EXPECT_EQ(parse_dot_splat(aligned, "test.splat").size(), 393u);
}

}  // namespace
}  // namespace darb::test
