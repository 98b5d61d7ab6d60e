// SPDX-License-Identifier: MIT
// Points on surfaces: places where the depths in several photos agree, a few pixels apart.
#pragma once

#include <vector>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "shaders/shared/stereo_args.h"

namespace darb {

struct StereoPhoto {
    std::size_t view = 0;                // index in the data set
    Camera camera;                       // at the size of `grey`
    ImageF grey;                         // in [0, 1]; below 0: no photo, or nothing opaque
    ImageU8 rgba;                        // at the same size
    double near = 0, far = 0;            // range of depths, world units
    std::vector<std::uint32_t> sources;  // indices of photos to compare with, the best first
};

struct StereoOptions {
    int longest_side = 400;  // photos are compared at this size, px; smaller ones stay
    std::uint32_t sources = 4;
};

/// photos: as load_photos gives them, one per view. Held-out views and those with a lens are left
/// out. Sources are photos that show most of what the photo shows, from angles of about 12 degrees;
/// there are none where no other photo shows it. Depths range over those of the points that the
/// view sees, with a margin; without points, over region_in_view.
std::vector<StereoPhoto> stereo_photos(const Dataset& dataset, const std::vector<ImageU8>& photos,
                                       const StereoOptions& options);

// Finds depth and slope of the surface at each pixel of each photo, by PatchMatch on the device
// (shaders/stereo): planes are drawn at random, kept where the photos agree, and passed on to
// neighbours.

/// One per photo, [H][W][4]: inverse depth v (1 / world unit) at the pixel's centre, dv/dx and
/// dv/dy (per px), and cost (1 - correlation; STEREO_NO_COST where nothing was found).
using PlaneMap = ImageF;

/// The sources of a photo as the passes read them, with their greys after its own in one buffer.
std::vector<gpu::StereoSource> stereo_sources(const std::vector<StereoPhoto>& photos,
                                              std::size_t reference);

/// One map per photo, identical in every run. Photos without sources have no planes.
std::vector<PlaneMap> plane_maps(Device& device, const std::vector<StereoPhoto>& photos,
                                 std::uint64_t seed);

struct FusionOptions {
    float most_cost = 0.5f;    // 1 - correlation
    double most_apart = 0.01;  // largest difference of depths, as a share
    double most_apart_px = 1;  // largest error after mapping a pixel there and back
    int least_agreeing = 2;    // other photos that must agree; one where only one was compared
    double spacing_px = 2.5;   // between points on the surface, as a photo shows it
};

struct SurfacePoints {
    PointCloud points;                        // with normal and spacing
    std::vector<ImageU8> consistent;          // [H][W] per photo: 255 where other photos agree
    std::size_t agreeing = 0, looked_at = 0;  // numbers of pixels, over all photos
};

SurfacePoints surface_points(const std::vector<StereoPhoto>& photos,
                             const std::vector<PlaneMap>& maps, const FusionOptions& options);

}  // namespace darb
