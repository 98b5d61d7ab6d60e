// SPDX-License-Identifier: MIT
// From files to pixels: formats, EXIF, masks, scaling, many at once.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <stb/stb_image_write.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>

#include "engine/core/files.h"
#include "engine/core/rng.h"
#include "engine/data/colmap.h"
#include "engine/data/depth_io.h"
#include "engine/data/image_io.h"
#include "tests/unit/data/data_files.h"

namespace darb {
namespace {

/// 16 x 8: red upper left quarter, green upper right, blue lower left, white lower right.
ImageU8 quarters() {
    ImageU8 image(16, 8, 3);
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 16; ++x) {
            const bool right = x >= 8, lower = y >= 4;
            image.at(x, y, 0) = right == lower ? 255 : 0;
            image.at(x, y, 1) = right ? 255 : 0;
            image.at(x, y, 2) = lower ? 255 : 0;
        }
    return image;
}

std::vector<std::byte> jpeg(const ImageU8& image) {
    std::vector<std::byte> file;
    const auto append = [](void* to, void* data, int size) {
        const auto* bytes = static_cast<const std::byte*>(data);
        static_cast<std::vector<std::byte>*>(to)->insert(
            static_cast<std::vector<std::byte>*>(to)->end(), bytes, bytes + size);
    };
    stbi_write_jpg_to_func(append, &file, image.width, image.height, image.channels,
                           image.data.data(), 100);
    return file;
}

std::vector<std::byte> with_orientation(std::vector<std::byte> file, int orientation, bool little) {
    Bytes exif;
    exif.text("Exif").put('\0').put('\0').text(little ? "II" : "MM");
    const auto put = [&](std::uint32_t value, int size) {
        for (int i = 0; i < size; ++i)
            exif.put(static_cast<std::uint8_t>(value >> 8 * (little ? i : size - 1 - i)));
    };
    put(42, 2);
    put(8, 4);
    put(2, 2);  // entries
    put(0x010f, 2), put(2, 2), put(1, 4), put(0, 4);
    put(0x0112, 2), put(3, 2), put(1, 4), put(static_cast<std::uint32_t>(orientation), 2),
        put(0, 2);
    put(0, 4);
    const auto length = exif.data.size() + 2;
    std::vector<std::byte> segment = {std::byte{0xff}, std::byte{0xe1}, std::byte(length >> 8),
                                      std::byte(length & 255)};
    segment.insert(segment.end(), exif.data.begin(), exif.data.end());
    file.insert(file.begin() + 2, segment.begin(), segment.end());
    return file;
}

char colour_at(const ImageU8& image, int x, int y) {
    const bool r = image.at(x, y, 0) > 128, g = image.at(x, y, 1) > 128,
               b = image.at(x, y, 2) > 128;
    if (r && g && b) return 'w';
    return r ? 'r' : g ? 'g' : b ? 'b' : '?';
}

/// The colours of the quarters in reading order.
std::string corners(const ImageU8& image) {
    const int x = image.width - 2, y = image.height - 2;
    return {colour_at(image, 1, 1), colour_at(image, x, 1), colour_at(image, 1, y),
            colour_at(image, x, y)};
}

// TIFF 6.0: what the 0th row and column of the stored image are in the seen one.
constexpr const char* kSeen[9] = {"",     "rgbw", "grwb", "wbgr", "bwrg",
                                  "rbgw", "brwg", "wgbr", "gwrb"};

TEST(Exif, photos_are_turned_as_each_orientation_asks) {
    for (int orientation = 1; orientation <= 8; ++orientation)
        for (const bool little : {true, false}) {
            const auto file = with_orientation(jpeg(quarters()), orientation, little);
            EXPECT_EQ(exif_orientation(file), orientation);
            const ImageU8 image = decode_image(file, "test.jpg");
            EXPECT_EQ(corners(image), kSeen[orientation]) << orientation;
            EXPECT_EQ(image.width, orientation >= 5 ? 8 : 16) << orientation;
            EXPECT_EQ(corners(decode_image(file, "test.jpg", 1)), "rgbw");
        }
}

TEST(Exif, damaged_or_absent_data_means_upright) {
    const auto file = with_orientation(jpeg(quarters()), 6, true);
    for (std::size_t length = 0; length < 80; ++length) {
        const int found = exif_orientation(std::span(file).first(length));
        EXPECT_TRUE(found == 1 || found == 6) << length;
    }
    EXPECT_EQ(exif_orientation(with_orientation(jpeg(quarters()), 9, true)), 1);
    EXPECT_EQ(exif_orientation(with_orientation(jpeg(quarters()), 0, false)), 1);
    EXPECT_EQ(exif_orientation(jpeg(quarters())), 1);
    Pcg32 rng(3);
    for (int i = 0; i < 20000; ++i) {
        std::vector<std::byte> damaged(file.begin(), file.begin() + 80);
        for (int k = 0; k < 3; ++k) damaged[rng.below(80)] = std::byte(rng.below(256));
        const int found = exif_orientation(damaged);
        EXPECT_TRUE(found >= 1 && found <= 8);
    }
}

// The head of a JPEG: IFD0 with the offset of the Exif directory, which has the offset of a time.
std::vector<std::byte> with_time(const std::string& time, bool little) {
    Bytes exif;
    exif.text("Exif").put('\0').put('\0').text(little ? "II" : "MM");
    const auto put = [&](std::uint32_t value, int size) {
        for (int i = 0; i < size; ++i)
            exif.put(static_cast<std::uint8_t>(value >> 8 * (little ? i : size - 1 - i)));
    };
    put(42, 2), put(8, 4), put(1, 2);
    put(0x8769, 2), put(4, 2), put(1, 4), put(26, 4), put(0, 4);
    put(1, 2);
    put(0x9003, 2), put(2, 2), put(static_cast<std::uint32_t>(time.size() + 1), 4), put(44, 4);
    put(0, 4);
    exif.text(time).put('\0');
    const auto length = exif.data.size() + 2;
    std::vector<std::byte> file = {std::byte{0xff},        std::byte{0xd8},
                                   std::byte{0xff},        std::byte{0xe1},
                                   std::byte(length >> 8), std::byte(length & 255)};
    file.insert(file.end(), exif.data.begin(), exif.data.end());
    return file;
}

TEST(Photos, exif_says_when_a_photo_was_taken) {
    const std::string time = "2024:05:31 18:02:11";
    for (const bool little : {false, true}) {
        const std::vector<std::byte> file = with_time(time, little);
        EXPECT_EQ(exif_time(file), time);
        for (std::size_t length = 0; length + 1 < file.size(); ++length)
            EXPECT_EQ(exif_time(std::span(file).first(length)), "") << length;
    }
    EXPECT_EQ(exif_time(with_time("yesterday, 18:02:11", true)), "");
    EXPECT_EQ(exif_time(jpeg(quarters())), "");
}

/// The 35 mm focal length that a photo's EXIF states.
std::vector<std::byte> with_focal_length(std::vector<std::byte> file, int mm) {
    Bytes exif;
    exif.text("Exif").put('\0').put('\0').text("II").put<std::uint16_t>(42);
    exif.put<std::uint32_t>(8).put<std::uint16_t>(1);
    exif.put<std::uint16_t>(0x8769).put<std::uint16_t>(4).put<std::uint32_t>(1);
    exif.put<std::uint32_t>(26).put<std::uint32_t>(0).put<std::uint16_t>(1);
    exif.put<std::uint16_t>(0xa405).put<std::uint16_t>(3).put<std::uint32_t>(1);
    exif.put(static_cast<std::uint32_t>(mm)).put<std::uint32_t>(0);
    const auto length = exif.data.size() + 2;
    std::vector<std::byte> segment = {std::byte{0xff}, std::byte{0xe1}, std::byte(length >> 8),
                                      std::byte(length & 255)};
    segment.insert(segment.end(), exif.data.begin(), exif.data.end());
    file.insert(file.begin() + 2, segment.begin(), segment.end());
    return file;
}

TEST(Exif, a_focal_length_far_from_that_of_the_camera_is_noted) {
    const auto file = with_focal_length(jpeg(quarters()), 43);  // 17.8 px of 16 x 8
    EXPECT_EQ(exif_focal_35mm(file), 43);
    for (std::size_t length = 0; length < 80; ++length) {
        const int found = exif_focal_35mm(std::span(file).first(length));
        EXPECT_TRUE(found == 0 || found == 43) << length;
    }
    const auto folder = test_folder();
    write_file_atomic(folder / "images/a.jpg", file);
    std::vector<View> views(1);
    views[0].name = "a.jpg";
    for (const double focal : {18.0, 26.0, 40.0, 8.0}) {
        views[0].camera = {.width = 16, .height = 8, .fx = focal, .fy = focal, .cx = 8, .cy = 4};
        write_colmap_binary(folder / "sparse/0", views, {});
        const Dataset dataset = load_dataset(folder);
        EXPECT_EQ(dataset.notes.size(), focal == 40 || focal == 8 ? 1u : 0u) << focal;
        for (const std::string& note : dataset.notes)
            EXPECT_NE(note.find("43 mm (on 35 mm film) are 18 px"), std::string::npos) << note;
    }
}

TEST(Exif, the_declared_camera_decides_whether_a_photo_is_turned) {
    const auto folder = test_folder();
    write_file_atomic(folder / "images/a.jpg", with_orientation(jpeg(quarters()), 6, true));
    std::vector<View> views(1);
    views[0].name = "a.jpg";
    for (const bool stored : {true, false}) {
        views[0].camera = {.width = stored ? 16 : 8,
                           .height = stored ? 8 : 16,
                           .fx = 20,
                           .fy = 20,
                           .cx = 8,
                           .cy = 4};
        write_colmap_binary(folder / "sparse/0", views, {});
        const Dataset dataset = load_dataset(folder);
        const ImageU8 photo = load_photo(dataset.views[0]);
        EXPECT_EQ(photo.width, dataset.views[0].camera.width);
        EXPECT_EQ(photo.width, stored ? 16 : 8);
        EXPECT_EQ(corners(photo), stored ? "rgbw" : kSeen[6]);
    }
}

TEST(ImageIo, pictures_of_views_never_share_a_name) {
    std::set<std::string> used;
    EXPECT_EQ(picture_name("left/01.jpg", used), "left_01.png");
    EXPECT_EQ(picture_name("left_01.png", used), "left_01_2.png");
    EXPECT_EQ(picture_name("01.jpg", used), "01.png");
    EXPECT_EQ(picture_name("01.png", used), "01_2.png");
    EXPECT_EQ(picture_name("1.000", used), "1.000.png");
    EXPECT_EQ(picture_name("1.001", used), "1.001.png");
    EXPECT_EQ(picture_name("1.001.JPG", used), "1.001_2.png");
}

TEST(DepthIo, pixels_beyond_the_last_step_are_counted) {
    ImageF depth(3, 1, 1);
    depth.data = {0, 65.535f, 80};
    const auto path = test_folder() / "depth.png";
    const DepthRange coarse = write_depth_png(path, depth, 0.002);
    EXPECT_EQ(coarse.clipped, 0u);
    EXPECT_EQ(coarse.farthest, 80);
    EXPECT_EQ(write_depth_png(path, depth, 0.001).clipped, 1u);
}

TEST(ImageIo, png_round_trips_with_each_channel_count) {
    for (const int channels : {1, 3, 4}) {
        ImageU8 image(5, 3, channels);
        Pcg32 rng(1);
        for (std::uint8_t& value : image.data) value = static_cast<std::uint8_t>(rng.below(256));
        const auto path = test_folder() / "new" / "a.png";
        write_png(path, image);
        EXPECT_EQ(read_image(path).data, image.data);
        EXPECT_EQ(read_image_info(path).channels, channels);
        EXPECT_EQ(read_image_info(path).width, 5);
    }
}

using Row = std::vector<std::uint8_t>;

/// A PNG by hand: its header, the data of its chunk tRNS (none where empty) and its filtered rows.
std::vector<std::byte> png_of(const Row& header, const Row& transparent, const Row& rows) {
    Bytes png;
    png.text("\x89PNG\r\n\x1a\n");
    const auto chunk = [&](const std::string& type, std::span<const std::byte> data) {
        const auto big = [&](std::uint32_t value) {
            for (int i = 3; i >= 0; --i) png.put(static_cast<std::uint8_t>(value >> 8 * i));
        };
        Bytes body;
        body.text(type);
        body.data.insert(body.data.end(), data.begin(), data.end());
        big(static_cast<std::uint32_t>(data.size()));
        png.data.insert(png.data.end(), body.data.begin(), body.data.end());
        big(static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(body.data.data()),
                                             static_cast<uInt>(body.data.size()))));
    };
    std::vector<std::byte> packed(100);
    uLongf size = packed.size();
    compress(reinterpret_cast<Bytef*>(packed.data()), &size, rows.data(), rows.size());
    packed.resize(size);
    chunk("IHDR", std::as_bytes(std::span(header)));
    if (!transparent.empty()) chunk("tRNS", std::as_bytes(std::span(transparent)));
    chunk("IDAT", packed);
    chunk("IEND", {});
    return png.data;
}

