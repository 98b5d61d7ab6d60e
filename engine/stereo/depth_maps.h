// Depth and slope of the surface in each pixel of each photo, by PatchMatch on the device
// (shaders/stereo): planes are drawn, kept where the photos agree, and passed on to neighbours.
#pragma once

#include <vector>

#include "engine/gpu/device.h"
#include "engine/stereo/stereo_photos.h"
#include "shaders/shared/stereo_args.h"

namespace darb {

/// Of a photo, [H][W] of four: inverse depth v (1 / world unit) at the pixel's centre, dv/dx and
/// dv/dy (per px), cost (1 - correlation, STEREO_NO_COST where nothing was found).
using PlaneMap = ImageF;

/// The sources of a photo as the passes read them, for greys in one buffer behind its own.
std::vector<gpu::StereoSource> stereo_sources(const std::vector<StereoPhoto>& photos,
                                              std::size_t reference);

/// One map a photo, the same on every run. Those without sources have no plane.
std::vector<PlaneMap> plane_maps(Device& device, const std::vector<StereoPhoto>& photos,
                                 std::uint64_t seed);

}  // namespace darb
