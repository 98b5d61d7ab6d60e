// SPDX-License-Identifier: MIT
// PNG and JPEG files: reading size and orientation without decoding, decoding, and encoding.
#pragma once

#include <cstddef>
#include <filesystem>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "engine/core/image.h"

namespace darb {

struct ImageInfo {
    int width = 0;        // px, as stored
    int height = 0;       // px, as stored
    int channels = 0;     // 1 to 4, as stored
    int orientation = 1;  // EXIF, 1 to 8
    int focal_35mm = 0;   // EXIF focal length, mm on 35 mm film; 0: not stated
};

/// Whether the name ends like that of a picture that can be read here: .png, .jpg, .jpeg.
bool is_photo_name(const std::filesystem::path& path);
/// Whether the name ends like that of a picture that cannot be read here (.webp, .tif, .heic, ...).
bool is_foreign_picture_name(const std::filesystem::path& path);
/// The path without any of these extensions; unchanged where it has none of them.
std::filesystem::path without_picture_extension(const std::filesystem::path& path);

constexpr int kExifOrientation = 0;  // turn as the file's EXIF says

/// Reads only the head of the file. Throws Error naming the file where it is not a PNG or JPEG.
ImageInfo read_image_info(const std::filesystem::path& path);
ImageInfo parse_image_info(std::span<const std::byte> file, const std::string& where);

/// Reads an image with 1, 3 or 4 channels of 8 bits (16-bit PNGs lose their low byte; grey with
/// alpha becomes RGBA), turned by `orientation`, 1 to 8. Throws Error naming the file. Thread-safe.
ImageU8 read_image(const std::filesystem::path& path, int orientation = kExifOrientation);
ImageU8 decode_image(std::span<const std::byte> file, const std::string& where,
                     int orientation = kExifOrientation);

/// The image turned and mirrored as EXIF orientation 1 to 8 asks; 5 to 8 swap width and height.
ImageU8 orient_image(const ImageU8& image, int orientation);

/// image: 1, 3 or 4 channels.
std::vector<std::byte> encode_png(const ImageU8& image);
/// quality: 1 to 100. An alpha channel is dropped.
std::vector<std::byte> encode_jpeg(const ImageU8& image, int quality);

/// Writes encode_png(image) with write_file_atomic, which makes missing folders.
void write_png(const std::filesystem::path& path, const ImageU8& image);

/// A file name for a picture of a view: the view's name without its picture extension, with folders
/// joined by "_", then "_2", "_3" and so on where `used` already has the name, then ".png". Adds it
/// to `used`.
std::string picture_name(const std::string& view_name, std::set<std::string>& used);

// The EXIF tags that matter here: how a stored photo must be turned, its focal length, and when it
// was taken.

/// EXIF orientation of a JPEG, 1 to 8 (TIFF 6.0, tag 0x0112); 1 where it is missing or damaged.
/// Never reads outside `file`, which may be just the beginning of the file.
int exif_orientation(std::span<const std::byte> file);

/// The 35 mm equivalent focal length in mm (Exif 2.3, tag 0xA405); 0 where it is missing. Never
/// reads outside `file` either.
int exif_focal_35mm(std::span<const std::byte> file);

/// When a JPEG was taken, "2024:05:31 18:02:11" (Exif 3.0, tag 0x9003); empty where it is missing
/// or damaged. Never reads outside `file` either.
std::string exif_time(std::span<const std::byte> file);

}  // namespace darb
