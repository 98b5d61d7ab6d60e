// SPDX-License-Identifier: MIT
// Finds where the pictures of two kernels differ most in their error against the photo, in both
// directions.
#pragma once

#include <string>
#include <vector>

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

}  // namespace darb
