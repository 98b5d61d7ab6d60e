// SPDX-License-Identifier: MIT
// Bundle adjustment: refines poses and points from the tracks alone, without looking at pixels.
// Where cameras do not come from these tracks, or were changed since, it recovers what the tracks
// say.
// Source: Triggs et al., Bundle Adjustment - A Modern Synthesis, 2000.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "engine/data/dataset.h"

namespace darb {

struct TrackAdjustment {
    bool adjusted = false;  // false: nothing was changed
    std::size_t views = 0, points = 0, observations = 0;
    double before_px = 0,
           after_px = 0;        // median distance of projected points from tracks
    double median_move_px = 0;  // median move of the cameras that moved, px; see PoseMetric
};

/// Moves poses and points so that points project to where the photos saw them: Levenberg-Marquardt
/// over both, with the points eliminated (Schur complement), the cameras' step by conjugate
/// gradients, and Huber's loss beyond the median error. Held-out views take part, although their
/// pixels never do. Intrinsics, points without a track, and views with fewer than 10 observations
/// stay as they are. Where the median error does not fall to half, as with cameras that come from
/// these very tracks, nothing is changed. The steps are damped and start from the given cameras, so
/// that the scene as a whole, whose place tracks do not determine, hardly moves.
TrackAdjustment adjust_to_tracks(Dataset& dataset);

// Where the photos saw the points of a data set, in pixels of its cameras.

struct TrackObservation {
    std::uint32_t view = 0, point = 0;  // indices into Dataset::views and Dataset::points
    glm::dvec2 at_px{0.0};              // in the view's camera without its lens
};

/// In the order of the points. Points that fewer than `fewest` views saw are left out. Where there
/// are more than `most` observations, points are picked evenly, each with all of its observations.
std::vector<TrackObservation> track_observations(const Dataset& dataset, std::size_t fewest = 2,
                                                 std::size_t most = 400'000);

/// Where the camera, as a pinhole, sees the point, px; NaN behind the camera.
glm::dvec2 pinhole_pixel(const Camera& camera, const glm::dvec3& world);

/// Median distance between the observations and the projected points, px; 0 without observations.
double median_track_error_px(const Dataset& dataset,
                             const std::vector<TrackObservation>& observations);

}  // namespace darb
