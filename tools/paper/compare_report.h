// SPDX-License-Identifier: MIT
// Finds where the pictures of two kernels differ most in their error against the photo, in both
// directions.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/ranks/ranks.h"
#include "tools/paper/compare_runs.h"

namespace darb {

struct Crop {
    std::string view;
    int x = 0, y = 0, side = 0;  // px
    double gain = 0;  // mean squared error of the first minus that of the second, values in [0, 1]
    ImageU8 photo, first, second;  // [side][side][3]
};

/// The square in which the second gains most, then that in which it loses most, over all views that
/// both have; empty where there are no pictures. side: a quarter of the picture's shorter side, but
/// at least 24 px if the picture is that large.
std::vector<Crop> crops_of(const ComparedAt& first, const ComparedAt& second);

// Sends finished runs from one rank to another.

/// Every field, including infinite and missing numbers; can be read only by the same version of
/// darb.
Bytes bytes_of_runs(const std::vector<ComparedRun>& runs);
std::vector<ComparedRun> runs_of_bytes(std::span<const std::byte> bytes);

/// The runs of all ranks in the order of their items: see turn_of. Where a rank ended early, its
/// later items are missing.
std::vector<ComparedRun> runs_of_all(Ranks& ranks, const std::vector<ComparedRun>& own,
                                     std::size_t items);

// Small pictures inside HTML pages: fields of numbers as images, and rows of them with captions.

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
