// SPDX-License-Identifier: MIT
// Subject: what a scene is looked at for. It defines what a view orbits around, how fast it flies,
// and what "Frame all" and a turntable show, in the viewer, in films and on web pages.
#pragma once

#include <optional>
#include <span>
#include <string>
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
    /// The cameras stand in the middle and look outwards, as in a room or a panorama; the centre is
    /// where they stand.
    bool around = false;
};

/// With cameras: the point nearest to their viewing axes by least squares. Axes that pass far from
/// it lose their weight, and so do cameras that see nothing. Along directions that the axes leave
/// open, as where all cameras look the same way, the depth of the splats that they see decides. The
/// radius covers what the frames hold at that depth and how far apart the cameras' axes pass, but
/// is no larger than the splats reach. Where cameras look away from each other, there is no such
/// point: `around` is set if they look to all sides, else the centre is the middle of what they
/// see. Without cameras: see dense_bounds.
Subject subject_of(const SplatModel& model, std::span<const Camera> cameras = {});

/// Where the opacity of a scene is. Splats farther than 2.5 times the median distance from the
/// median are left out, again and again until none is, which removes background and strays. The
/// centre is the middle between the 2 % and 98 % quantiles of the rest, and the radius holds 98
/// % of it. Opacities below 0.1 count only where there is nothing else. At most 100,000 evenly
/// chosen splats are considered.
Bounds dense_bounds(const SplatModel& model);

/// How far ahead of the camera the point is that its view turns around: where its axis comes
/// nearest to the subject, if that is ahead and in the picture; else the median depth of the
/// part of the model that it sees; else the subject's radius.
double pivot_depth(const Subject& subject, const SplatModel& model, const Camera& camera);

/// The median depth of the first surface in the middle of the picture, along the axis, world units;
/// nothing where there is none. At most 20,000 evenly chosen splats are considered.
std::optional<double> seen_depth(const SplatModel& model, const Camera& camera);

/// Which way is up, judged by how the cameras were held: opposite to the mean of their down axes
/// or, where these cancel out, as in a map flown to and fro, opposite to their mean viewing
/// direction. Nothing where neither tells.
std::optional<glm::dvec3> up_of_cameras(std::span<const Camera> cameras);

/// The unit vector for x, -x, y, -y, z or -z. Throws Error for other names.
glm::dvec3 up_from_name(const std::string& name);

// For scenes without cameras: which way is up, and from which side to look.

/// Guesses which way is up: -y, as in 3DGS, unless another end of an axis looks more like a foot,
/// because things that stand are wide where they stand. A foot is measured by opacity times area
/// within 3 % of the height, times how wide that is. y is up where its low end has 1.5 times the
/// foot of the high one; z where its low end has twice that of the three others. -z is never up,
/// because a wall behind the scene would look like a foot, too.
glm::dvec3 guess_up(const SplatModel& model);

/// The side from which a scene with this up (unit length) is first looked at: a unit vector across
/// `up`, from the middle to the eye, in world axes. It is a convention, -z, or -y where z is up: no
/// format states where the front is, and neither shape nor detail tells it from the back.
glm::dvec3 usual_front(const glm::dvec3& up);

// Cameras for a scene that has none.

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
