// Points on surfaces: where the depths of several photos agree, at distances of a few pixels.
#pragma once

#include <vector>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "shaders/shared/stereo_args.h"

namespace darb {

struct StereoPhoto {
    std::size_t view = 0;                // of the data set
    Camera camera;                       // at the size of grey
    ImageF grey;                         // in [0, 1]; below 0: no photo, or nothing that is opaque
    ImageU8 rgba;                        // at the same size
    double near = 0, far = 0;            // depths, world units
    std::vector<std::uint32_t> sources;  // of the photos beside it, the best first
};

struct StereoOptions {
    int longest_side = 400;  // px, of the photos as they are compared; smaller ones stay
    std::uint32_t sources = 4;
};

/// photos: as load_photos gives them, of every view. Views that are held out, or have a lens before
/// them, are left out. Sources: where most of what the photo shows is seen under angles of about 12
/// degrees, none where no other photo shows it. Depths: of the points that the view sees, with a
/// margin; without points through region_in_view.
std::vector<StereoPhoto> stereo_photos(const Dataset& dataset, const std::vector<ImageU8>& photos,
                                       const StereoOptions& options);

// Depth and slope of the surface in each pixel of each photo, by PatchMatch on the device
// (shaders/stereo): planes are drawn, kept where the photos agree, and passed on to neighbours.

/// Of a photo, [H][W] of four: inverse depth v (1 / world unit) at the pixel's centre, dv/dx and
/// dv/dy (per px), cost (1 - correlation, STEREO_NO_COST where nothing was found).
using PlaneMap = ImageF;

/// The sources of a photo as the passes read them, for greys in one buffer behind its own.
std::vector<gpu::StereoSource> stereo_sources(const std::vector<StereoPhoto>& photos,
                                              std::size_t reference);

/// One map a photo, the same on every run. Those without sources have no plane.
std::vector<PlaneMap> plane_maps(Device& device, const std::vector<StereoPhoto>& photos,
                                 std::uint64_t seed);

struct FusionOptions {
    float most_cost = 0.5f;    // 1 - correlation
    double most_apart = 0.01;  // of depths, as a share
    double most_apart_px = 1;  // of the way there and back
    int least_agreeing = 2;    // other photos; one where only one was compared
    double spacing_px = 2.5;   // of the points on the surface as a photo shows it
};

struct SurfacePoints {
    PointCloud points;                        // with normal and spacing
    std::vector<ImageU8> consistent;          // [H][W] of a photo: 255 where other photos agree
    std::size_t agreeing = 0, looked_at = 0;  // pixels of all photos
};

SurfacePoints surface_points(const std::vector<StereoPhoto>& photos,
                             const std::vector<PlaneMap>& maps, const FusionOptions& options);

}  // namespace darb
