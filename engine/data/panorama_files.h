// SPDX-License-Identifier: MIT
// What tells that a file holds a panorama: XMP in a photo, and a box in an MP4.
// Sources: Google's Photo Sphere XMP metadata (GPano) and its Spherical Video V1, as published.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "engine/core/image.h"

namespace darb {

/// A PNG of a whole panorama with the GPano words that viewers look for. image: 1, 3 or 4 channels,
/// twice as wide as high.
std::vector<std::byte> encode_panorama_png(const ImageU8& image);
void write_panorama_png(const std::filesystem::path& path, const ImageU8& image);

/// Whether a photo says in its XMP that it is equirectangular. head: its first bytes, or all.
bool is_marked_panorama(std::span<const std::byte> head);

/// Whether an MP4 or MOV says that its frames are equirectangular, as spherical video of either
/// version. False where the file is none, or is damaged.
bool is_marked_panorama_video(const std::filesystem::path& path);

/// Marks the first video track of an MP4 as an equirectangular one, in place. The file is as ffmpeg
/// writes it, with its index behind the pictures. Throws Error naming the file where it is not
/// such a file or cannot be written.
void mark_panorama_video(const std::filesystem::path& path);

}  // namespace darb
