// Which splats of a scene matter most to its pictures: what is drawn while the camera moves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/scene/splat_model.h"
#include "viewer/bounds.h"

namespace darb {

/// The most splats that are kept in this order; more are too slow for motion where all are.
inline constexpr std::size_t kMostMoving = 400'000;

/// Indices of the `count` splats with the largest opacity times area of their two longer axes, most
/// important first; the area is divided by the squared distance to the scene's middle where that is
/// beyond its radius, so that a far background does not take all. count: at most model.size().
std::vector<std::uint32_t> most_important(const SplatModel& model, const Bounds& bounds,
                                          std::size_t count);

}  // namespace darb
