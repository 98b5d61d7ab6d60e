// SPDX-License-Identifier: MIT
#include "engine/scene/ply.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/rng.h"
#include "engine/scene/splat_file.h"
#include "shaders/shared/limits.h"
#include "tests/support/test_data.h"

namespace darb {
namespace {

std::span<const std::byte> bytes_of(const std::string& text) {
    return std::as_bytes(std::span(text.data(), text.size()));
}

SplatModel parse_text(const std::string& text, PlyFacts* facts = nullptr) {
    return parse_ply(bytes_of(text), "test.ply", facts);
}

std::string error_of_text(const std::string& text) {
    try {
        parse_text(text);
    } catch (const Error& error) {
        return error.what();
    }
    return "no error";
}

SplatModel random_model(int degree, std::size_t count) {
    SplatModel model;
    model.sh_degree = degree;
    model.resize(count);
    Pcg32 rng(7);
    for (auto* values : {&model.position, &model.log_scale, &model.rotation, &model.opacity_logit,
                         &model.sh_dc, &model.sh_rest})
        for (float& value : *values) value = static_cast<float>(rng.normal());
    return model;
}

void expect_same(const SplatModel& a, const SplatModel& b) {
    EXPECT_EQ(a.sh_degree, b.sh_degree);
    EXPECT_EQ(a.kernel, b.kernel);
    EXPECT_EQ(a.footprint, b.footprint);
    EXPECT_EQ(a.antialias, b.antialias);
    EXPECT_EQ(a.origin, b.origin);
    EXPECT_EQ(a.position, b.position);
    EXPECT_EQ(a.log_scale, b.log_scale);
    EXPECT_EQ(a.rotation, b.rotation);
    EXPECT_EQ(a.opacity_logit, b.opacity_logit);
    EXPECT_EQ(a.sh_dc, b.sh_dc);
    EXPECT_EQ(a.sh_rest, b.sh_rest);
}

const std::string kProperties =
    "property float x\nproperty float y\nproperty float z\nproperty float f_dc_0\n"
    "property float f_dc_1\nproperty float f_dc_2\nproperty float opacity\nproperty float scale_0\n"
    "property float scale_1\nproperty float scale_2\nproperty float rot_0\nproperty float rot_1\n"
    "property float rot_2\nproperty float rot_3\n";
const std::string kAsciiRow = "1 2 3 .1 .2 .3 -4 -5 -6 -7 1 0 0 0.5\n";

std::string ascii_file(const std::string& count, const std::string& rows) {
    return "ply\nformat ascii 1.0\nelement vertex " + count + "\n" + kProperties + "end_header\n" +
           rows;
}

TEST(Ply, every_degree_round_trips) {
    for (int degree = 0; degree <= 3; ++degree)
        for (const std::size_t count : {0u, 1u, 17u}) {
            const SplatModel model = random_model(degree, count);
            expect_same(parse_ply(encode_ply(model), "memory"), model);
        }
}

TEST(Ply, header_comments_round_trip) {
    SplatModel model = random_model(1, 2);
    model.kernel = KERNEL_INVERSE_QUADRATIC;
    model.footprint = Footprint::exact;
    model.antialias = true;
    expect_same(parse_ply(encode_ply(model), "memory"), model);
}

TEST(Ply, rest_coefficients_are_stored_channel_by_channel) {
    SplatModel model = random_model(1, 1);
    model.sh_rest = {11, 21, 31, 12, 22, 32, 13, 23, 33};  // coefficient 1: r g b, 2: ...
    const std::vector<std::byte> file = encode_ply(model);
    float rest[9];
    std::memcpy(rest, &file[file.size() - 4 * (9 + 8)], sizeof rest);
    const float expected[9] = {11, 12, 13, 21, 22, 23, 31, 32, 33};
    EXPECT_TRUE(std::equal(rest, rest + 9, expected));
}

TEST(Ply, ascii_is_read) {
    const SplatModel model = parse_text(ascii_file("2", kAsciiRow + kAsciiRow));
    ASSERT_EQ(model.size(), 2u);
    EXPECT_EQ(model.sh_degree, 0);
    EXPECT_EQ(model.position, (std::vector<float>{1, 2, 3, 1, 2, 3}));
    EXPECT_EQ(model.rotation[3], 0.5f);
    EXPECT_EQ(model.kernel, KERNEL_GAUSSIAN);
    EXPECT_FALSE(model.antialias);
}

TEST(Ply, ascii_numbers_beyond_double_are_infinite_and_those_below_it_0) {
    PlyFacts facts;
    const std::string row = " 2 3 .1 .2 .3 1e999 -5 -6 -7 1 0 0 0.5\n";
    const SplatModel model =
        parse_text(ascii_file("3", "1e-999" + row + "-1e999" + row + "1e999" + row), &facts);
    EXPECT_EQ(facts.dropped, 2u);
    ASSERT_EQ(model.size(), 1u);
    EXPECT_EQ(model.position[0], 0.f);
    EXPECT_EQ(model.opacity_logit[0], OPACITY_LOGIT_LIMIT);
}

TEST(Ply, blanks_after_end_header_are_tolerated) {
    std::string text = ascii_file("1", kAsciiRow);
    text.insert(text.find("end_header") + 10, " \t\r");
    EXPECT_EQ(parse_text(text).size(), 1u);
}

TEST(Ply, errors_of_the_header_come_with_a_remedy) {
    const std::string file = ascii_file("1", kAsciiRow);
    const auto with = [&](const std::string& held, const std::string& wanted) {
        std::string text = file;
        const std::string error = error_of_text(text.replace(text.find(held), held.size(), wanted));
        EXPECT_NE(error.find("\n  "), std::string::npos) << error;
    };
    with("format ascii", "format text");
    with("property float x", "property half x");
    with("end_header", "property float f_rest_0\nend_header");
    for (const char* comment :
         {"SplatKernel: square", "SplatFootprint: square",
          "SplatKernel: raised_cosine_2_pulses\ncomment SplatFootprint: exact"})
        with("element", std::string("comment ") + comment + "\nelement");
}

TEST(Ply, windows_line_ends_comments_and_other_elements_are_tolerated) {
    std::string text =
        "ply\nformat ascii 1.0\ncomment SplatRenderMode: mip\nobj_info nothing\n"
        "element face 1\nproperty list uchar int vertex_indices\nelement vertex 1\n" +
        kProperties + "property float extra\nelement camera 1\nproperty float fov\n" +
        "end_header\n3 0 0 0\n" + kAsciiRow.substr(0, kAsciiRow.size() - 1) + " 9\n1.5\n";
    EXPECT_EQ(parse_text(text).position, (std::vector<float>{1, 2, 3}));
    EXPECT_TRUE(parse_text(text).antialias);
    for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 2)
        text.replace(at, 1, "\r\n");
    EXPECT_EQ(parse_text(text).position, (std::vector<float>{1, 2, 3}));
}

TEST(Ply, big_endian_and_any_order_and_type_are_read) {
    std::string text =
        "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty double rot_3\n";
    for (const char* name : {"z", "y", "x", "rot_2", "rot_1", "rot_0", "scale_2", "scale_1",
                             "scale_0", "opacity", "f_dc_2", "f_dc_1", "f_dc_0"})
        text += std::string("property float ") + name + "\n";
    text += "property short ignored\nend_header\n";
    const auto put = [&](auto value) {
        char raw[sizeof value];
        std::memcpy(raw, &value, sizeof value);
        text.append(std::reverse_iterator(raw + sizeof value), std::reverse_iterator(raw));
    };
    put(0.25);
    for (int i = 1; i <= 13; ++i) put(static_cast<float>(i));
    put(std::int16_t{-7});
    const SplatModel model = parse_text(text);
    EXPECT_EQ(model.position, (std::vector<float>{3, 2, 1}));
    EXPECT_EQ(model.rotation, (std::vector<float>{6, 5, 4, 0.25f}));
    EXPECT_EQ(model.log_scale, (std::vector<float>{9, 8, 7}));
    EXPECT_EQ(model.opacity_logit, (std::vector<float>{10}));
    EXPECT_EQ(model.sh_dc, (std::vector<float>{13, 12, 11}));
}

TEST(Ply, splats_with_nan_or_infinity_are_dropped_and_counted) {
    SplatModel model = random_model(1, 5);
    model.position[3] = std::numeric_limits<float>::quiet_NaN();
    model.sh_rest[3 * 9 + 4] = std::numeric_limits<float>::infinity();
    PlyFacts facts;
    const SplatModel read = parse_ply(encode_ply(model), "memory", &facts);
    EXPECT_EQ(facts.dropped, 2u);
    ASSERT_EQ(read.size(), 3u);
    EXPECT_EQ(read.opacity_logit,
              (std::vector<float>{model.opacity_logit[0], model.opacity_logit[2],
                                  model.opacity_logit[4]}));
    EXPECT_EQ(read.sh_rest.size(), 27u);
    EXPECT_EQ(parse_text(ascii_file("1", "nan" + kAsciiRow.substr(1)), &facts).size(), 0u);
    EXPECT_EQ(facts.dropped, 1u);
}

// PLYs expanded from formats with one byte of opacity hold the logit of 255, +inf.
TEST(Ply, infinite_opacity_and_no_extent_are_kept_at_the_limits) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    SplatModel model = random_model(0, 4);
    model.opacity_logit = {kInfinity, -kInfinity, 1, std::numeric_limits<float>::quiet_NaN()};
    model.log_scale[7] = -kInfinity;
    PlyFacts facts;
    const SplatModel read = parse_ply(encode_ply(model), "memory", &facts);
    EXPECT_EQ(facts.dropped, 1u) << "NaN alone";
    EXPECT_EQ(read.opacity_logit,
              (std::vector<float>{OPACITY_LOGIT_LIMIT, -OPACITY_LOGIT_LIMIT, 1}));
    ASSERT_EQ(read.log_scale.size(), 9u);
    EXPECT_EQ(read.log_scale[7], -LOG_SCALE_LIMIT);
    model.log_scale[7] = kInfinity;
    EXPECT_EQ(parse_ply(encode_ply(model), "memory", &facts).size(), 2u);
}

