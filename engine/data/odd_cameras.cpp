// Cameras, and points, with which nothing good can come out. A few of many may be wrong: most are
// noted, and cameras that stand far outside of the scene are left out.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/quantile.h"
#include "engine/data/point_splats.h"
#include "engine/data/source.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/stored_units.h"

namespace darb {

namespace {

constexpr double kLeastFocal = 0.05, kMostFocal = 50;  // of the larger side: 169 and 1.1 degrees
constexpr double kMostAspect = 4;                      // of the focal lengths
constexpr double kMostShift = 1;         // principal point beyond the frame, of its side
constexpr std::size_t kFewPoints = 100;  // that may well be out of a good camera's view
constexpr std::size_t kLooked = 20'000;  // points, evenly picked

// A camera that stands this many times farther out than the others may be wrong. Where no points
// tell what it sees, the limit is higher: an overview from far away is no mistake.
constexpr double kFarWithPoints = 10, kFarWithoutPoints = 100;
constexpr double kLeastCore = 2.0 / 3;    // share of the cameras that stand together
constexpr double kShareOfDepth = 0.1;     // of the way to the points: how far apart cameras that
                                          // stand in one place are taken to be, at least
constexpr double kLeastSpread = 0.05;     // of the frame, that the points must take up
constexpr std::size_t kLeastGroup = 3;    // cameras that are a second place, not mistakes
constexpr std::size_t kNamedCameras = 3;  // photos that a note names

/// How many and the first of them.
struct Found {
    std::size_t count = 0;
    const View* example = nullptr;
    void add(const View& view) {
        if (count++ == 0) example = &view;
    }
};

bool has_odd_focal_length(const Camera& c) {
    const double side = std::max(c.width, c.height);
    const auto odd = [&](double f) { return !(f >= kLeastFocal * side && f <= kMostFocal * side); };
    return odd(c.fx) || odd(c.fy) || c.fx > kMostAspect * c.fy || c.fy > kMostAspect * c.fx;
}

bool has_odd_principal_point(const Camera& c) {
    const auto odd = [](double p, double side) {
        return !(p >= -kMostShift * side && p <= (1 + kMostShift) * side);
    };
    return odd(c.cx, c.width) || odd(c.cy, c.height);
}

/// Whether a point is before it and in its frame, or half of that beside it; with a lens, before
/// it.
bool sees_a_point(const Camera& c, const PointCloud& points, std::size_t step) {
    for (std::size_t i = 0; i < points.size(); i += step) {
        const double* at = &points.position[3 * i];
        const glm::dvec3 p = c.rotation * glm::dvec3(at[0], at[1], at[2]) + c.translation;
        if (!(p.z > 0)) continue;
        if (c.lens.active) return true;
        const double x = (c.fx * p.x / p.z + c.cx) / c.width;
        const double y = (c.fy * p.y / p.z + c.cy) / c.height;
        if (x > -0.5 && x < 1.5 && y > -0.5 && y < 1.5) return true;
    }
    return false;
}

double middle(std::vector<double> values, double share = 0.5) {
    const auto nth = values.begin() +
                     static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), nth, values.end());
    return *nth;
}

glm::dvec3 middle_of(const std::vector<glm::dvec3>& places) {
    glm::dvec3 centre;
    std::vector<double> values(places.size());
    for (int axis = 0; axis < 3; ++axis) {
        for (std::size_t i = 0; i < places.size(); ++i) values[i] = places[i][axis];
        centre[axis] = middle(values);
    }
    return centre;
}

std::vector<glm::dvec3> some_points(const PointCloud& points) {
    std::vector<glm::dvec3> some;
    for (std::size_t i = 0; i < points.size(); i += points.size() / kLooked + 1)
        some.emplace_back(points.position[3 * i], points.position[3 * i + 1],
                          points.position[3 * i + 2]);
    return some;
}

/// How much of the frame the points take up that a view sees: the middle 90 % of them, as a share
/// of its longer side. Nothing where it sees hardly any.
std::optional<double> spread_in_frame(const View& view, const std::vector<glm::dvec3>& points) {
    const double side = std::max(view.lens.width, view.lens.height);
    const double focal = view.lens.parameters.empty() ? side : view.lens.parameters[0];
    std::vector<double> u, v;
    for (const glm::dvec3& point : points) {
        const glm::dvec3 p = view.camera.rotation * point + view.camera.translation;
        if (!(p.z > 0)) continue;
        const double x = focal * p.x / (p.z * side), y = focal * p.y / (p.z * side);
        if (std::abs(x) > 1 || std::abs(y) > 1) continue;
        u.push_back(x);
        v.push_back(y);
    }
    if (u.size() < points.size() / 100 + 2) return {};
    return std::max(middle(u, 0.95) - middle(u, 0.05), middle(v, 0.95) - middle(v, 0.05));
}

/// Whether this camera has company: cameras that stand about as close together as the core does,
/// but not in one place. Drones above a street and a second room do; mistakes do not.
bool is_of_a_group(const std::vector<glm::dvec3>& centres, std::size_t i, double reach) {
    std::size_t near = 0;
    double farthest = 0;
    for (const glm::dvec3& other : centres) {
        const double away = glm::distance(centres[i], other);
        if (away > reach) continue;
        ++near;
        farthest = std::max(farthest, away);
    }
    return near >= kLeastGroup && farthest > 1e-6 * reach;
}

