#include "viewer/turntable.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "engine/core/quantile.h"
#include "engine/scene/subject.h"
#include "viewer/bounds.h"

namespace darb {

namespace {

constexpr double kAbove = glm::radians(15.0), kHighest = glm::radians(75.0);
constexpr double kFilledByTurn = 0.94;  // of the picture
constexpr int kSides = 24;              // from which the distance is chosen
constexpr double kFartherThanPhotos = 1.25;
constexpr double kLeastGap = glm::radians(120.0);  // that is no turn all round any more
constexpr double kWholeTurn = 2 * glm::pi<double>();

/// Where the turn goes, seen from the middle.
struct Course {
    double above = kAbove;             // rad
    double from = 0, to = kWholeTurn;  // rad, about up
    bool to_and_fro = false;
    double most_distance = HUGE_VAL;  // world
};

/// Angles about up from `ahead`, ascending; how high they are; how far.
struct Stands {
    std::vector<double> turns, heights, distances;
};

Stands stands_of(const Subject& subject, const Navigation& view,
                 const std::vector<Camera>& cameras) {
    Stands stands;
    // A view that turns to the right by an angle stands that much farther to the left.
    const glm::dvec3 back = -view.forward(), left = -view.right();
    for (const Camera& camera : cameras) {
        const glm::dvec3 way =
            subject.around ? glm::transpose(camera.rotation)[2] : camera.centre() - subject.centre;
        const double far = glm::length(way), up = glm::dot(way, view.up);
        if (!(far > 0)) continue;
        stands.distances.push_back(far);
        stands.heights.push_back(std::asin(std::clamp(up / far, -1.0, 1.0)));
        stands.turns.push_back(std::atan2(glm::dot(way, left), glm::dot(way, back)));
    }
    std::sort(stands.turns.begin(), stands.turns.end());
    return stands;
}

/// The widest gap between neighbours, with where it ends.
std::pair<double, double> widest_gap(const std::vector<double>& turns) {
    double widest = 0, end = 0;
    for (std::size_t i = 0; i < turns.size(); ++i) {
        const bool last = i + 1 == turns.size();
        const double next = last ? turns.front() + kWholeTurn : turns[i + 1];
        if (next - turns[i] <= widest) continue;
        widest = next - turns[i];
        end = last ? turns.front() : next;
    }
    return {widest, end};
}

Course course_of(const Subject& subject, const Navigation& view,
                 const std::vector<Camera>& cameras) {
    Course course;
    const Stands stands = stands_of(subject, view, cameras);
    if (stands.turns.empty()) return course;
    course.above = std::clamp(median(stands.heights), -kHighest, kHighest);
    if (subject.around) {  // of the view, not of where it stands
        course.above = -course.above;
        return course;
    }
    course.most_distance = kFartherThanPhotos * median(stands.distances);
    const auto [gap, end] = widest_gap(stands.turns);
    course.to_and_fro = gap >= kLeastGap;
    if (course.to_and_fro) {
        course.from = end;
        course.to = end + kWholeTurn - gap;
    }
    return course;
}

}  // namespace

CameraPath turntable(const SplatModel& model, const TurntableOptions& options) {
    const Subject subject = subject_of(model, options.cameras);
    Navigation view;
    view.set_up(options.up);
    view.level();
    const Course course = course_of(subject, view, options.cameras);
    view.orbit(course.from, course.above);
    const double tan_y = kFilledByTurn * std::tan(view.fov_y / 2);
    const double tan_x = tan_y * options.width / options.height;
    const Navigation start = view;
    double distance = 0;
    for (int side = 0; side < kSides; ++side) {
        view = start;
        view.orbit((course.to - course.from) * side / kSides, 0);
        distance = std::max(distance, framing_distance(model, subject, view.axes, tan_x, tan_y));
    }
    if (!(distance > 0)) distance = subject.radius / std::sin(view.fov_y / 2);
    distance = std::min(distance, course.most_distance);
    const int frames = std::max(1, static_cast<int>(std::lround(options.seconds * options.fps)));
    CameraPath path;
    for (int frame = 0; frame < frames; ++frame) {
        const double share = static_cast<double>(frame) / frames;
        view = start;
        view.orbit((course.to - course.from) *
                       (course.to_and_fro ? (1 - std::cos(kWholeTurn * share)) / 2 : share),
                   0);
        view.look_from(subject.centre, distance);
        if (subject.around) view.eye = subject.centre;
        path.add(view, 1.0 / options.fps);
        path.keys.back().seconds = static_cast<double>(frame) / options.fps;  // no sum of roundings
    }
    return path;
}

}  // namespace darb
