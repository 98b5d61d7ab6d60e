// SPDX-License-Identifier: MIT
// Guides: what is drawn over the picture to find one's way: a grid on the ground, the axes in the
// corner, the cameras of the photos, and which of these a pointer hits. No device.
#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/scene/camera.h"
#include "engine/scene/subject.h"

namespace darb {

/// Which guides are shown, and what was found out for them.
struct GuideState {
    bool grid = false, axes = true, cameras = false;
    int version = -1;             // Edit::model_version for which `ground` was found
    const void* scene = nullptr;  // for which it was found
    glm::dvec3 up{0.0};           // for which it was found
    double ground = 0;            // height of the ground along `up`, world units
    double camera_size = 0;       // depth to which cameras are drawn, world units; 0: not found yet
    std::size_t cameras_measured = 0;  // how many cameras that was found for
};

enum class Side { front, right, top };
/// The direction from which a scene with this up is seen from its front, its right or above, a unit
/// vector away from it: an axis of the file. The front is -z, or -y where z is up.
glm::dvec3 side_of(const glm::dvec3& up, Side side);

using Segment = std::array<glm::dvec3, 2>;

/// Where the ground is along `up`: below it are 2 % of the splats that are within 1.5 radii of the
/// subject. At most 20,000 evenly chosen splats are looked at; without any, a radius below the
/// centre.
double ground_height(const SplatModel& model, const Bounds& subject, const glm::dvec3& up);

struct GroundGrid {
    std::vector<Segment> lines;
    double step = 0;  // between two lines, world units
};
/// A grid on the ground around the subject, to 1.5 radii. The step is 1, 2 or 5 times a power of
/// ten, so that 10 to 25 cells lie along a side; in metres where metres_per_unit is above 0.
GroundGrid ground_grid(const Bounds& subject, const glm::dvec3& up, double height,
                       double metres_per_unit);

/// A direction of the axes in the corner, as it is seen.
struct AxisBall {
    int axis = 0;            // of the file
    bool positive = true;    // its positive end, which has a letter
    glm::dvec2 centre{0.0};  // px
    double depth = 0;        // along the view, -1 (near) to 1
};
inline constexpr double kAxisReach = 40, kAxisBall = 10;  // px at scale 1: length, radius of a ball
/// The six ends around `centre`, the farthest first, as they are to be drawn.
std::array<AxisBall, 6> axis_balls(const glm::dmat3& rotation, const glm::dvec2& centre,
                                   double scale);
/// The nearest of the balls under the pointer.
std::optional<AxisBall> axis_at(const std::array<AxisBall, 6>& balls, const glm::dvec2& px,
                                double scale);
/// The direction, away from the scene, from which it is seen after a click on a ball.
glm::dvec3 direction_of(const AxisBall& ball);

/// The eye of a camera and the corners of its picture at a depth, world.
struct Frustum {
    glm::dvec3 eye{0.0};
    std::array<glm::dvec3, 4> corners{};
};
Frustum frustum_of(const Camera& camera, double depth);
/// A depth at which frusta of these cameras do not cover each other: 0.4 of the median distance
/// to the nearest other one, at most an eighth of the radius; a tenth of the radius for one camera.
double frustum_depth(std::span<const View> views, double radius);
/// The camera whose frustum is nearest to a pixel, within 10 px at scale 1; nothing beyond that.
/// The pictures of frusta count as a whole, where no other's line is that near.
std::optional<int> camera_at(std::span<const View> views, double depth, const Camera& seen_by,
                             const glm::dvec2& px, double scale);

/// The part of a line before the camera, in pixels.
std::optional<std::array<glm::dvec2, 2>> pixels_of(const Camera& camera, const Segment& line);

/// A bar that says which colour means what.
struct ColourBar {
    std::string title;          // with the unit
    std::string low, high;      // at its ends
    bool light_is_low = false;  // the colours run the other way
};

/// Depths that the depth view tells apart, along the view: those of the sphere, 1.5 radii around.
std::array<double, 2> depth_range(const Camera& camera, const Bounds& bounds);

}  // namespace darb
