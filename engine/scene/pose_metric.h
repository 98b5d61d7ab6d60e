// SPDX-License-Identifier: MIT
// PoseMetric: the six numbers by which a camera is moved, in pixels. A pose changes by a turn and a
// move on its left, in the camera's frame:
//   rotation' = exp(turn) rotation,  translation' = exp(turn) translation + move.
// Rotations and translations have different units, yet change a picture in nearly the same way, so
// that separate steps of them zigzag. In the coordinates used here, a step of 1 shifts the picture
// by 1 px (root mean square over the points that the camera sees). Source: CamP, arXiv 2308.10902.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "engine/scene/camera.h"

namespace darb {

using PoseVector = std::array<double, 6>;  // turn, rad; move, world units

/// The camera after a step.
Camera moved_camera(const Camera& camera, const PoseVector& step);
/// exp_rotation(v): exp(v) as a rotation. left_jacobian(v): J, such that d exp(v) = [J dv] exp(v).
glm::dmat3 exp_rotation(const glm::dvec3& v);
glm::dmat3 left_jacobian(const glm::dvec3& v);

/// The camera at a row's time, -1/2 to 1/2: as Camera::shutter says, and without a shutter itself.
Camera camera_at_row(const Camera& camera, double time);

/// Derivatives of a pinhole's pixel by turn and move, at the point p in camera space.
std::array<PoseVector, 2> pixel_by_pose(const Camera& camera, const glm::dvec3& p);

class PoseMetric {
  public:
    /// points: world; those before the camera and within its picture count. Where fewer than 20 do,
    /// places spread over the picture at about `depth` (world units) take their place.
    PoseMetric(const Camera& camera, std::span<const glm::dvec3> points, double depth);

    PoseVector to_step(const PoseVector& x) const;
    /// dL/dx from dL/d(step).
    PoseVector gradient(const PoseVector& d_step) const;
    /// The coordinates x of a step.
    PoseVector from_step(const PoseVector& step) const;
    /// Root mean square shift of the picture by a step, to first order, px.
    double shift_px(const PoseVector& step) const;

  private:
    using Matrix = std::array<PoseVector, 6>;
    Matrix square_{};  // mean of J^T J over the points
    Matrix lower_{};   // Cholesky factor of square_, damped: x = lower^T step
};

/// Removes from steps (in the metrics' coordinates) the part that moves, turns and scales the world
/// as a whole: such steps of all cameras change no picture, so nothing holds them back.
class Gauge {
  public:
    Gauge(std::span<const Camera> cameras, std::span<const PoseMetric> metrics);
    void remove(std::span<PoseVector> x) const;

  private:
    std::vector<std::array<PoseVector, 7>> basis_;  // [camera][7], orthonormal over all cameras
};

}  // namespace darb
