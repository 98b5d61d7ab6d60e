// What the decoders of PNG and JPEG share: what a file claims to be, checked before anything of
// that size is allocated. Photos come from strangers: the decoding itself is libpng's and
// libjpeg-turbo's, which the distribution maintains.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/core/image.h"

namespace darb {

/// What the head of a photo says.
struct PhotoHead {
    int width = 0;   // px, as stored
    int height = 0;  // px, as stored
    int channels =
        0;  // 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA; of what is decoded, whatever is stored
    bool cut = false;  // the bytes end before the head does, and the rest above is 0
};

constexpr std::int64_t kMostPhotoSide = 65'535;                   // px; no JPEG can say more
constexpr std::int64_t kMostPhotoPixels = std::int64_t{1} << 28;  // 16,384 x 16,384: 1 GiB as RGBA

constexpr const char* kReplacePhoto =
    "Replace the file by a PNG or JPEG that an image viewer opens, or leave the photo out.";

/// Throws Error where the sides are beyond the limits, or where so many pixels need at least
/// `least` bytes of a file and this one has `bytes`.
void check_photo_claim(std::int64_t width, std::int64_t height, std::uint64_t least,
                       std::uint64_t bytes, const std::string& where);

bool is_jpeg(std::span<const std::byte> file);
bool is_png(std::span<const std::byte> file);

/// head: the first part of a file of `bytes` bytes, or all of it.
PhotoHead jpeg_head(std::span<const std::byte> head, std::uint64_t bytes, const std::string& where);
PhotoHead png_head(std::span<const std::byte> head, std::uint64_t bytes, const std::string& where);

/// All of the file: 1, 3 or 4 channels (grey with alpha becomes RGBA), not turned. Data that are
/// damaged or cut off are an Error that says where in the photo.
ImageU8 decode_jpeg(std::span<const std::byte> file, const std::string& where);
ImageU8 decode_png(std::span<const std::byte> file, const std::string& where);

/// 16-bit grey, of a PNG that is nothing else; else Error with this hint.
struct GreyU16 {
    int width = 0, height = 0;        // px
    std::vector<std::uint16_t> data;  // [height][width]
};
GreyU16 decode_png16(std::span<const std::byte> file, const std::string& where,
                     const std::string& hint);

}  // namespace darb
