// SPDX-License-Identifier: MIT
// Bounds: the sphere that "frame all" shows.
#pragma once

#include <glm/glm.hpp>

#include "engine/scene/splat_model.h"
#include "engine/scene/subject.h"

namespace darb {

/// Centre: the middle between the 2 % and 98 % quantiles of each coordinate; radius: that of 98 %
/// of the splats, at most 2.5 times that of half of them. Background far away and stray splats thus
/// do not shrink the scene to a dot. Splats of an opacity below 0.1 are left out where others
/// exist; at most 100,000 evenly chosen ones are looked at.
Bounds scene_bounds(const SplatModel& model);

/// How far from the centre of the bounds an eye must be, looking along the third of `axes` (right,
/// down, forward), for a view that is 2 tan_x by 2 tan_y wide at distance 1 to show all but 0.05 %
/// of the splats within 1.35 radii, each to 1.5 standard deviations. 0 where there are none.
double framing_distance(const SplatModel& model, const Bounds& bounds, const glm::dmat3& axes,
                        double tan_x, double tan_y);

/// The near plane to look at a scene from outside with, world units: that of training, which does
/// not see what is nearer: such splats hang before the training cameras, and a nearer plane would
/// show them. Less only where a scene is so small that it is looked at from nearer.
float near_plane_for(const Bounds& bounds);

}  // namespace darb
