// Points on surfaces: where the depths of several photos agree, at distances of a few pixels.
#pragma once

#include "engine/stereo/depth_maps.h"

namespace darb {

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
