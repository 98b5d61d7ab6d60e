// SPDX-License-Identifier: MIT
// Held-out pictures of a comparison: where two kernels' errors differ most, the views and places
// that tell all methods apart, and small pictures inside pages.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/report/report.h"
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

/// A held-out view, as several methods draw it, and the square in it where they differ most.
struct TellingView {
    std::string view;
    int x = 0, y = 0, side = 0;  // px; side: as in Crop
    /// Standard deviation over the methods of their mean squared error in the square, values in
    /// [0, 1].
    double spread = 0;
    std::vector<double> square_error = {};  // [method] that error
};

/// The `most` views with the largest spread, that first, of those that every method has a picture
/// of; none with fewer than two methods.
std::vector<TellingView> telling_views(const std::vector<const ComparedAt*>& methods,
                                       std::size_t most);

/// Whole pictures of all methods beside the photo with the square that tells them apart, and crops
/// of every kernel against the Gaussian; from the first run of each method. Writes pictures for the
/// paper, too.
void add_pictures(const Comparison& comparison, const ComparedDataset& dataset, Report& report);

// Small pictures inside HTML pages: fields of numbers as images, and rows of them with captions.

/// value(x, y) at pixels [0, size)^2 as grey, from 0 (black) to `white` (white).
ImageU8 grey_field(int size, double white, const std::function<double(int, int)>& value);
/// value(x, y) in blue (below 0), white (0) and red (above 0), saturated at +-limit.
ImageU8 signed_field(int size, double limit, const std::function<double(int, int)>& value);

struct Captioned {
    ImageU8 picture;
    std::string caption;    // text
    bool is_large = false;  // a whole picture: smoothed, and as JPEG
};

/// The pictures side by side, each scaled to width_px; small ones without smoothing.
std::string html_pictures(const std::vector<Captioned>& pictures, int width_px);

}  // namespace darb
