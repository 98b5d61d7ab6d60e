// SPDX-License-Identifier: MIT
// LAS: every point format and version, colours of 8 and 16 bits, and files that are cut off.
#include "engine/data/las_points.h"

#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "engine/core/rng.h"
#include "tests/support/las_file.h"

namespace darb::test {
namespace {

const std::vector<LasPoint> kPoints{{{100, -200, 300}, {65535, 257, 0}},
                                    {{1, 2, 3}, {0, 25700, 65535}},
                                    {{5, 5, 5}, {9, 9, 9}, true}};

std::string las_error(const std::vector<std::byte>& file) {
    std::size_t dropped = 0;
    try {
        parse_las(file, "scan.las", dropped);
    } catch (const Error& e) {
        return std::string(e.what()) + (e.hint.empty() ? "" : "\n" + std::string(e.hint));
    }
    return "no error";
}

TEST(LasPoints, every_format_and_version_has_its_positions_and_colours) {
    for (int format = 0; format <= 10; ++format)
        for (const int minor : {0, 2, 4}) {
            SCOPED_TRACE(testing::Message() << "format " << format << ", version 1." << minor);
            std::size_t dropped = 0;
            std::vector<std::string> notes;
            const PointCloud points = parse_las(
                las_file(kPoints, {.minor = minor, .format = format}), "scan.las", dropped, &notes);
            ASSERT_EQ(points.size(), 2u);
            EXPECT_EQ(dropped, 1u) << "a point is marked as withheld";
            EXPECT_DOUBLE_EQ(points.position[0], 101);
            EXPECT_DOUBLE_EQ(points.position[1], 198);
            EXPECT_DOUBLE_EQ(points.position[2], 0);
            const bool coloured = format == 2 || format == 3 || format == 5 || format == 7 ||
                                  format == 8 || format == 10;
            EXPECT_EQ(points.colour, coloured ? (std::vector<std::uint8_t>{255, 1, 0, 0, 100, 255})
                                              : std::vector<std::uint8_t>(6, 128));
            EXPECT_EQ(notes.size(), coloured ? 0u : 1u);
        }
}

TEST(LasPoints, colours_of_8_bits_are_read_as_such_and_noted) {
    std::size_t dropped = 0;
    std::vector<std::string> notes;
    const PointCloud points =
        parse_las(las_file({{{0, 0, 0}, {255, 7, 0}}}), "scan.las", dropped, &notes);
    EXPECT_EQ(points.colour, (std::vector<std::uint8_t>{255, 7, 0}));
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("8 bits"), std::string::npos);
}

TEST(LasPoints, what_is_not_read_is_refused_with_a_remedy) {
    std::vector<std::byte> file = las_file(kPoints);
    file[104] = std::byte{0x82};
    EXPECT_NE(las_error(file).find("laszip"), std::string::npos);
    file[104] = std::byte{11};
    EXPECT_NE(las_error(file).find("format 11"), std::string::npos);
    file = las_file(kPoints);
    file[25] = std::byte{5};
    EXPECT_NE(las_error(file).find("version 1.5"), std::string::npos);
    EXPECT_NE(las_error(las_file(kPoints, {.scale = {0, 1, 1}})).find("scale"), std::string::npos);
    file = las_file(kPoints);
    file[105] = std::byte{10};
    EXPECT_NE(las_error(file).find("points of 10 bytes"), std::string::npos);
    EXPECT_NE(las_error({}).find("LASF"), std::string::npos);
}

TEST(LasPoints, files_cut_off_or_damaged_are_survived) {
    const std::vector<std::byte> whole = las_file(kPoints, {.minor = 4, .format = 7});
    for (std::size_t length = 0; length < whole.size(); ++length)
        ASSERT_NE(las_error({whole.begin(), whole.begin() + std::ptrdiff_t(length)}), "no error")
            << length;
    Pcg32 rng(5);
    for (int round = 0; round < 2000; ++round) {
        std::vector<std::byte> damaged = whole;
        for (int change = 0; change < 3; ++change)
            damaged[rng.below(std::uint32_t(whole.size()))] = std::byte(rng.below(256));
        EXPECT_FALSE(las_error(damaged).empty());
    }
}

}  // namespace
}  // namespace darb::test
