// SPDX-License-Identifier: MIT
#include "engine/scene/spz.h"

#include "engine/scene/edit_splats.h"
#include "engine/scene/inflate.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

const Reader kReadSpz = [](std::span<const std::byte> file) { return parse_spz(file, "test"); };

FileBytes old_header(std::uint32_t version, std::uint32_t count, int degree, int bits, int flags) {
    FileBytes file;
    append_text("NGSP", file);
    append_value(version, file);
    append_value(count, file);
    for (const int b : {degree, bits, flags, 0}) file.push_back(std::byte(b));
    return file;
}

void append_bytes(const std::vector<int>& bytes, FileBytes& to) {
    for (const int b : bytes) to.push_back(static_cast<std::byte>(b));
}

/// Version 1 to 3, one splat of degree 1, before gzip.
FileBytes one_spz_splat(std::uint32_t version, int flags = 0) {
    FileBytes file = old_header(version, 1, 1, 8, flags);
    if (version == 1)
        append_bytes({0x00, 0x3c, 0x00, 0xc0, 0x00, 0x42}, file);  // float16 1, -2, 3
    else
        append_bytes({0, 1, 0, 0, 0xfe, 0xff, 0, 3, 0}, file);  // 256, -512, 768 of 1/256
    append_bytes({51}, file);                                   // opacity 0.2
    append_bytes({255, 0, 127}, file);                          // colours
    append_bytes({160, 0, 255}, file);                          // scales
    if (version < 3)
        append_bytes({255, 127, 128}, file);  // x = 1
    else
        append_value<std::uint32_t>(3u << 30 | (512u | 511u) << 20 | 0u << 10 | 0u, file);
    append_bytes({0, 128, 255, 192, 64, 128, 128, 160, 96}, file);
    return file;
}

TEST(Spz, one_splat_of_versions_1_to_3_decoded_by_hand) {
    for (const std::uint32_t version : {1u, 2u, 3u})
        for (const bool packed : {true, false}) {
            const FileBytes plain = one_spz_splat(version, 1);
            SpzFacts facts;
            const SplatModel model = parse_spz(packed ? gzip(plain) : plain, "test", &facts);
            EXPECT_EQ(facts.version, static_cast<int>(version));
            ASSERT_EQ(model.size(), 1u);
            EXPECT_TRUE(model.antialias);
            // Up and backward become down and forward.
            EXPECT_EQ(model.position, (std::vector<float>{1, 2, -3}));
            EXPECT_NEAR(model.opacity_logit[0], std::log(0.2 / 0.8), 1e-5);
            EXPECT_NEAR(model.sh_dc[0], 0.5 / 0.15, 1e-5);
            EXPECT_NEAR(model.sh_dc[1], -0.5 / 0.15, 1e-5);
            EXPECT_NEAR(model.sh_dc[2], (127 / 255.0 - 0.5) / 0.15, 1e-6);
            EXPECT_EQ(model.log_scale, (std::vector<float>{0, -10, 5.9375f}));
            // Harmonics y, z, x of rgb; y and z change sign with their axes.
            const std::vector<float> expected{1, 0, -127 / 128.f, -0.5f, 0.5f, 0, 0, 0.25f, -0.25f};
            for (size_t c = 0; c < 9; ++c) EXPECT_NEAR(model.sh_rest[c], expected[c], 1e-6) << c;
            // Half a turn about x, which the flip of the axes does not change; or x, w = sqrt(1/2)
            // with x negative.
            SplatModel turned;
            turned.resize(1);
            turned.rotation =
                version < 3 ? std::vector<float>{0, 1, 0, 0} : std::vector<float>{1, -1, 0, 0};
            turned.log_scale = model.log_scale;
            for (int a = 0; a < 3; ++a)
                for (int b = 0; b < 3; ++b)
                    EXPECT_NEAR(covariance_of(model, 0)[a][b], covariance_of(turned, 0)[a][b],
                                version < 3 ? 2000 : 1e-2)  // out of e^11.9; 1/127.5 per component
                        << version;
        }
}

