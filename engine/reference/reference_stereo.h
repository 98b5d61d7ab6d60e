// SPDX-License-Identifier: MIT
// The cost of a plane at a pixel in stereo, in double: the truth for shaders/stereo. It uses rays
// and planes in the world where the shader has homographies.
#pragma once

#include "engine/core/image.h"
#include "engine/scene/camera.h"

namespace darb::reference {

struct StereoView {
    const Camera& camera;
    const ImageF& grey;  // [H][W], below 0: no photo
};

/// 1 - weighted correlation of the window around pixel (x, y) of `from` with the place in `to` to
/// which a plane maps it. The plane is given by its inverse depth v (1 / world unit) at the pixel's
/// centre and its slope (per px). 2 where `to` shows less than half of the window, or either shows
/// nothing in it.
double stereo_cost(const StereoView& from, const StereoView& to, int x, int y, double v,
                   double slope_x, double slope_y);

}  // namespace darb::reference
