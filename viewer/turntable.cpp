#include "viewer/turntable.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "viewer/bounds.h"

namespace darb {

namespace {

constexpr double kAbove = glm::radians(15.0);
constexpr double kFilledByTurn = 0.94;  // of the picture
constexpr int kSides = 24;              // from which the distance is chosen

}  // namespace

CameraPath turntable(const SplatModel& model, const TurntableOptions& options) {
    const Bounds bounds = scene_bounds(model);
    Navigation view;
    view.set_up(options.up);
    view.level();
    view.orbit(0, kAbove);
    const double tan_y = kFilledByTurn * std::tan(view.fov_y / 2);
    const double tan_x = tan_y * options.width / options.height;
    double distance = 0;
    for (int side = 0; side < kSides; ++side) {
        distance = std::max(distance, framing_distance(model, bounds, view.axes, tan_x, tan_y));
        view.orbit(2 * glm::pi<double>() / kSides, 0);
    }
    if (!(distance > 0)) distance = bounds.radius / std::sin(view.fov_y / 2);
    const int frames = std::max(1, static_cast<int>(std::lround(options.seconds * options.fps)));
    const Navigation start = view;
    CameraPath path;
    for (int frame = 0; frame < frames; ++frame) {
        view = start;
        view.orbit(2 * glm::pi<double>() * frame / frames, 0);
        view.look_from(bounds.centre, distance);
        path.add(view, 1.0 / options.fps);
        path.keys.back().seconds = static_cast<double>(frame) / options.fps;  // no sum of roundings
    }
    return path;
}

}  // namespace darb
