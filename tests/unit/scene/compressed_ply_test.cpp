// SPDX-License-Identifier: MIT
#include "engine/scene/compressed_ply.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/scene/edit_splats.h"
#include "engine/scene/ply.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

const Reader kReadCompressedPly = [](std::span<const std::byte> file) {
    return parse_ply(file, "test");
};

/// One chunk with bounds 0 to 1 for x, 0 to 2 for y, 0 to 4 for z; scales -8 to 0; and one splat.
FileBytes one_splat(bool colours, bool sh) {
    std::string header = "ply\nformat binary_little_endian 1.0\nelement chunk 1\n";
    const auto bounds = [&](const char* names) {
        for (const char* end : {"min_", "max_"})
            for (const char* n = names; *n; ++n)
                header += std::string("property float ") + end + *n + "\n";
    };
    bounds("xyz");
    for (const char* end : {"min_scale_", "max_scale_"})
        for (const char* n = "xyz"; *n; ++n)
            header += std::string("property float ") + end + *n + "\n";
    if (colours) bounds("rgb");
    header += "element vertex 1\n";
    for (const char* name : {"position", "rotation", "scale", "color"})
        header += std::string("property uint packed_") + name + "\n";
    if (sh) {
        header += "element sh 1\n";
        for (int i = 0; i < 9; ++i) header += "property uchar f_rest_" + std::to_string(i) + "\n";
    }
    FileBytes file;
    append_text(header + "end_header\n", file);
    for (const float v : {0.f, 0.f, 0.f, 1.f, 2.f, 4.f, -8.f, -8.f, -8.f, 0.f, 0.f, 0.f})
        append_value(v, file);
    if (colours)
        for (const float v : {0.f, 0.f, 0.f, 0.5f, 1.f, 2.f}) append_value(v, file);
    append_value<std::uint32_t>(2047u << 21 | 0u << 11 | 1024u, file);  // x 1, y 0, z 4 * 1024/2047
    append_value<std::uint32_t>(1u << 30 | 1023u << 20 | 0u << 10 | 511u, file);
    append_value<std::uint32_t>(0u << 21 | 1023u << 11 | 2047u, file);  // -8, 0, 0
    append_value<std::uint32_t>(255u << 24 | 51u << 16 | 0u << 8 | 204u, file);
    if (sh)
        for (int i = 0; i < 9; ++i)
            file.push_back(static_cast<std::byte>(i == 0 ? 0 : std::min(128 + 16 * i, 255)));
    return file;
}

TEST(CompressedPly, one_splat_decoded_by_hand) {
    const SplatModel model = kReadCompressedPly(one_splat(true, true));
    ASSERT_EQ(model.size(), 1u);
    EXPECT_EQ(model.sh_degree, 1);
    EXPECT_EQ(model.position[0], 1.f);
    EXPECT_EQ(model.position[1], 0.f);
    EXPECT_NEAR(model.position[2], 4 * 1024 / 2047.0, 1e-6);
    EXPECT_EQ(model.log_scale, (std::vector<float>{-8, 0, 0}));
    // Colours 1 * 0.5, 0.2 * 1 and 0; opacity 0.8, its logit ln 4.
    EXPECT_NEAR(model.sh_dc[0], 0, 1e-6);
    EXPECT_NEAR(model.sh_dc[1], (0.2 - 0.5) / 0.28209479, 1e-6);
    EXPECT_NEAR(model.sh_dc[2], -0.5 / 0.28209479, 1e-5);
    EXPECT_NEAR(model.opacity_logit[0], std::log(4.0), 1e-5);
    // x is the largest; w = sqrt(1/2), y = -sqrt(1/2), z = (511/1023 - 1/2) sqrt 2; nothing is
    // left.
    EXPECT_NEAR(model.rotation[0], std::sqrt(0.5), 1e-6);
    EXPECT_NEAR(model.rotation[1], 0, 1e-6);
    EXPECT_NEAR(model.rotation[2], -std::sqrt(0.5), 1e-6);
    EXPECT_NEAR(model.rotation[3], -0.5 / 1023 * std::sqrt(2.0), 1e-6);
    // File: three reds, three greens, three blues. Model: rgb of one coefficient after the other.
    EXPECT_EQ(model.sh_rest[0], -4.f);                               // byte 0
    EXPECT_NEAR(model.sh_rest[1], ((176.5 / 256) - 0.5) * 8, 1e-6);  // byte 3, green
    EXPECT_NEAR(model.sh_rest[3], ((144.5 / 256) - 0.5) * 8, 1e-6);  // byte 1, red
    EXPECT_EQ(model.sh_rest[8], 4.f);                                // byte 8, blue: 255
}