/// Which views stand far outside of the place where at least two thirds of them are, and how many
/// times its radius (`times`, of the nearest of them).
std::vector<std::size_t> far_views(const Dataset& dataset, double& times) {
    const std::size_t count = dataset.views.size();
    if (count < 3) return {};
    std::vector<glm::dvec3> centres;
    for (const View& view : dataset.views) centres.push_back(view.camera.centre());
    const glm::dvec3 centre = middle_of(centres);
    std::vector<double> away;
    for (const glm::dvec3& c : centres) away.push_back(glm::distance(c, centre));
    std::vector<double> sorted = away;
    std::sort(sorted.begin(), sorted.end());
    const bool has_points = dataset.points.size() >= kFewPoints;
    std::vector<glm::dvec3> points;
    double least = 0;
    if (has_points) {
        points = some_points(dataset.points);
        std::vector<double> depths;
        for (const glm::dvec3& point : points) depths.push_back(glm::distance(point, centre));
        least = kShareOfDepth * middle(depths);
    }
    const double limit = has_points ? kFarWithPoints : kFarWithoutPoints;
    auto core = static_cast<std::size_t>(std::ceil(kLeastCore * static_cast<double>(count))) - 1;
    const auto radius = [&] { return std::max(sorted[core], least); };
    while (core + 1 < count && !(sorted[core + 1] > limit * radius())) ++core;
    if (core + 1 >= count || !(radius() > 0)) return {};
    std::vector<std::size_t> far;
    for (std::size_t v = 0; v < count; ++v) {
        if (away[v] <= sorted[core]) continue;
        if (is_of_a_group(centres, v, 2 * radius())) continue;
        if (spread_in_frame(dataset.views[v], points).value_or(0) >= kLeastSpread) continue;
        times = far.empty() ? away[v] / radius() : std::min(times, away[v] / radius());
        far.push_back(v);
    }
    return far;
}

}  // namespace

void leave_out_far_cameras(Dataset& dataset) {
    double times = 0;
    const std::vector<std::size_t> far = far_views(dataset, times);
    if (far.empty()) return;
    std::string names;
    for (std::size_t i = 0; i < std::min(far.size(), kNamedCameras); ++i)
        names += (i > 0 ? ", " : "") + dataset.views[far[i]].name;
    if (far.size() > kNamedCameras) names += ", ...";
    const bool leaves_out = dataset.options.require_photos, one = far.size() == 1;
    const std::string which = one ? fmt::format("the camera of {}", names)
                                  : fmt::format("the cameras of {} of {} photos ({})", far.size(),
                                                dataset.views.size(), names);
    const std::string where =
        fmt::format("at least {:.0f} times as far from the middle of the cameras as the others do",
                    std::floor(times));
    dataset.notes.push_back(
        leaves_out
            ? fmt::format("Warning: {} {} left out, as {} {}, which only a wrong pose explains. "
                          "Correct {} to use {}.",
                          which, one ? "was" : "were", one ? "it stands" : "they stand", where,
                          one ? "its pose" : "their poses", one ? "the photo" : "the photos")
            : fmt::format("Warning: {} {} {}, which only a wrong pose explains.", which,
                          one ? "stands" : "stand", where));
    if (!leaves_out) return;
    for (std::size_t i = far.size(); i-- > 0;)
        dataset.views.erase(dataset.views.begin() + static_cast<std::ptrdiff_t>(far[i]));
}

void note_coarse_points(Dataset& dataset) {
    const std::vector<double>& positions = dataset.points.position;
    constexpr double kFar = 256;  // times its width, a cloud is from 0 where float32 may be coarse
    if (positions.size() < 3 * kFewPoints || choose_origin(positions, kFar) == glm::dvec3(0.0))
        return;
    double step = 0;
    std::vector<double> places(positions.size() / 3);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t i = 0; i < places.size(); ++i)
            places[i] = std::abs(positions[3 * i + axis]);
        const double own = float32_step(nearest_rank(places, 0.5));
        if (own > step && were_float32(places)) step = own;
    }
    std::vector<double> distance2 = neighbour_distance2(positions);
    const double distance = std::sqrt(nearest_rank(distance2, 0.5));
    constexpr double kCoarsePoints = 0.1;  // of the distance to the next points
    if (!(step > kCoarsePoints * distance)) return;
    dataset.notes.push_back(fmt::format(
        "Warning: the points lie in steps of {:.3g}, as float32 does so far from 0, and half of "
        "them are within {:.3g} of their neighbours: they were rounded when they were written. "
        "Export them with x, y and z as double, or cameras and points moved to 0.",
        step, distance));
}

void note_odd_cameras(Dataset& dataset) {
    Found focal, principal, blind;
    const std::size_t step = dataset.points.size() / kLooked + 1;
    for (const View& view : dataset.views) {
        if (has_odd_focal_length(view.camera)) focal.add(view);
        if (has_odd_principal_point(view.camera)) principal.add(view);
        if (dataset.points.size() >= kFewPoints && !sees_a_point(view.camera, dataset.points, step))
            blind.add(view);
    }
    std::vector<std::string>& notes = dataset.notes;
    if (focal.count > 0) {
        const Camera& c = focal.example->camera;
        notes.push_back(fmt::format(
            "Warning: focal lengths beyond reason: {}, as {} with {:g} and {:g} px for {} x {} px.",
            counted(focal.count, "camera"), focal.example->name, c.fx, c.fy, c.width, c.height));
    }
    if (principal.count > 0) {
        const Camera& c = principal.example->camera;
        notes.push_back(
            fmt::format("Warning: principal points far outside of the photo: {}, as {} with {:g}, "
                        "{:g} for {} x {} px.",
                        counted(principal.count, "camera"), principal.example->name, c.cx, c.cy,
                        c.width, c.height));
    }
    if (blind.count > 0)
        notes.push_back(fmt::format(
            "Warning: none of the points is in view: {} of {}, as {}. Points and cameras may be of "
            "different reconstructions.",
            counted(blind.count, "camera"), dataset.views.size(), blind.example->name));
}

}  // namespace darb
