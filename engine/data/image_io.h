// PNG and JPEG files: size and orientation without decoding, whole images, PNG and JPEG out.
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
    int focal_35mm = 0;   // EXIF, mm on 35 mm film; 0: not there
};

/// Whether the name ends as those of the pictures do that are read here: .png, .jpg, .jpeg.
bool is_photo_name(const std::filesystem::path& path);
/// Whether it ends as those of pictures do that are not (.webp, .tif, .heic, ...).
bool is_foreign_picture_name(const std::filesystem::path& path);
/// The path without either extension; as it is where it has none of them.
std::filesystem::path without_picture_extension(const std::filesystem::path& path);

constexpr int kExifOrientation = 0;  // turn as the file's EXIF says

/// Reads the head of the file only. Throws Error naming the file where it is no PNG or JPEG.
ImageInfo read_image_info(const std::filesystem::path& path);
ImageInfo parse_image_info(std::span<const std::byte> file, const std::string& where);

/// 1, 3 or 4 channels, 8 bits (16-bit PNGs lose their low byte; grey with alpha becomes RGBA),
/// turned by `orientation`, 1 to 8. Throws Error naming the file. Thread-safe.
ImageU8 read_image(const std::filesystem::path& path, int orientation = kExifOrientation);
ImageU8 decode_image(std::span<const std::byte> file, const std::string& where,
                     int orientation = kExifOrientation);

/// The image turned and mirrored as EXIF number 1 to 8 asks for; 5 to 8 swap width and height.
ImageU8 orient_image(const ImageU8& image, int orientation);

/// 1, 3 or 4 channels.
std::vector<std::byte> encode_png(const ImageU8& image);
/// quality: 1 to 100. An alpha channel is left out.
std::vector<std::byte> encode_jpeg(const ImageU8& image, int quality);

/// encode_png through write_file_atomic, so makes missing folders.
void write_png(const std::filesystem::path& path, const ImageU8& image);

/// A file name for a picture of a view: the view's name without its picture extension, with folders
/// joined by "_", then "_2", "_3" and so on where `used` already has the name, then ".png". Adds it
/// to `used`.
std::string picture_name(const std::string& view_name, std::set<std::string>& used);

// The EXIF tags that matter here: how a stored photo is to be turned, its focal
// length, and when it was taken.

/// EXIF orientation of a JPEG, 1 to 8 (TIFF 6.0, tag 0x0112); 1 where there is none or it is
/// damaged. Never reads outside `file`, which may be only the first part of the file.
int exif_orientation(std::span<const std::byte> file);

/// Focal length in mm of the lens that sees as much on 35 mm film (Exif 2.3, tag 0xA405); 0 where
/// it is not there. Reads as exif_orientation does.
int exif_focal_35mm(std::span<const std::byte> file);

/// When a JPEG was taken, "2024:05:31 18:02:11" (Exif 3.0, tag 0x9003); empty where that is not
/// said or damaged. Never reads outside `file` either.
std::string exif_time(std::span<const std::byte> file);

}  // namespace darb
