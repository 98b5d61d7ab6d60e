// SPDX-License-Identifier: MIT
// PNG and JPEG files: reading size and orientation without decoding, decoding, and encoding.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/dataset.h"

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

// Pixel operations that turn a decoded photo into a training photo, all on RGBA with straight
// alpha.

/// Converts 1, 3 or 4 channels to 4; alpha is 255 where there was none.
ImageU8 to_rgba(ImageU8 image);

/// Multiplies alpha by the mask's first channel / 255 (by 0 or 1 where its largest value is 1); by
/// the mask's alpha instead where that varies, and by both where its colours are black and white. A
/// mask of another size is sampled at the nearest pixel. The colour stays where alpha becomes 0.
void apply_mask(ImageU8& rgba, const ImageU8& mask);

/// The mean over each target pixel's area, in premultiplied alpha, rounded to nearest. Any size is
/// allowed, but neither side may be larger than that of the source.
ImageU8 box_downscale(const ImageU8& rgba, int width, int height);

/// The pinhole that load_photo undistorts a lens to, at full size, and whether some of its pixels
/// are seen by no pixel of the photo. A lens without distortion keeps its size and intrinsics. The
/// pose is the identity.
struct UndistortedFrame {
    Camera camera;
    bool has_gaps = false;
};
UndistortedFrame undistorted_frame(const LensModel& lens, const std::string& where);

/// Resamples bilinearly in premultiplied alpha; alpha is 0 where the lens sees nothing.
ImageU8 undistort(const ImageU8& rgba, const LensModel& lens, const Camera& camera);

// What the decoders of PNG and JPEG share: the size that a file claims is checked before
// anything of that size is allocated. Photos come from strangers, so the decoding itself is left to
// libpng and libjpeg-turbo, which the distribution maintains.

/// What the head of a photo states.
struct PhotoHead {
    int width = 0;     // px, as stored
    int height = 0;    // px, as stored
    int channels = 0;  // 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA, as decoded, whatever is stored
    bool cut = false;  // the bytes end before the head does; the other members are 0
};

constexpr std::int64_t kMostPhotoSide = 65'535;                   // px; no JPEG can say more
constexpr std::int64_t kMostPhotoPixels = std::int64_t{1} << 28;  // 16,384 x 16,384: 1 GiB as RGBA

constexpr const char* kReplacePhoto =
    "Replace the file by a PNG or JPEG that an image viewer opens, or leave the photo out.";

/// Throws Error where the sides exceed the limits, or where so many pixels need at least `least`
/// bytes of file and this one has only `bytes`.
void check_photo_claim(std::int64_t width, std::int64_t height, std::uint64_t least,
                       std::uint64_t bytes, const std::string& where);

bool is_jpeg(std::span<const std::byte> file);
bool is_png(std::span<const std::byte> file);

/// head: the first part of a file that has `bytes` bytes, or all of it.
PhotoHead jpeg_head(std::span<const std::byte> head, std::uint64_t bytes, const std::string& where);
PhotoHead png_head(std::span<const std::byte> head, std::uint64_t bytes, const std::string& where);

/// Decodes a whole file to 1, 3 or 4 channels (grey with alpha becomes RGBA), not turned. Throws
/// Error where data are damaged or cut off, saying where in the photo.
ImageU8 decode_jpeg(std::span<const std::byte> file, const std::string& where);
ImageU8 decode_png(std::span<const std::byte> file, const std::string& where);

/// A 16-bit grey image. decode_png16 throws Error with `hint` where the PNG is anything else.
struct GreyU16 {
    int width = 0, height = 0;        // px
    std::vector<std::uint16_t> data;  // [height][width]
};
GreyU16 decode_png16(std::span<const std::byte> file, const std::string& where,
                     const std::string& hint);

}  // namespace darb