TEST(ImageIo, sixteen_bit_png_keeps_its_high_bytes) {
    const Row header{0, 0, 0, 2, 0, 0, 0, 1, 16, 2, 0, 0, 0};  // 2 x 1, 16-bit RGB
    const auto file = png_of(header, {}, {0, 10, 99, 20, 99, 30, 99, 40, 0, 50, 0, 60, 0});
    EXPECT_EQ(decode_image(file, "deep.png").data, (Row{10, 20, 30, 40, 50, 60}));
}

TEST(ImageIo, a_transparent_colour_is_an_alpha_channel) {
    const auto path = test_folder() / "a.png";
    const Row header{0, 0, 0, 2, 0, 0, 0, 1, 8, 2, 0, 0, 0};  // 2 x 1, 8-bit RGB
    write_file_atomic(path, png_of(header, {0, 40, 0, 50, 0, 60}, {0, 10, 20, 30, 40, 50, 60}));
    EXPECT_EQ(read_image_info(path).channels, 4);
    const ImageU8 image = read_image(path);
    EXPECT_EQ(image.channels, 4);
    EXPECT_EQ(image.data, (Row{10, 20, 30, 255, 40, 50, 60, 0}));
    const Row grey_header{0, 0, 0, 2, 0, 0, 0, 1, 8, 0, 0, 0, 0};
    write_file_atomic(path, png_of(grey_header, {0, 7}, {0, 7, 8}));
    EXPECT_EQ(read_image_info(path).channels, 2);
    EXPECT_EQ(read_image(path).data, (Row{7, 7, 7, 0, 8, 8, 8, 255}));
}