// Each precision of each degree, in both versions.
TEST(Spz, every_degree_round_trips_within_the_stated_errors) {
    for (int at = 0; at < 4 * kSpzPrecisions; ++at) {
        const int degree = at % 4, precision = at / 4;
        const SpzSteps steps = spz_steps(precision);
        SplatModel model = sample_model(degree, 400);
        model.antialias = degree == 2;
        const FileBytes file = encode_spz(model, "scene", 4, precision);
        EXPECT_TRUE(
            same_splats(kReadSpz(encode_spz(model, "scene", 3, precision)), kReadSpz(file)));
        SpzFacts facts;
        const SplatModel read = parse_spz(file, "test", &facts);
        EXPECT_EQ(facts.version, 4);
        ASSERT_EQ(read.size(), model.size());
        EXPECT_EQ(read.sh_degree, degree);
        EXPECT_EQ(read.antialias, model.antialias);
        const auto rest = static_cast<size_t>(model.rest_count());
        for (size_t i = 0; i < model.size(); ++i) {
            for (size_t k = 0; k < 3; ++k) {
                EXPECT_NEAR(read.position[3 * i + k], model.position[3 * i + k], 1.001 / (1 << 19));
                EXPECT_NEAR(read.log_scale[3 * i + k], model.log_scale[3 * i + k], 1.001 / 32);
                EXPECT_NEAR(read.sh_dc[3 * i + k], model.sh_dc[3 * i + k], 1.001 / 76.5);
            }
            EXPECT_NEAR(opacity_of(read.opacity_logit[i]), opacity_of(model.opacity_logit[i]),
                        1.001 / 510);
            EXPECT_GT(same_rotation(read, i, model, i), 1 - 3e-6);
            for (size_t c = 0; c < rest; ++c)
                EXPECT_NEAR(read.sh_rest[rest * i + c], model.sh_rest[rest * i + c],
                            1.001 / 256 * (c < 9 ? steps.degree_1 : steps.higher));
        }
        const SplatModel again = kReadSpz(encode_spz(read, "scene", 4, precision));
        EXPECT_EQ(again.position, read.position);
        EXPECT_EQ(again.log_scale, read.log_scale);
        EXPECT_EQ(again.sh_rest, read.sh_rest);
        EXPECT_EQ(again.sh_dc, read.sh_dc);
        EXPECT_EQ(again.opacity_logit, read.opacity_logit);
    }
}

TEST(Spz, a_finer_precision_is_nearer_and_larger) {
    const SplatModel model = sample_model(3, 2000);
    EXPECT_EQ(encode_spz(model), encode_spz(model, "scene", 4, kSpzPrecisions - 1));
    EXPECT_EQ(spz_steps(kSpzPrecisions - 1).higher, 1) << "all bits";
    std::size_t bytes = 0;
    double error = 1e9;
    for (int precision = 0; precision < kSpzPrecisions; ++precision) {
        const FileBytes file = encode_spz(model, "scene", 4, precision);
        const SplatModel read = kReadSpz(file);
        double sum = 0;
        for (size_t i = 0; i < read.sh_rest.size(); ++i)
            sum += std::abs(double{read.sh_rest[i]} - model.sh_rest[i]);
        EXPECT_LT(sum, 0.6 * error) << precision;
        EXPECT_GT(file.size(), bytes) << precision;
        error = sum;
        bytes = file.size();
    }
}

TEST(Spz, large_and_small_scenes_choose_their_fraction) {
    for (const float size : {1e-3f, 1.f, 100.f, 4000.f, 4e6f}) {
        SplatModel model = sample_model(0, 50);
        for (float& p : model.position) p *= size;
        const SplatModel read = kReadSpz(encode_spz(model));
        for (size_t i = 0; i < model.size(); ++i)
            for (int a = 0; a < 3; ++a)
                EXPECT_NEAR(position_of(read, i)[a], position_of(model, i)[a],
                            std::max(size * 1.01 / (1 << 18), 1.01 / (1 << 24)));
    }
    SplatModel far = sample_model(0, 1);
    far.position[0] = 1e7f;
    EXPECT_NE(error_of([&] { encode_spz(far); }).find("24 bits"), std::string::npos);
}

TEST(Spz, no_splats_round_trip) {
    EXPECT_EQ(kReadSpz(encode_spz(SplatModel{})).size(), 0u);
    EXPECT_EQ(kReadSpz(gzip(old_header(2, 0, 0, 12, 0))).size(), 0u);
}

