// SPDX-License-Identifier: MIT
// FLIP, the difference that a viewer sees when two pictures alternate in one place, for pictures
// with values of 0 to 1 (LDR-FLIP; Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom, Fairchild
// 2020). It runs on the CPU.
#pragma once

#include "engine/core/image.h"

namespace darb {

/// That of a screen 0.7 m and 3,840 px wide, seen from 0.7 m away, which the paper assumes.
constexpr double kFlipPixelsPerDegree = 67.0206432765823;

/// The difference at each pixel, [height][width], 0 to 1. Both pictures must have the same size.
/// Values are sRGB and are clamped to [0, 1]. Of 4 channels only the first three count.
ImageF flip_map(const ImageF& image, const ImageF& truth,
                double pixels_per_degree = kFlipPixelsPerDegree);

/// The mean of the map: 0 for equal pictures, less is better.
double flip(const ImageF& image, const ImageF& truth,
            double pixels_per_degree = kFlipPixelsPerDegree);

}  // namespace darb
