// SPDX-License-Identifier: MIT
// Untrusted photos: every kind of PNG and JPEG, and files that are cut off, damaged or made to
// break a decoder.
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>

#include "engine/core/files.h"
#include "engine/core/rng.h"
#include "engine/data/image_io.h"
#include "tests/support/photo_files.h"
#include "tests/unit/data/data_files.h"

namespace darb {
namespace {

std::string refusal(std::span<const std::byte> file) {
    return error_of([&] { decode_image(file, "a photo"); });
}

/// Offset of the first segment with that marker in a JPEG.
std::size_t segment(const std::vector<std::byte>& file, int marker) {
    for (std::size_t at = 2; at + 4 < file.size();) {
        if (file[at + 1] == std::byte(marker)) return at;
        at += 2 + (std::to_integer<std::size_t>(file[at + 2]) << 8 |
                   std::to_integer<std::size_t>(file[at + 3]));
    }
    ADD_FAILURE() << "no segment " << marker;
    return 0;
}

constexpr int kFrame = 0xc0, kHuffman = 0xc4, kQuantisation = 0xdb;

TEST(Photos, every_kind_of_file_is_read_with_the_channels_that_its_head_says) {
    for (const auto& [name, file] : test::sample_photos()) {
        const ImageInfo info = parse_image_info(file, name);
        const ImageU8 image = decode_image(file, name);
        EXPECT_EQ(image.width, info.width) << name;
        EXPECT_EQ(image.channels, info.channels == 2 ? 4 : info.channels) << name;
        EXPECT_EQ(image.width, name.starts_with("png") ? 9
                               : name.starts_with("progressive.") || name.starts_with("restarts")
                                   ? 40
                                   : 16)
            << name;
    }
}

TEST(Photos, a_jpeg_has_the_pixels_that_were_put_in) {
    // A gentle slope, so that only the rounding of the coefficients is left.
    for (const bool progressive : {false, true})
        for (const int channels : {1, 3}) {
            const ImageU8 image = decode_image(test::jpeg_file({.width = 64,
                                                                .height = 48,
                                                                .channels = channels,
                                                                .progressive = progressive,
                                                                .sampling = 1}),
                                               "a");
            const std::vector<std::uint8_t> truth = test::slope(64, 48, channels);
            double sum = 0;
            for (std::size_t i = 0; i < truth.size(); ++i)
                sum += std::abs(image.data[i] - truth[i]);
            EXPECT_LT(sum / static_cast<double>(truth.size()), 8) << channels;
        }
}

TEST(Photos, four_inks_become_rgb) {
    const ImageU8 image = decode_image(test::jpeg_file({.channels = 4, .sampling = 1}), "a");
    ASSERT_EQ(image.channels, 3);
    const std::vector<std::uint8_t> inks = test::slope(16, 12, 4);
    double sum = 0;
    for (std::size_t i = 0; i < 16 * 12; ++i)
        for (std::size_t c = 0; c < 3; ++c)
            sum += std::abs(image.data[3 * i + c] - inks[4 * i + c] * inks[4 * i + 3] / 255.0);
    EXPECT_LT(sum / (3 * 16 * 12), 8);
}

TEST(Photos, gamma_and_interlacing_change_no_pixel) {
    for (const int type : {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_PALETTE})
        for (const bool interlaced : {false, true}) {
            const ImageU8 plain = decode_image(test::png_file({.type = type}), "a");
            EXPECT_EQ(
                decode_image(test::png_file({.type = type, .interlaced = interlaced, .gamma = 1.0}),
                             "a")
                    .data,
                plain.data);
        }
    EXPECT_EQ(decode_image(test::png_file({}), "a").data, test::slope(27, 7, 1));
}

TEST(Photos, a_png_with_any_bit_flipped_is_refused) {
    for (const bool interlaced : {false, true}) {
        const std::vector<std::byte> whole =
            test::png_file({.interlaced = interlaced, .gamma = 0.5});
        std::size_t accepted = 0;
        for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
            std::vector<std::byte> file = whole;
            file[bit / 8] ^= std::byte(1 << bit % 8);
            try {
                decode_image(file, "a");
                ++accepted;
            } catch (const Error&) {
            }
        }
        EXPECT_EQ(accepted, 0u);
    }
}

TEST(Photos, a_jpeg_that_is_cut_off_is_refused_and_says_where) {
    for (const test::JpegKind& kind :
         {test::JpegKind{}, test::JpegKind{.restart = 1},
          test::JpegKind{.channels = 1, .sampling = 1}, test::JpegKind{.progressive = true}}) {
        const std::vector<std::byte> file = test::jpeg_file(kind);
        // Only the end marker may be missing, where all pixels are there.
        const std::size_t complete = kind.progressive ? file.size() : file.size() - 2;
        for (std::size_t length = 0; length < complete; ++length)
            EXPECT_EQ(refusal(std::span(file).first(length)).find("a photo"), 0u) << length;
        if (kind.progressive) continue;
        EXPECT_EQ(decode_image(std::span(file).first(complete), "a").data,
                  decode_image(file, "a").data);
        EXPECT_NE(refusal(std::span(file).first(file.size() - 20)).find("at row"),
                  std::string::npos);
    }
}

TEST(Photos, a_jpeg_without_quantisation_tables_is_refused) {
    std::vector<std::byte> file = test::jpeg_file({.channels = 1, .sampling = 1});
    const std::size_t at = segment(file, kQuantisation);
    file.erase(file.begin() + at, file.begin() + at + 2 + 67);
    EXPECT_NE(refusal(file).find("Quantization table"), std::string::npos);
}

TEST(Photos, a_jpeg_with_huffman_tables_beyond_their_bounds_is_refused) {
    for (const int count : {3, 255}) {
        std::vector<std::byte> file = test::jpeg_file({});
        const std::size_t at = segment(file, kHuffman);
        std::fill_n(file.begin() + at + 5, 16, std::byte(count));
        EXPECT_NE(refusal(file).find("Huffman"), std::string::npos) << refusal(file);
    }
}

TEST(Photos, bytes_between_segments_are_harmless_and_changed_data_are_an_error_or_pixels) {
    const std::vector<std::byte> whole = test::jpeg_file({.restart = 1});
    std::vector<std::byte> more = whole;
    more.insert(more.end() - 2, 5, std::byte{7});
    EXPECT_EQ(decode_image(more, "a").data, decode_image(whole, "a").data);
    Pcg32 rng(5);
    for (int i = 0; i < 3000; ++i) {
        std::vector<std::byte> file = whole;
        for (int k = 0; k < 2; ++k)
            file[rng.below(static_cast<std::uint32_t>(file.size()))] = std::byte(rng.below(256));
        try {
            const ImageU8 image = decode_image(file, "a");
            EXPECT_EQ(image.data, decode_image(file, "a").data);
        } catch (const Error&) {
        }
    }
}

TEST(Photos, what_a_file_cannot_hold_is_refused_before_anything_is_allocated) {
    std::vector<std::byte> file = test::jpeg_file({});
    const std::size_t at = segment(file, kFrame);
    for (const std::size_t k : {at + 5, at + 7})
        file[k] = std::byte{0x4e}, file[k + 1] = std::byte{0x20};
    EXPECT_NE(refusal(file).find("claims 20000 x 20000 px"), std::string::npos);
    for (const std::size_t k : {at + 5, at + 7})
        file[k] = std::byte{0xff}, file[k + 1] = std::byte{0xdc};
    EXPECT_NE(refusal(file).find("limit"), std::string::npos);
    std::vector<std::byte> png = test::png_file({});
    constexpr std::size_t kHeader = 12, kLength = 17;  // its type and data
    for (const std::size_t k : {kHeader + 4, kHeader + 8})
        png[k + 2] = std::byte{0x4e}, png[k + 3] = std::byte{0x20};
    const auto sum = static_cast<std::uint32_t>(
        crc32(0, reinterpret_cast<const Bytef*>(&png[kHeader]), kLength));
    for (std::size_t i = 0; i < 4; ++i)
        png[kHeader + kLength + i] = std::byte(sum >> (24 - 8 * i) & 255);
    EXPECT_NE(refusal(png).find("claims 20000 x 20000 px"), std::string::npos);
    const auto path = test_folder() / "a.jpg";
    write_file_atomic(path, file);
    EXPECT_NE(error_of([&] { read_image_info(path); }).find("a.jpg: claims"), std::string::npos);
}

TEST(Photos, scans_are_limited_and_arithmetic_coding_is_refused) {
    const test::JpegKind many{.channels = 1, .progressive = true, .sampling = 1, .scans = 99};
    EXPECT_EQ(decode_image(test::jpeg_file(many), "a").width, 16);
    test::JpegKind more = many;
    more.scans = 120;
    EXPECT_NE(refusal(test::jpeg_file(more)).find("more than 100 scans"), std::string::npos);
    EXPECT_NE(refusal(test::jpeg_file({.arithmetic = true})).find("arithmetic"), std::string::npos);
}

TEST(Photos, files_that_broke_another_decoder_are_refused) {
    const auto folder = test_data() / "hostile";
    DARB_NEED_DATA(folder);
    int found = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
        if (entry.path().extension() == ".jpg") {
            EXPECT_NE(error_of([&] { read_image(entry.path()); }).find("cannot be decoded"),
                      std::string::npos);
            ++found;
        }
    EXPECT_EQ(found, 5);
}

}  // namespace
}  // namespace darb