TEST(Ply, bytes_behind_the_last_row_are_left_out_and_said) {
    PlyFacts facts;
    std::vector<std::byte> file = encode_ply(random_model(1, 2));
    EXPECT_EQ(parse_ply(file, "test", &facts).size(), 2u);
    EXPECT_TRUE(facts.notes.empty());
    file.resize(file.size() + 92);
    EXPECT_EQ(parse_ply(file, "test", &facts).size(), 2u);
    ASSERT_EQ(facts.notes.size(), 1u);
    EXPECT_EQ(facts.notes[0],
              "its header declares 2 rows of vertex; the 92 bytes behind them were left out");
    std::vector<std::byte> packed = encode_splats(SplatFormat::compressed_ply, random_model(1, 2));
    parse_ply(packed, "test", &facts);
    EXPECT_TRUE(facts.notes.empty());
    packed.push_back({});
    parse_ply(packed, "test", &facts);
    ASSERT_EQ(facts.notes.size(), 1u);
    EXPECT_NE(facts.notes[0].find("2 rows of sh; the 1 bytes"), std::string::npos);
    parse_text(ascii_file("1", kAsciiRow + "\n \n"), &facts);
    EXPECT_TRUE(facts.notes.empty());
    parse_text(ascii_file("1", kAsciiRow + kAsciiRow), &facts);
    EXPECT_EQ(facts.notes.size(), 1u);
}

