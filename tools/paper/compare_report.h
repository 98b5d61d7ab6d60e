// Where two kernels' pictures differ most in how far they are from the photo, in both directions.
#pragma once

#include <string>
#include <vector>

#include "tools/paper/compare_runs.h"

namespace darb {

struct Crop {
    std::string view;
    int x = 0, y = 0, side = 0;  // px
    double gain = 0;  // mean squared error of the first less that of the second, of values 0 to 1
    ImageU8 photo, first, second;  // [side][side][3]
};

/// The square of the largest gain of the second and that of the largest loss, over all views that
/// both have; in that order; empty where there are no pictures. side: a quarter of the picture's
/// shorter side, but at least 24 px where it has them.
std::vector<Crop> crops_of(const ComparedAt& first, const ComparedAt& second);

}  // namespace darb
