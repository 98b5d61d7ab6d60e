// SPDX-License-Identifier: MIT
// Depth images: written as 16-bit grey PNG; read from PNG, .npy and TIFF.
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
/// values are rounded, and limited to kDepthSteps. A tEXt chunk "DepthUnit" states the unit.
DepthRange write_depth_png(const std::filesystem::path& path, const ImageF& depth, double unit);

constexpr double kMillimetre = 0.001;  // m

/// Reads measured depths [H][W], metres along the optical axis; 0 where nothing was measured, which
/// includes NaN, infinite and negative values in the file. unit: metres a step; 0: as the type
/// says, 0.001 for integers (16-bit grey PNG, some .npy and TIFF) and 1 for floats (.npy and TIFF).
/// of_integers: `unit` applies to integers only, and floats are metres in any case. Throws Error
/// naming the file where it has another type, or holds no measured depth.
ImageF read_depth(const std::filesystem::path& path, double unit = 0, bool of_integers = false);

}  // namespace darb