TEST(Spz, harmonics_of_degree_4_are_left_out) {
    FileBytes file = old_header(3, 1, 4, 12, 0);
    const size_t body = spz::strides(3, 4).total();
    EXPECT_EQ(body, 9u + 1 + 3 + 3 + 4 + 72);
    file.resize(file.size() + body, std::byte{128});
    SpzFacts facts;
    const SplatModel model = parse_spz(gzip(file), "test", &facts);
    EXPECT_EQ(model.sh_degree, 3);
    EXPECT_EQ(facts.sh_degree, 4);
    EXPECT_EQ(model.sh_rest, std::vector<float>(45));
}

/// The extension record of a coordinate system, after the attributes.
FileBytes with_axes(std::uint32_t system) {
    FileBytes file = one_spz_splat(3, 2);
    append_value<std::uint32_t>(0x12340001, file);  // unknown: skipped
    append_value<std::uint32_t>(3, file);
    append_bytes({1, 2, 3}, file);
    append_value<std::uint32_t>(0xADBE0003, file);
    append_value<std::uint32_t>(4, file);
    append_value(system, file);
    return gzip(file);
}

TEST(Spz, coordinate_systems_are_turned_to_right_down_forward) {
    // Stored 1, -2, 3.
    const std::pair<std::uint32_t, std::vector<float>> cases[] = {
        {0, {1, 2, -3}},   {4, {1, 2, -3}},    // right up back
        {6, {1, -2, 3}},   {1, {-1, -2, -3}},  // right down front, left down back
        {7, {-1, 2, 3}},   {10, {1, 3, -2}},   // left up front, right front down
        {12, {1, -3, -2}}, {16, {1, -3, 2}}};  // right front up, right back up
    for (const auto& [system, position] : cases) {
        SpzFacts facts;
        const SplatModel model = parse_spz(with_axes(system), "test", &facts);
        EXPECT_EQ(model.position, position) << system;
        EXPECT_EQ(facts.extensions, 2);
    }
    EXPECT_NE(error_of([] { kReadSpz(with_axes(17)); }).find("coordinate system"),
              std::string::npos);
}

TEST(Spz, what_is_no_extension_record_is_an_error_in_version_4_alone) {
    FileBytes file = one_spz_splat(3, 2);
    append_value<std::uint32_t>(0x12340001, file);
    append_value<std::uint32_t>(1000, file);  // declares 1,000 bytes; one is there
    append_bytes({1}, file);
    SpzFacts facts;
    EXPECT_EQ(parse_spz(gzip(file), "test", &facts).size(), 1u);
    EXPECT_TRUE(facts.extensions_cut);
    EXPECT_EQ(facts.extensions, 0);
    FileBytes streams = encode_spz(sample_model(0, 1));
    FileBytes record;
    append_value<std::uint32_t>(0x12340001, record);
    append_value<std::uint32_t>(1000, record);
    streams.insert(streams.begin() + spz::kHeader, record.begin(), record.end());
    set_value(static_cast<std::uint32_t>(spz::kHeader + record.size()), 16, streams);
    streams[14] = streams[14] | std::byte{spz::kFlagExtensions};
    EXPECT_NE(error_of([&] { kReadSpz(streams); }).find("extension record 0"), std::string::npos);
}

TEST(Spz, gzip_is_told_by_its_method_and_flags_too) {
    FileBytes file = gzip(one_spz_splat(2));
    EXPECT_TRUE(looks_like_spz(file));
    file[2] = std::byte{7};
    EXPECT_FALSE(looks_like_spz(file));
    file[2] = std::byte{8};
    file[3] = std::byte{0x20};
    EXPECT_FALSE(looks_like_spz(file));
}

TEST(Spz, truncated_or_damaged_is_an_error) {
    const SplatModel model = sample_model(1, 5);
    expect_truncation_is_refused(encode_spz(model), kReadSpz);
    expect_truncation_is_refused(gzip(one_spz_splat(2)), kReadSpz);
    expect_truncation_is_refused(one_spz_splat(3), kReadSpz);
    expect_damage_is_survived(encode_spz(model), kReadSpz, 3000);
    expect_damage_is_survived(one_spz_splat(1), kReadSpz, 1000);
    expect_damage_is_survived(gzip(one_spz_splat(3)), kReadSpz, 1000);
}