TEST(CompressedPly, without_bounds_of_colour_they_are_0_to_1) {
    const SplatModel model = kReadCompressedPly(one_splat(false, false));
    EXPECT_EQ(model.sh_degree, 0);
    EXPECT_NEAR(model.sh_dc[0], 0.5 / 0.28209479, 1e-5);
}

// gsplat writes the element at degree 0, too.
TEST(CompressedPly, harmonics_without_properties_are_degree_0) {
    const FileBytes file = one_splat(true, false);
    const std::string text(reinterpret_cast<const char*>(file.data()), file.size());
    for (const char* before : {"end_header", "element vertex"})
        for (const char* count : {"1", "18446744073709551615"}) {
            std::string changed = text;
            changed.insert(changed.find(before), fmt::format("element sh {}\n", count));
            FileBytes bytes;
            append_text(changed, bytes);
            EXPECT_EQ(error_of([&] {
                          const SplatModel model = kReadCompressedPly(bytes);
                          EXPECT_EQ(model.sh_degree, 0);
                          EXPECT_EQ(model.position[0], 1.f);
                      }),
                      "no error")
                << before << " " << count;
        }
}

/// The splat of `written` nearest to each of `model`.
size_t nearest(const SplatModel& model, size_t i, const SplatModel& written) {
    size_t best = 0;
    for (size_t j = 1; j < written.size(); ++j)
        if (glm::distance(position_of(model, i), position_of(written, j)) <
            glm::distance(position_of(model, i), position_of(written, best)))
            best = j;
    return best;
}

TEST(CompressedPly, every_degree_round_trips_within_the_stated_errors) {
    for (int degree = 0; degree <= 3; ++degree) {
        SplatModel model = sample_model(degree, 700);
        model.kernel = KERNEL_RAISED_COSINE;
        model.footprint = Footprint::exact;
        model.antialias = true;
        const SplatModel read = kReadCompressedPly(encode_compressed_ply(model));
        ASSERT_EQ(read.size(), model.size());
        EXPECT_EQ(read.sh_degree, degree);
        EXPECT_EQ(read.kernel, KERNEL_RAISED_COSINE);
        EXPECT_EQ(read.footprint, Footprint::exact);
        EXPECT_TRUE(read.antialias);
        const auto rest = static_cast<size_t>(model.rest_count());
        for (size_t i = 0; i < model.size(); ++i) {
            const size_t j = nearest(model, i, read);
            for (size_t k = 0; k < 3; ++k) {
                // A chunk spans 2 at most; scales 7, colours 2 * 0.282.
                const double steps = k == 1 ? 2046 : 4094;
                EXPECT_NEAR(read.position[3 * j + k], model.position[3 * i + k], 2.001 / steps);
                EXPECT_NEAR(read.log_scale[3 * j + k], model.log_scale[3 * i + k], 7.001 / steps);
                EXPECT_NEAR(read.sh_dc[3 * j + k], model.sh_dc[3 * i + k], 2.001 / 510);
            }
            EXPECT_NEAR(opacity_of(read.opacity_logit[j]), opacity_of(model.opacity_logit[i]),
                        1.001 / 510);
            EXPECT_GT(same_rotation(read, j, model, i), 1 - 2e-6);
            for (size_t c = 0; c < rest; ++c)
                EXPECT_NEAR(read.sh_rest[rest * j + c], model.sh_rest[rest * i + c], 1.001 / 64);
        }
    }
}

TEST(CompressedPly, written_again_the_bytes_stay) {
    // The order is by position, which moves by less than a step of the order.
    const SplatModel once = kReadCompressedPly(encode_compressed_ply(sample_model(2, 300)));
    const SplatModel twice = kReadCompressedPly(encode_compressed_ply(once));
    const auto sorted = [](std::vector<float> values) {
        std::sort(values.begin(), values.end());
        return values;
    };
    EXPECT_EQ(sorted(twice.opacity_logit), sorted(once.opacity_logit));
    EXPECT_EQ(sorted(twice.sh_rest), sorted(once.sh_rest));
}