TEST(Ply, what_is_not_finite_is_not_written_and_said) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    SplatModel model = random_model(1, 3);
    EXPECT_TRUE(losses_of(SplatFormat::ply, model).empty());
    model.position[4] = kInfinity;
    model.opacity_logit[2] = kInfinity;  // an opacity of 1
    PlyFacts facts;
    const SplatModel read = parse_ply(encode_splats(SplatFormat::ply, model), "memory", &facts);
    EXPECT_EQ(facts.dropped, 0u);
    ASSERT_EQ(read.size(), 2u);
    EXPECT_EQ(read.opacity_logit[1], OPACITY_LOGIT_LIMIT);
    ASSERT_EQ(losses_of(SplatFormat::ply, model).size(), 1u);
    EXPECT_NE(losses_of(SplatFormat::ply, model)[0].find("1 splats with NaN"), std::string::npos);
}

TEST(Ply, truncated_anywhere_is_an_error_that_names_the_file) {
    const std::vector<std::byte> file = encode_ply(random_model(1, 2));
    for (std::size_t length = 0; length < file.size(); ++length) {
        const std::vector<std::byte> part(file.begin(), file.begin() + length);
        try {
            parse_ply(part, "cut.ply");
            FAIL() << "no error at length " << length;
        } catch (const Error& error) {
            EXPECT_EQ(error.where.find("cut.ply"), 0u);
        }
    }
    const std::string text = ascii_file("2", kAsciiRow + kAsciiRow);
    for (std::size_t length = 0; length + 4 <= text.size(); ++length)  // all before the last word
        EXPECT_NE(error_of_text(text.substr(0, length)), "no error") << length;
}

