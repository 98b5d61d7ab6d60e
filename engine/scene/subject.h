// Subject: what a scene is looked at for. The one definition of what a view orbits around, how fast
// it flies, what "Frame all" and a turntable show, in the viewer, in films and in web pages.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// A ball around what is worth seeing.
struct Bounds {
    glm::dvec3 centre{0.0};  // world
    double radius = 1;       // world
};

/// The smallest ball around both.
Bounds enclosing(const Bounds& a, const Bounds& b);

struct Subject : Bounds {
    /// The cameras stand in the middle of it and look outwards, as in a room or a panorama: the
    /// centre is where they stand.
    bool around = false;
};

/// With cameras: the point nearest to their viewing axes by least squares. Axes that pass far from
/// it lose their weight, and so do cameras that see nothing. Along directions that the axes leave
/// open, as where all look the same way, the depth of the splats that they see decides. The radius
/// is what the frames hold at that depth and how far the cameras look beside each other, and no
/// more than the splats reach. Where cameras look away from each other there is no such point:
/// `around` is set where they look to all sides, else the centre is the middle of what they see.
/// Without cameras: what is dense, see dense_bounds.
Subject subject_of(const SplatModel& model, std::span<const Camera> cameras = {});

/// Where the opacity of a scene is. Splats farther than 2.5 times the median distance from the
/// median of the rest are left out, again and again until none is, and with them background and
/// strays. The centre is the middle between the 2 % and 98 % quantiles of what stays, which the
/// radius then holds to 98 %. Opacities below 0.1 count only where there is nothing else; at most
/// 100,000 evenly chosen splats are looked at.
Bounds dense_bounds(const SplatModel& model);

/// How far ahead of the camera the point is that its view turns around: where its axis comes
/// nearest to the subject, if that is ahead and in the picture; else the median depth of what it
/// sees of the model, and the subject's radius where it sees nothing.
double pivot_depth(const Subject& subject, const SplatModel& model, const Camera& camera);

/// The median depth of the first surface in the middle of the picture, along the axis, world units;
/// nothing where there is none. At most 20,000 evenly chosen splats are looked at.
std::optional<double> seen_depth(const SplatModel& model, const Camera& camera);

/// Which way is up by how cameras were held: against the mean of their down, and against the mean
/// of their view where those cancel, as of a map flown to and fro. Nothing where neither says it.
std::optional<glm::dvec3> up_of_cameras(std::span<const Camera> cameras);

// Which way is up, and from which side to look, of a scene that comes without cameras.

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
