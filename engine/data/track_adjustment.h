// Poses and points from the tracks alone, no pixel looked at: bundle adjustment. Of cameras that
// come from elsewhere than from these tracks, or were changed since, it finds again what the tracks
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
    double before_px = 0, after_px = 0;  // median distance of points from where they were seen
    double median_move_px = 0;           // of the cameras that moved, see PoseMetric
};

/// Moves poses and points so that the points are drawn where photos saw them: Levenberg-Marquardt
/// over both, the points eliminated (Schur complement), the cameras' step by conjugate gradients;
/// Huber's loss beyond the median error. Held-out views take part: their pixels do not. Intrinsics
/// and points without a track stay. A view of fewer than 10 observations stays as well. Where the
/// median error does not fall to half, as from cameras that were found by these tracks, nothing is
/// changed. Damped steps begin where the cameras are, so that the scene as a whole, which
/// tracks do not hold, hardly moves.
TrackAdjustment adjust_to_tracks(Dataset& dataset);

// Where photos saw the points of a data set, in the pixels that its cameras have: what the tracks
// of a reconstruction say of the cameras.

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