TEST(Spz, a_flipped_bit_in_what_has_a_checksum_is_an_error_or_changes_nothing) {
    const SplatModel scene = random_scene({.count = 20, .sh_degree = 1}).model;
    for (const FileBytes& whole : {gzip(one_spz_splat(3)), encode_spz(scene)}) {
        const SplatModel model = kReadSpz(whole);
        // The head of version 4 has none: its flags may change without a trace.
        const std::size_t from = whole[0] == std::byte{'N'} ? spz::kHeader : 0;
        std::size_t changed = 0;
        for (std::size_t bit = 8 * from; bit < 8 * whole.size(); ++bit) {
            FileBytes file = whole;
            file[bit / 8] ^= std::byte(1 << bit % 8);
            try {
                changed += same_splats(kReadSpz(file), model) ? 0 : 1;
            } catch (const Error&) {
            }
        }
        EXPECT_EQ(changed, 0u) << "of " << 8 * (whole.size() - from);
    }
}

TEST(Spz, gzip_with_more_than_the_header_declares_is_an_error) {
    FileBytes file = one_spz_splat(3);
    EXPECT_EQ(kReadSpz(gzip(file)).size(), 1u);
    file.push_back(std::byte{0});
    EXPECT_NE(error_of([&] { kReadSpz(gzip(file)); }).find("more than the 1 splats"),
              std::string::npos);
}

TEST(Spz, declared_counts_beyond_the_file_are_refused_before_allocating) {
    for (const std::uint32_t count : {2u, 1u << 31, 0xffffffffu}) {
        FileBytes old = one_spz_splat(2), streams = encode_spz(sample_model(1, 1));
        set_value(count, 8, old);
        set_value(count, 8, streams);
        EXPECT_NE(error_of([&] { kReadSpz(gzip(old)); }).find("declares"), std::string::npos);
        EXPECT_NE(error_of([&] { kReadSpz(old); }).find("declares"), std::string::npos);
        EXPECT_NE(error_of([&] { kReadSpz(streams); }).find("declares"), std::string::npos);
    }
    for (const std::uint64_t size :
         {std::uint64_t{1} << 31, std::uint64_t{1} << 63, ~std::uint64_t{0}})
        for (const size_t at : {32u, 40u}) {  // packed, whole
            FileBytes file = encode_spz(sample_model(0, 1));
            set_value(size, at, file);
            EXPECT_NE(error_of([&] { kReadSpz(file); }).find("declares"), std::string::npos);
        }
    for (const std::uint32_t toc : {0u, 31u, 1u << 31, 0xffffffffu}) {
        FileBytes file = encode_spz(sample_model(0, 1));
        set_value(toc, 16, file);
        EXPECT_NE(error_of([&] { kReadSpz(file); }).find("table"), std::string::npos);
    }
}

TEST(Spz, a_bomb_is_bounded_by_what_it_declares) {
    FileBytes bomb = old_header(2, 1, 0, 12, 0);
    bomb.resize(bomb.size() + (100u << 20));  // 100 MiB of zeros
    // Only the 35 bytes that it needs and one more come out.
    EXPECT_NE(error_of([&] { kReadSpz(gzip(bomb)); }).find("more than"), std::string::npos);
    EXPECT_EQ(gunzip(gzip(bomb), 50, "test").size(), 50u);
}

TEST(Spz, wrong_headers_say_why) {
    const auto error = [](size_t at, int value) {
        FileBytes file = one_spz_splat(2);
        file[at] = std::byte(value);
        return error_of([&] { kReadSpz(gzip(file)); });
    };
    EXPECT_NE(error(0, 'X').find("not SPZ"), std::string::npos);
    EXPECT_NE(error(4, 9).find("version 9"), std::string::npos);
    EXPECT_NE(error(12, 5).find("SH degree 5"), std::string::npos);
    EXPECT_NE(error(13, 25).find("fractional"), std::string::npos);
}

}  // namespace
}  // namespace darb::test
