// SPDX-License-Identifier: MIT
// Depths of surfaces in double: what a pixel's splats leave of the light up to a depth, by each
// reading of a splat, and the depth at which a share of it is left (docs/math.md).
#pragma once

#include <optional>
#include <vector>

#include "engine/reference/blend.h"

namespace darb::reference {

/// The first three as DEPTH_READING_*. line: (1 - alpha)^F, F the share of the slice's integral
/// before the depth, which a ray through a cloud of this density would see.
enum class Reading { front, solid, plane, line };

/// A splat on the ray of a pixel.
struct RaySlice {
    double alpha = 0;                // as the picture has it
    double strength = 0;             // alpha / w(q)
    double q = 0, reach = 0;         // squared distance of the pixel; where the splat ends
    double mean = 0, deviation = 0;  // of the depth, world units
    double exponent = 0;
};

/// The splats that the picture draws at pixel (x, y), nearest first, up to where it stops.
std::vector<RaySlice> ray_slices(const TileLists& lists,
                                 const std::vector<ProjectedSplat<double>>& splats, int x, int y,
                                 const KernelTable& kernel, const RenderSettings& settings);

/// What they leave of the light up to depth z.
double light_left(const std::vector<RaySlice>& slices, double z, Reading reading,
                  const KernelTable& kernel, const RenderSettings& settings);

/// The least depth at or behind the near plane at which `level` or less is left; nothing where the
/// pixel ends above it.
std::optional<double> depth_at_level(const std::vector<RaySlice>& slices, Reading reading,
                                     const KernelTable& kernel, const RenderSettings& settings,
                                     double level = 0.5);

}  // namespace darb::reference
