// SPDX-License-Identifier: MIT
// Bounds: the sphere that "frame all" shows.
#pragma once

#include <glm/glm.hpp>

#include "engine/scene/splat_model.h"
#include "engine/scene/subject.h"

namespace darb {

/// The centre is the middle between the 2 % and 98 % quantiles of each coordinate. The radius holds
/// 98 % of the splats, but is at most 2.5 times the radius that holds half of them, so that a
/// background far away and stray splats do not shrink the scene to a dot. Splats with an opacity
/// below 0.1 are left out where there are others. At most 100,000 evenly chosen splats are looked
/// at.
Bounds scene_bounds(const SplatModel& model);

/// How far from the centre of the bounds an eye must be so that a view which is 2 tan_x by 2 tan_y
/// wide at distance 1 shows all but 0.05 % of the splats within 1.35 radii, each out to 1.5
/// standard deviations. The eye looks along the third of `axes` (right, down, forward). 0 where
/// there are no such splats.
double framing_distance(const SplatModel& model, const Bounds& bounds, const glm::dmat3& axes,
                        double tan_x, double tan_y);

/// The near plane for looking at a scene from outside, in world units. It is the one of training,
/// which does not see what is nearer: such splats hang before the training cameras, and a nearer
/// plane would show them. It is nearer only for a scene so small that one looks at it from a
/// shorter distance.
float near_plane_for(const Bounds& bounds);

}  // namespace darb
