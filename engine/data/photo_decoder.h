// SPDX-License-Identifier: MIT
// What the decoders of PNG and JPEG share: the size that a file claims is checked before
// anything of that size is allocated. Photos come from strangers, so the decoding itself is left to
// libpng and libjpeg-turbo, which the distribution maintains.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/core/image.h"

namespace darb {

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