TEST(ImageIo, damaged_files_are_errors_that_name_the_file) {
    const auto path = test_folder() / "a.png";
    write_png(path, quarters());
    std::vector<std::byte> file = read_file(path);
    for (std::size_t length = 0; length + 20 < file.size(); ++length)
        EXPECT_EQ(
            error_of([&] { decode_image(std::span(file).first(length), "cut.png"); }).find("cut"),
            0u)
            << length;
    write_file_atomic(path, "no image");
    EXPECT_NE(error_of([&] { read_image_info(path); }).find("a.png"), std::string::npos);
    EXPECT_NE(error_of([&] { read_image_info(path / "b"); }).find("Not a directory"),
              std::string::npos);
}

TEST(BoxDownscale, whole_factor_is_the_mean) {
    ImageU8 image(4, 2, 4);
    for (std::size_t i = 0; i < 8; ++i) {
        image.data[i * 4] = static_cast<std::uint8_t>(i * 10);
        image.data[i * 4 + 3] = 255;
    }
    const ImageU8 half = box_downscale(image, 2, 1);
    EXPECT_EQ(half.data[0], 25);  // 0 10 40 50
    EXPECT_EQ(half.data[4], 45);
    EXPECT_EQ(half.data[3], 255);
}

TEST(BoxDownscale, fractional_factor_covers_parts_of_pixels) {
    ImageU8 image(3, 1, 4);
    for (std::size_t i = 0; i < 3; ++i) {
        image.data[i * 4] = static_cast<std::uint8_t>(i * 90);
        image.data[i * 4 + 3] = 255;
    }
    const ImageU8 out = box_downscale(image, 2, 1);
    EXPECT_EQ(out.data[0], 30);   // (0 + 90 / 2) / 1.5
    EXPECT_EQ(out.data[4], 150);  // (90 / 2 + 180) / 1.5
}

