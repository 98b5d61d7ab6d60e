// Where photos saw the points of a data set, in the pixels that its cameras have: what the tracks
// of a reconstruction say of the cameras.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "engine/data/dataset.h"

namespace darb {

struct TrackObservation {
    std::uint32_t view = 0, point = 0;  // of Dataset::views and Dataset::points
    glm::dvec2 at_px{0.0};              // of the view's camera without its lens
};

/// In the order of the points. Points that fewer than `fewest` views saw are left out; where there
/// are more than `most` observations, all of a point's are or are not there, points evenly.
std::vector<TrackObservation> track_observations(const Dataset& dataset, std::size_t fewest = 2,
                                                 std::size_t most = 400'000);

/// The pinhole's pixel; NaN behind the camera.
glm::dvec2 pinhole_pixel(const Camera& camera, const glm::dvec3& world);

/// Median distance of what was seen from where the points are drawn, px; 0 without observations.
double median_track_error_px(const Dataset& dataset,
                             const std::vector<TrackObservation>& observations);

}  // namespace darb
