// Depth images as files: 16-bit grey PNG.
#pragma once

#include <cstddef>
#include <filesystem>

#include "engine/core/image.h"

namespace darb {

constexpr int kDepthSteps = 65535;

struct DepthRange {
    std::size_t clipped = 0;  // pixels beyond the last step
    double farthest = 0;      // world units
};

/// depth: first channel, world units, 0 where nothing is seen. One grey step is `unit` world units;
/// rounded, and kDepthSteps from there on. A tEXt chunk "DepthUnit" states the unit.
DepthRange write_depth_png(const std::filesystem::path& path, const ImageF& depth, double unit);

}  // namespace darb
