// Which way is up, and from which side to look, of a scene that comes without cameras.
#pragma once

#include "engine/scene/splat_model.h"

namespace darb {

/// A guess which way is up: -y, as 3DGS has it, but where another end looks like a foot: opacity
/// times area within 3 % of the height, times how wide that is. What stands is wide where it
/// stands. y is up where its low end has 1.5 times the foot of the high one; z where its low end
/// has twice that of the three others. -z never is: a wall behind the scene would be a foot, too.
glm::dvec3 guess_up(const SplatModel& model);

/// The side from which a scene of this up, of unit length, is looked at first: unit, world, across
/// `up`, from the middle to the eye. It is a convention, -z, or -y where z is up: no format says
/// where the front is, and neither shape nor detail tells it from the back.
glm::dvec3 usual_front(const glm::dvec3& up);

}  // namespace darb