TEST(Ply, declared_counts_beyond_the_file_are_refused_before_allocating) {
    for (const char* count : {"2147483648", "4294967296", "9223372036854775808",
                              "18446744073709551615", "1000000000000"})
        EXPECT_NE(error_of_text(ascii_file(count, kAsciiRow)).find("declares"), std::string::npos);
    EXPECT_NE(error_of_text(ascii_file("18446744073709551616", "")).find("count"),
              std::string::npos);
    EXPECT_NE(error_of_text(ascii_file("-1", "")).find("count"), std::string::npos);
}

TEST(Ply, malformed_headers_are_errors_that_say_why) {
    EXPECT_NE(error_of_text("").find("no PLY"), std::string::npos);
    EXPECT_NE(error_of_text("ply\nformat binary 1.0\nend_header\n").find("format"),
              std::string::npos);
    EXPECT_NE(error_of_text("ply\nformat ascii 1.0\nend_header\n").find("vertex"),
              std::string::npos);
    std::string no_format = ascii_file("1", kAsciiRow);
    no_format.erase(4, no_format.find("element") - 4);
    EXPECT_NE(error_of_text(no_format).find("no format line"), std::string::npos);
    EXPECT_NE(error_of_text("ply\nproperty float x\nend_header\n").find("property"),
              std::string::npos);
    std::string text = ascii_file("1", kAsciiRow);
    text.replace(text.find("scale_1"), 7, "other__");
    EXPECT_NE(error_of_text(text).find("scale_1"), std::string::npos);
    text = ascii_file("1", "x" + kAsciiRow);
    EXPECT_NE(error_of_text(text).find("not a number"), std::string::npos);
    text = ascii_file("1", kAsciiRow);
    text.insert(text.find("end_header"), "property float f_rest_0\n");
    EXPECT_NE(error_of_text(text).find("f_rest"), std::string::npos);
    text = ascii_file("1", kAsciiRow);
    text.insert(text.find("element"), "comment SplatKernel: square\n");
    EXPECT_NE(error_of_text(text).find("SplatKernel"), std::string::npos);
}

TEST(Ply, blanks_marks_tabs_and_line_ends_of_other_programs_are_tolerated) {
    const std::string file = ascii_file("2", kAsciiRow + kAsciiRow);
    const auto expect_read = [&](const std::string& text) {
        SplatFile facts;
        const SplatModel model = parse_splats(bytes_of(text), "t", &facts);
        EXPECT_EQ(model.position, (std::vector<float>{1, 2, 3, 1, 2, 3})) << text.substr(0, 20);
        EXPECT_TRUE(facts.notes.empty());
    };
    const auto replaced = [&](const std::string& from, const std::string& to) {
        std::string text = file;
        for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
            text.replace(at, from.size(), to);
        return text;
    };
    expect_read(replaced("\n", "  \n"));
    expect_read(replaced("\n", " \t \r\n"));
    expect_read(replaced("\n", "\r"));  // without a line feed, as on old Macs
    expect_read(replaced(" ", "\t"));
    expect_read("\xef\xbb\xbf" + file);
    expect_read(replaced("format ascii 1.0", "format ascii 1.0 written by hand"));
    expect_read(replaced(" .1", "\n.1"));  // rows of two lines
    expect_read(file.substr(0, file.size() - 1));
}

TEST(Ply, numbers_with_commas_are_refused_with_the_line_and_what_to_do) {
    std::string row = kAsciiRow;
    std::replace(row.begin(), row.end(), '.', ',');
    const std::string decimal = error_of_text(ascii_file("2", kAsciiRow + "0" + row.substr(1)));
    EXPECT_NE(decimal.find("line 20, row 1 of 2"), std::string::npos) << decimal;
    EXPECT_NE(decimal.find("',1' has a decimal comma"), std::string::npos) << decimal;
    EXPECT_NE(decimal.find("sed "), std::string::npos) << decimal;
    row = kAsciiRow;
    std::replace(row.begin(), row.end(), ' ', ',');
    const std::string between = error_of_text(ascii_file("1", row));
    EXPECT_NE(between.find("has commas between numbers"), std::string::npos) << between;
}

