// Depth images as files: 16-bit grey PNG, and to read .npy and TIFF as well.
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

constexpr double kMillimetre = 0.001;  // m

/// Measured depths [H][W], metres along the optical axis; 0 where nothing was measured, as where
/// the file has 0, NaN, infinity or less than 0. unit: metres a step; 0: what the type says, 0.001
/// of integers, which are 16-bit grey PNG and some .npy and TIFF, 1 of .npy and TIFF of floats.
/// of_integers: the unit is that of integers, and floats are metres in any case. Throws Error
/// naming the file where it is of another type, or has no measured depth.
ImageF read_depth(const std::filesystem::path& path, double unit = 0, bool of_integers = false);

}  // namespace darb
