// SPDX-License-Identifier: MIT
// Writes a small COLMAP model: cameras.bin, images.bin and points3D.bin, as COLMAP and common
// trainers read them. Used by scene generators and tests.
#pragma once

#include <filesystem>
#include <vector>

#include "engine/data/dataset.h"

namespace darb {

/// folder: made where missing (for a data set at D, pass D/sparse/0; photos go to D/images/NAME).
/// Each view's camera is written as a PINHOLE at its own size, and the view's name as the image's
/// name; equal intrinsics share one camera. Observations and tracks are empty. Throws Error as
/// write_file_atomic does.
void write_colmap_binary(const std::filesystem::path& folder, const std::vector<View>& views,
                         const PointCloud& points);

}  // namespace darb