TEST(BoxDownscale, transparent_pixels_lend_no_colour) {
    ImageU8 image(2, 1, 4);
    image.data = {200, 100, 50, 255, 7, 7, 7, 0};
    EXPECT_EQ(box_downscale(image, 1, 1).data, (std::vector<std::uint8_t>{200, 100, 50, 128}));
}

TEST(BoxDownscale, constant_image_stays_constant_at_any_size) {
    ImageU8 image(37, 23, 4);
    std::fill(image.data.begin(), image.data.end(), std::uint8_t{255});
    for (int width = 1; width <= 37; ++width)
        for (const std::uint8_t value : box_downscale(image, width, 1 + width % 23).data)
            ASSERT_EQ(value, 255) << width;
}

TEST(Mask, of_another_size_and_of_zeros_and_ones) {
    ImageU8 image = to_rgba(ImageU8(4, 2, 1)), mask(2, 1, 1);
    mask.data = {0, 1};
    apply_mask(image, mask);
    for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 4; ++x) EXPECT_EQ(image.at(x, y, 3), x < 2 ? 0 : 255);
}

TEST(Mask, is_in_the_alpha_channel_where_that_varies) {
    const auto alpha_of = [](const std::vector<std::uint8_t>& pixels) {
        ImageU8 image = to_rgba(ImageU8(2, 1, 1)), mask(2, 1, 4);
        mask.data = pixels;
        apply_mask(image, mask);
        return std::pair<int, int>(image.data[3], image.data[7]);
    };
    using Two = std::pair<int, int>;
    EXPECT_EQ(alpha_of({255, 255, 255, 0, 255, 255, 255, 255}), Two(0, 255)) << "white";
    EXPECT_EQ(alpha_of({0, 0, 0, 0, 0, 0, 0, 255}), Two(0, 255)) << "black";
    EXPECT_EQ(alpha_of({10, 90, 30, 0, 40, 200, 0, 200}), Two(0, 200)) << "cut out of the photo";
    EXPECT_EQ(alpha_of({0, 0, 0, 255, 255, 255, 255, 255}), Two(0, 255)) << "opaque";
    EXPECT_EQ(alpha_of({0, 0, 0, 255, 255, 255, 255, 100}), Two(0, 100)) << "both";
}

