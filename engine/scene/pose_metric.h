// PoseMetric: the six numbers by which a camera is moved, in pixels. A pose changes by a turn and a
// move on its left, in the camera's frame:
//   rotation' = exp(turn) rotation,  translation' = exp(turn) translation + move.
// Turns and moves differ in unit and do nearly the same to a picture, so that steps of them one by
// one zigzag. In the coordinates here a step of 1 shifts the picture by 1 px (root of the mean
// square, at the points that the camera sees). Source: CamP, arXiv 2308.10902.
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
/// exp(v) as a rotation, and what turns its derivative into that of v: d exp(v) = [J dv] exp(v).
glm::dmat3 exp_rotation(const glm::dvec3& v);
glm::dmat3 left_jacobian(const glm::dvec3& v);

/// Of a pixel of the pinhole by turn and move, at p in the camera.
std::array<PoseVector, 2> pixel_by_pose(const Camera& camera, const glm::dvec3& p);

class PoseMetric {
  public:
    /// points: world; those before the camera and in its picture count. Where they are fewer than
    /// 20, places spread over the picture do, at about `depth` (world units).
    PoseMetric(const Camera& camera, std::span<const glm::dvec3> points, double depth);

    PoseVector to_step(const PoseVector& x) const;
    /// dL/dx from dL/d(step).
    PoseVector gradient(const PoseVector& d_step) const;
    /// x of a step.
    PoseVector from_step(const PoseVector& step) const;
    /// px: root of the mean square of what the step shifts, to first order.
    double shift_px(const PoseVector& step) const;

  private:
    using Matrix = std::array<PoseVector, 6>;
    Matrix square_{};  // mean over the points of J^T J
    Matrix lower_{};   // Cholesky factor of square_, damped: x = lower^T step
};

/// Steps of all cameras that only move, turn and scale the world as a whole change no picture, and
/// nothing holds them. This takes their share out of the steps (coordinates of the metrics).
class Gauge {
  public:
    Gauge(std::span<const Camera> cameras, std::span<const PoseMetric> metrics);
    void remove(std::span<PoseVector> x) const;

  private:
    std::vector<std::array<PoseVector, 7>> basis_;  // [camera], orthonormal over all cameras
};

}  // namespace darb