TEST(Ply, a_line_of_another_length_than_the_header_says_is_refused) {
    const std::string longer = "9 " + kAsciiRow, shorter = kAsciiRow.substr(2);
    for (const std::string& rows : {longer + longer, kAsciiRow + longer + kAsciiRow,
                                    kAsciiRow + shorter + kAsciiRow, shorter + longer}) {
        const auto count = std::count(rows.begin(), rows.end(), '\n');
        const std::string error = error_of_text(ascii_file(std::to_string(count), rows));
        EXPECT_NE(error.find("values, and the header declares 14 properties"), std::string::npos)
            << error;
        EXPECT_NE(error.find(rows.starts_with(kAsciiRow) ? "line 20, row 1" : "line 19, row 0"),
                  std::string::npos)
            << error;
    }
}

TEST(Ply, map_coordinates_keep_millimetres) {
    std::string text =
        ascii_file("2", "450000.001" + kAsciiRow.substr(1) + "450010.002" + kAsciiRow.substr(1));
    for (const char* axis : {"float x", "float y", "float z"})
        text.replace(text.find(axis), 5, "double");
    const SplatModel model = parse_text(text);
    EXPECT_EQ(model.origin, glm::dvec3(450012, 0, 0));
    EXPECT_NEAR(model.position[0], -11.999, 1e-6);
    EXPECT_NEAR(model.position[3], -1.998, 1e-6);
    const SplatModel again = parse_ply(encode_ply(model), "memory");
    expect_same(again, model);
}

// Training stores positions relative to their median long before float32 fails; other programs read
// plain float32.
TEST(Ply, doubles_are_written_only_where_float32_does_not_resolve_the_positions) {
    const auto header_at = [](double origin) {
        SplatModel model =
            parse_text(ascii_file("2", "0.1" + kAsciiRow.substr(1) + "3" + kAsciiRow.substr(1)));
        model.origin.x = origin;
        const std::vector<std::byte> file = encode_ply(model);
        return std::string(reinterpret_cast<const char*>(file.data()), 200);
    };
    EXPECT_NE(header_at(40).find("property float x"), std::string::npos);
    EXPECT_NE(header_at(4e5).find("property double x"), std::string::npos);
}

TEST(Ply, float_file_at_map_coordinates_keeps_its_values) {
    const std::string rows = "5000000.5" + kAsciiRow.substr(1) + "5000128" + kAsciiRow.substr(1);
    const SplatModel model = parse_text(ascii_file("2", rows));
    EXPECT_EQ(model.origin.x + double{model.position[0]}, 5000000.5);
    const std::vector<std::byte> file = encode_ply(model);
    const std::string text(reinterpret_cast<const char*>(file.data()), file.size());
    EXPECT_NE(text.find("property float x"), std::string::npos);
    expect_same(parse_ply(file, "memory"), model);
}

TEST(Ply, real_scenes_round_trip_bit_equal) {
    const auto folder = test::test_data_folder();
    if (!folder) GTEST_SKIP() << test::kNoTestData;
    const std::pair<const char*, std::size_t> scenes[] = {
        {"splats/biker.decoded.ply", 152746},
        {"splats/toy-cat.decoded.ply", 23261},
        {"fixtures/minimal_formats/test-splat.3-points-from-train.ply", 3}};
    for (const auto& [name, count] : scenes) {
        const std::vector<std::byte> file = read_file(*folder / name);
        PlyFacts facts;
        const SplatModel model = parse_ply(file, name, &facts);
        EXPECT_EQ(model.size() + facts.dropped, count) << name;
        EXPECT_EQ(facts.dropped, 0u) << name;
        const std::vector<std::byte> again = encode_ply(model);
        expect_same(parse_ply(again, name), model);
        if (count == 3) continue;  // has normals
        const std::size_t row = 4 * (17 + static_cast<std::size_t>(model.rest_count()));
        EXPECT_EQ(std::memcmp(&again[again.size() - count * row], &file[file.size() - count * row],
                              count * row),
                  0)
            << name;
    }
}

}  // namespace
}  // namespace darb