/// Opaque except for one quarter, which is ignored.
ImageU8 mask_without(int width, int height, bool lower) {
    ImageU8 mask(width, height, 1);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            mask.at(x, y, 0) = x < width / 2 && (y >= height / 2) == lower ? 0 : 255;
    return mask;
}

TEST(Mask, is_turned_like_its_photo_whichever_way_it_was_made) {
    const auto folder = test_folder();
    write_file_atomic(folder / "images/a.jpg", with_orientation(jpeg(quarters()), 6, true));
    std::vector<View> views(1);
    views[0].name = "a.jpg";
    for (const bool photo_stored : {true, false})
        for (const bool mask_stored : {true, false}) {
            const int width = photo_stored ? 16 : 8;
            views[0].camera = {
                .width = width, .height = 24 - width, .fx = 20, .fy = 20, .cx = 8, .cy = 4};
            write_colmap_binary(folder / "sparse/0", views, {});
            // Blue is the lower left quarter as stored, the upper left as shown.
            write_png(folder / "masks/a.png",
                      mask_stored ? mask_without(16, 8, true) : mask_without(8, 16, false));
            const ImageU8 photo = load_photo(load_dataset(folder).views[0]);
            ASSERT_EQ(photo.width, width);
            for (int y = 1; y < photo.height; y += photo.height / 2 + 1)
                for (int x = 1; x < photo.width; x += photo.width / 2 + 1)
                    EXPECT_EQ(photo.at(x, y, 3), colour_at(photo, x, y) == 'b' ? 0 : 255)
                        << photo_stored << mask_stored << " at " << x << ", " << y;
        }
    write_png(folder / "masks/a.png", ImageU8(12, 12, 1));
    const std::string error = error_of([&] { load_photo(load_dataset(folder).views[0]); });
    EXPECT_NE(error.find("masks/a.png"), std::string::npos) << error;
    EXPECT_NE(error.find("images/a.jpg"), std::string::npos) << error;
}

