// Cameras for a scene that comes without any.
#pragma once

#include <vector>

#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"
#include "engine/scene/subject.h"

namespace darb {

/// Where the opacity of a scene is: its median, and the radius that holds nine tenths of it, at
/// least 1e-6. World coordinates from SplatModel::origin. For models with at least one splat.
struct SceneBall {
    glm::dvec3 centre{0.0};
    double radius = 1;
};
SceneBall opaque_ball(const SplatModel& model);

/// `count` cameras on a circle that look slightly down (y is down) at that ball, far enough for it
/// to be in the picture. For models with at least one splat.
std::vector<Camera> orbit_cameras(const SplatModel& model, int count, int width, int height);
/// The same around a ball, looking down from `up`, of unit length; the first from usual_front(up).
std::vector<Camera> orbit_cameras(const Bounds& ball, int count, int width, int height,
                                  const glm::dvec3& up);

}  // namespace darb
