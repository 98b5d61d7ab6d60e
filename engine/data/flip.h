// SPDX-License-Identifier: MIT
// FLIP, the difference that a viewer sees when two pictures alternate in one place, for pictures of
// 0 to 1 (LDR-FLIP; Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom, Fairchild 2020), on the
// CPU.
#pragma once

#include "engine/core/image.h"

namespace darb {

/// Of a 0.7 m wide screen of 3,840 px, 0.7 m away: what the paper takes.
constexpr double kFlipPixelsPerDegree = 67.0206432765823;

/// The difference at each pixel, [height][width], 0 to 1. Both pictures must have the same size;
/// values are sRGB and clamped to [0, 1]; of 4 channels the first three count.
ImageF flip_map(const ImageF& image, const ImageF& truth,
                double pixels_per_degree = kFlipPixelsPerDegree);

/// The mean of the map: 0 for equal pictures, less is better.
double flip(const ImageF& image, const ImageF& truth,
            double pixels_per_degree = kFlipPixelsPerDegree);

}  // namespace darb