TEST(CompressedPly, no_splats_and_equal_splats_round_trip) {
    EXPECT_EQ(kReadCompressedPly(encode_compressed_ply(SplatModel{})).size(), 0u);
    SplatModel model = sample_model(0, 1);
    for (auto* values :
         {&model.position, &model.log_scale, &model.rotation, &model.opacity_logit, &model.sh_dc})
        values->insert(values->end(), values->begin(), values->end());
    const SplatModel read = kReadCompressedPly(encode_compressed_ply(model));
    EXPECT_EQ(read.position, model.position);  // the bounds are exact
}

/// Median distance of the first `count` splats to those that are read back.
double median_shift(const SplatModel& model, size_t count) {
    const SplatModel read = kReadCompressedPly(encode_compressed_ply(model));
    std::vector<double> shifts;
    for (size_t i = 0; i < count; ++i)
        shifts.push_back(
            glm::distance(position_of(model, i), position_of(read, nearest(model, i, read))));
    std::nth_element(shifts.begin(), shifts.begin() + shifts.size() / 2, shifts.end());
    return shifts[shifts.size() / 2];
}

TEST(CompressedPly, splats_far_off_coarsen_their_own_chunks_alone) {
    SplatModel model = sample_model(0, 5000);
    const double alone = median_shift(model, model.size());
    for (size_t i = 0; i < 3; ++i) model.position[4 * i] = i == 1 ? -1e9f : 1e6f;  // each axis
    EXPECT_LT(median_shift(model, model.size()), 1.2 * alone);
}

TEST(CompressedPly, a_clump_in_a_wide_scene_is_as_fine_as_alone) {
    constexpr size_t kClump = 3000;  // within one cell of the scene's Morton order
    SplatModel model = sample_model(0, 7000);
    for (size_t i = 0; i < 3 * kClump; ++i) model.position[i] = 0.3f + 2e-4f * model.position[i];
    SplatModel alone = model;
    keep_splats([](size_t i) { return i < kClump; }, alone);
    EXPECT_LT(median_shift(model, kClump), 1.2 * median_shift(alone, kClump));
}

TEST(CompressedPly, splats_that_move_by_more_than_their_size_are_counted) {
    SplatModel model = sample_model(0, 2000);
    EXPECT_TRUE(compressed_ply_losses(model).empty());
    model.position[0] = 1e6f;
    const std::vector<std::string> losses = compressed_ply_losses(model);
    ASSERT_EQ(losses.size(), 1u);
    const auto moved = std::stoul(losses[0]);
    EXPECT_GT(moved, 20u) << losses[0];
    EXPECT_LT(moved, 256u) << losses[0];
    EXPECT_NE(losses[0].find("--crop"), std::string::npos) << losses[0];
}

TEST(CompressedPly, truncated_or_damaged_is_an_error) {
    const FileBytes file = encode_compressed_ply(sample_model(1, 3));
    expect_truncation_is_refused(file, kReadCompressedPly);
    expect_damage_is_survived(file, kReadCompressedPly, 2000);
}

TEST(CompressedPly, counts_that_do_not_fit_are_refused) {
    const FileBytes file = one_splat(true, true);
    const std::string text(reinterpret_cast<const char*>(file.data()), file.size());
    for (const char* element : {"chunk", "vertex", "sh"})
        for (const char* count : {"2147483648", "9223372036854775808", "0", "2"}) {
            std::string changed = text;
            const std::string line = std::string("element ") + element + " ";
            changed.replace(changed.find(line) + line.size(), 1, count);
            FileBytes bytes;
            append_text(changed, bytes);
            EXPECT_NE(error_of([&] { kReadCompressedPly(bytes); }), "no error")
                << element << " " << count;
        }
    std::string changed = text;
    changed.replace(changed.find("uint packed_scale"), 4, "int ");
    FileBytes bytes;
    append_text(changed, bytes);
    EXPECT_NE(error_of([&] { kReadCompressedPly(bytes); }).find("packed_scale"), std::string::npos);
}

}  // namespace
}  // namespace darb::test