TEST(LoadPhotos, order_is_kept_and_errors_arrive) {
    const auto folder = test_folder();
    std::vector<View> views(20);
    for (std::size_t i = 0; i < views.size(); ++i) {
        ImageU8 image(3, 2, 1);
        image.data[0] = static_cast<std::uint8_t>(i);
        views[i].photo = folder / (std::to_string(i) + ".png");
        views[i].lens = {"PINHOLE", {1, 1, 1, 1}, 3, 2};
        views[i].camera = {.width = 3, .height = 2};
        write_png(views[i].photo, image);
    }
    for (const int threads : {0, 1, 3, 64}) {
        const std::vector<ImageU8> photos = load_photos(views, threads);
        for (std::size_t i = 0; i < views.size(); ++i) EXPECT_EQ(photos[i].data[0], i);
    }
    EXPECT_TRUE(load_photos({}).empty());
    views[11].photo = folder / "missing.png";
    EXPECT_NE(error_of([&] { load_photos(views); }).find("missing.png"), std::string::npos);
}

TEST(PhotoDetail, is_the_mean_difference_from_the_neighbours_in_training_photos) {
    const auto folder = test_folder();
    // Stripes one pixel wide; the same with a transparent left half; stripes that are held out;
    // plain grey.
    std::vector<View> views(4);
    for (std::size_t i = 0; i < views.size(); ++i) {
        ImageU8 image(12, 6, 4);
        for (int y = 0; y < 6; ++y)
            for (int x = 0; x < 12; ++x) {
                const int grey = i == 3 ? 90 : x % 2 * 255;
                for (int c = 0; c < 3; ++c) image.at(x, y, c) = static_cast<std::uint8_t>(grey);
                image.at(x, y, 3) = i == 1 && x < 6 ? 0 : 255;
            }
        views[i].photo = folder / (std::to_string(i) + ".png");
        views[i].lens = {"PINHOLE", {1, 1, 1, 1}, 12, 6};
        views[i].camera = {.width = 12, .height = 6};
        views[i].is_test = i == 2;
        write_png(views[i].photo, image);
    }
    const auto expect = [&](const std::vector<View>& of, double per_pixel, double opaque) {
        const PhotoDetail found = photo_detail(of);
        EXPECT_NEAR(found.per_pixel, per_pixel, 1e-12);
        EXPECT_NEAR(found.opaque, opaque, 1e-12);
    };
    expect({views[0]}, 2, 1);
    expect({views[1]}, 2, 0.4);  // 4 of 10 columns
    expect({views[3]}, 0, 1);
    expect(views, 2 * (1 + 0.4) / 2.4, 2.4 / 3);
    expect({}, 0, 0);
    expect({views[2]}, 0, 0);
}

TEST(LoadPhotos, what_does_not_fit_into_memory_is_said_before_anything_is_read) {
    const auto folder = test_folder();
    std::vector<View> views(6);
    for (std::size_t i = 0; i < views.size(); ++i) {
        views[i].photo = folder / (std::to_string(i) + ".png");
        views[i].lens = {"PINHOLE", {1, 1, 1, 1}, 30, 20};
        views[i].camera = {.width = 30, .height = 20};
        write_png(views[i].photo, ImageU8(30, 20, 3));
    }
    constexpr std::uint64_t kOnePhoto = 16 * 30 * 20, kAll = 6 * 4 * 30 * 20;
    EXPECT_EQ(load_photos(views, 6, kAll).size(), 6u);  // one at a time
    EXPECT_NE(error_of([&] { load_photos(views, 6, kAll - 1); }).find("6 photos: take 0 MB"),
              std::string::npos);
    views[3].lens.width = 30'000, views[3].lens.height = 20'000;
    EXPECT_NE(
        error_of([&] { load_photos(views, 6, 1000 * kOnePhoto); }).find("3.png: takes 9155 MB"),
        std::string::npos);
}

