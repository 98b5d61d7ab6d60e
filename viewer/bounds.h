// Bounds: the sphere that "frame all" shows.
#pragma once

#include <glm/glm.hpp>

#include "engine/scene/splat_model.h"

namespace darb {

struct Bounds {
    glm::dvec3 centre{0.0};  // world
    double radius = 1;       // world
};

/// Centre: the middle between the 2 % and 98 % quantiles of each coordinate; radius: that of 98 %
/// of the splats, at most 2.5 times that of half of them. Background far away and stray splats thus
/// do not shrink the scene to a dot. Splats of an opacity below 0.1 are left out where others
/// exist; at most 100,000 evenly chosen ones are looked at.
Bounds scene_bounds(const SplatModel& model);

}  // namespace darb
