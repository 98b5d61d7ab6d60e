// SPDX-License-Identifier: MIT
// Clutter that shows in the splats alone: parts of a scene that touch nothing else, and haze.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/scene/splat_model.h"

namespace darb {

/// [N], 1 for splats that are in the set.
using SplatSet = std::vector<std::uint8_t>;

/// How many splats are in the set.
std::size_t count_of(const SplatSet& set);

/// A scene divided into parts. Two splats are in one part where they touch, or where a chain of
/// splats that touch leads from one to the other.
struct SplatParts {
    std::vector<std::uint32_t> part;  // [N] number of the part
    std::vector<double> mass;         // [parts] sum of opacity times area, world^2
};

/// Two splats touch where the squared Mahalanobis distance of their means, under the sum of both
/// covariances, is at most 9, unless one is more than ten times as large as the other: a sky behind
/// a bird does not hold it. Splats that are never drawn are parts of their own without mass. Chains
/// of 5,000 splats or more are joined only through the nearest neighbours of their splats.
SplatParts parts_of_splats(const SplatModel& model);

/// The splats of parts with less than `least_share` of the mass of the heaviest part.
SplatSet isolated_splats(const SplatModel& model, double least_share);

/// The splats whose opacity is at most `opacity`, 0 to 1, and whose largest standard deviation is
/// at least `size` times the median of the scene.
SplatSet hazy_splats(const SplatModel& model, double opacity, double size);

/// The largest standard deviation of each splat, world units, [N].
std::vector<double> largest_deviations(const SplatModel& model);

}  // namespace darb
