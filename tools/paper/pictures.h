// SPDX-License-Identifier: MIT
// Small pictures inside HTML pages: fields of numbers as images, and rows of them with captions.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "engine/core/image.h"

namespace darb {

/// value(x, y) at pixels [0, size)^2 as grey, from 0 (black) to `white` (white).
ImageU8 grey_field(int size, double white, const std::function<double(int, int)>& value);
/// value(x, y) in blue (below 0), white (0) and red (above 0), saturated at +-limit.
ImageU8 signed_field(int size, double limit, const std::function<double(int, int)>& value);

struct Captioned {
    ImageU8 picture;
    std::string caption;  // text
};

/// The pictures side by side, each scaled to width_px without smoothing.
std::string html_pictures(const std::vector<Captioned>& pictures, int width_px);

}  // namespace darb
