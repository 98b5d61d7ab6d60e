// Depth images as files: 16-bit grey PNG.
#pragma once

#include <filesystem>

#include "engine/core/image.h"

namespace darb {

/// depth: first channel, world units, 0 where nothing is seen. One grey step is `unit` world units;
/// rounded, and 65535 from there on. A tEXt chunk "DepthUnit" states the unit.
void write_depth_png(const std::filesystem::path& path, const ImageF& depth, double unit);

}  // namespace darb
