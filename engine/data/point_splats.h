// Point clouds as splats: what a viewer opens a plain point-cloud PLY with.
#pragma once

#include <vector>

#include "engine/data/dataset.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// Mean squared distance of each point to its 3 nearest neighbours (fewer where there are fewer),
/// at least 1e-7. position: [P][3]. O(P log P).
std::vector<double> neighbour_distance2(const std::vector<double>& position);

/// A round Gaussian of opacity 0.95 a point, in its colour. Its standard deviation is a third of
/// the root of neighbour_distance2, at most four times the median of all, so that stray points stay
/// small.
SplatModel points_as_splats(const PointCloud& points);

}  // namespace darb
