// Cameras with which nothing good can come out: notes, as a few of many may be wrong.
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "engine/data/source.h"

namespace darb {

namespace {

constexpr double kLeastFocal = 0.05, kMostFocal = 50;  // of the larger side: 169 and 1.1 degrees
constexpr double kMostAspect = 4;                      // of the focal lengths
constexpr double kMostShift = 1;         // principal point beyond the frame, of its side
constexpr std::size_t kFewPoints = 100;  // that may well be out of a good camera's view
constexpr std::size_t kLooked = 20'000;  // points, evenly picked

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

}  // namespace

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
