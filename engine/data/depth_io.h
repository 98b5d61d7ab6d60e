// Depth images as files: 16-bit grey PNG, and NumPy arrays.
#pragma once

#include <filesystem>

#include "engine/core/image.h"

namespace darb {

/// depth: first channel, world units, 0 where nothing is seen. One grey step is `unit` world units;
/// rounded, and 65535 from there on. A tEXt chunk "DepthUnit" states the unit.
void write_depth_png(const std::filesystem::path& path, const ImageF& depth, double unit);

/// The first channel as float32 [H][W], little-endian, format 1.0 of NumPy.
void write_npy(const std::filesystem::path& path, const ImageF& image);

}  // namespace darb
