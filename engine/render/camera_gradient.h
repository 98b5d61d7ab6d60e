// dL/d(camera): what the splats' shares of it, as the device leaves them, come to.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <span>

#include "engine/scene/camera.h"
#include "shaders/shared/optim_args.h"

namespace darb {

/// Of p_camera = rotation * p_world + translation, whose twelve numbers are each taken freely, and
/// of focal lengths and principal point; a lens keeps its own terms. A rotation has three degrees
/// of freedom: what counts is the part along them.
struct CameraGradient {
    glm::dmat3 d_rotation{0.0};  // as Camera::rotation: column, then row
    glm::dvec3 d_translation{0.0};
    double d_fx = 0, d_fy = 0, d_cx = 0, d_cy = 0;  // 1/px
};

/// Sums over the splats, as shaders/shared/optim_args.h orders them.
using CameraTotals = std::array<double, CAMERA_SUMS>;
CameraGradient camera_gradient(const Camera& camera, const CameraTotals& totals);

/// shares: [N][CAMERA_SHARES]. d_position: [N][3], whose sum is that of the centre,
/// negative. Added in double in the order of the splats.
CameraGradient camera_gradient(const Camera& camera, std::span<const float> shares,
                               std::span<const float> d_position);

}  // namespace darb