// What users name in place of a data set.
TEST(Photos, what_holds_no_cameras_is_told_with_the_way_to_them) {
    const auto folder = test_folder();
    const auto says = [&](const std::filesystem::path& name) {
        return error_of([&] { load_dataset(folder / name, {}); });
    };
    const auto has = [](const std::string& text, const char* part) {
        EXPECT_NE(text.find(part), std::string::npos) << text;
    };
    for (const char* name : {"a.HEIC", "a.jpg", "a.mov", "a.txt", "photos/images/b.jpg",
                             "film/clip.mp4", "hidden/.clip.mp4"})
        write_file_atomic(folder / name, std::string("x"));
    has(says("a.HEIC"), "is one picture");
    has(says("a.jpg"), "Name the folder of the photos");
    has(says("a.mov"), "is a video, without cameras");
    has(says("a.mov"), "darb train '");
    has(says("a.txt"), "nor a video");
    has(says("photos"), "but pictures");
    has(says("film"), "clip.mp4' -o OUT");
    has(says("hidden"), "holds no cameras: neither");
}

ImageU8 rgba(std::uint8_t grey, std::uint8_t alpha, std::uint8_t corner = 0) {
    ImageU8 image(8, 8, 4);
    for (std::size_t at = 0; at < image.data.size(); ++at)
        image.data[at] = at % 4 == 3 ? alpha : grey;
    if (corner > 0) image.data[0] = corner;
    return image;
}

std::vector<std::string> doubts_of(const std::vector<ImageU8>& photos) {
    Dataset dataset;
    dataset.root = "set";
    for (std::size_t i = 0; i < photos.size(); ++i) {
        dataset.views.emplace_back();
        dataset.views.back().name = fmt::format("p{}.png", i);
        dataset.views.back().photo = "set/" + dataset.views.back().name;
    }
    return photo_doubts(dataset, photos);
}

TEST(PhotoDoubts, photos_that_teach_something_have_none) {
    EXPECT_TRUE(doubts_of({rgba(9, 255), rgba(9, 255, 200), rgba(0, 255, 90)}).empty());
}

TEST(PhotoDoubts, photos_that_are_transparent_everywhere_are_named) {
    const auto some = doubts_of({rgba(9, 255), rgba(50, 0), rgba(70, 255)});
    ASSERT_EQ(some.size(), 1u);
    EXPECT_NE(some[0].find("1 of 3"), std::string::npos) << some[0];
    EXPECT_NE(some[0].find("p1.png"), std::string::npos) << some[0];
    try {
        doubts_of({rgba(9, 0), rgba(50, 0)});
        FAIL() << "taken";
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("transparent everywhere, as set/p0.png"),
                  std::string::npos)
            << e.what();
        EXPECT_NE(e.hint.find("--effects=-alpha"), std::string::npos);
    }
}

TEST(PhotoDoubts, black_and_repeated_photos_and_one_alone_are_named) {
    const auto all = doubts_of({rgba(0, 255), rgba(50, 255), rgba(50, 255), rgba(7, 255)});
    ASSERT_EQ(all.size(), 2u);
    EXPECT_NE(all[0].find("1 of 4 photos are black everywhere: p0.png"), std::string::npos);
    EXPECT_NE(all[1].find("2 of 4 photos have the same pixels"), std::string::npos) << all[1];
    EXPECT_NE(all[1].find("p1.png, p2.png"), std::string::npos) << all[1];
    const auto alone = doubts_of({rgba(50, 255, 9)});
    ASSERT_EQ(alone.size(), 1u);
    EXPECT_NE(alone[0].find("p0.png"), std::string::npos) << alone[0];
}

}  // namespace
}  // namespace darb
