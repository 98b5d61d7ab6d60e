// SPDX-License-Identifier: MIT
// Compares images with each other, and with those of the reference.
#pragma once

#include <algorithm>
#include <cstdlib>

#include "engine/core/image.h"

namespace darb::test {

inline Image<double> widened(const ImageF& image) {
    Image<double> wide(image.width, image.height, image.channels);
    wide.data.assign(image.data.begin(), image.data.end());
    return wide;
}

/// The largest difference of two values; 256 where the sizes differ.
inline int largest_difference(const ImageU8& a, const ImageU8& b) {
    if (a.width != b.width || a.data.size() != b.data.size()) return 256;
    int largest = 0;
    for (std::size_t i = 0; i < a.data.size(); ++i)
        largest = std::max(largest, std::abs(int(a.data[i]) - int(b.data[i])));
    return largest;
}

}  // namespace darb::test
