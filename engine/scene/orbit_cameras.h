// SPDX-License-Identifier: MIT
// Cameras for a scene that has none.
#pragma once

#include <vector>

#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"
#include "engine/scene/subject.h"

namespace darb {

/// Where the opacity of a scene is: its median, and the radius that holds nine tenths of it, at
/// least 1e-6. World units, relative to SplatModel::origin. The model must have at least one splat.
struct SceneBall {
    glm::dvec3 centre{0.0};
    double radius = 1;
};
SceneBall opaque_ball(const SplatModel& model);

/// `count` cameras on a circle that look slightly down (y is down) at that ball, from far enough
/// away to have it in the picture. The model must have at least one splat.
std::vector<Camera> orbit_cameras(const SplatModel& model, int count, int width, int height);
/// As above, around the given ball, looking down from `up`, which has unit length; the first camera
/// looks from usual_front(up).
std::vector<Camera> orbit_cameras(const Bounds& ball, int count, int width, int height,
                                  const glm::dvec3& up);

}  // namespace darb
