#include "engine/data/track_observations.h"

#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <tuple>

#include "engine/core/quantile.h"
#include "engine/data/lens_model.h"

namespace darb {

namespace {

// Lenses by what they are made of: photos share them.
class Lenses {
  public:
    const Lens& of(const LensModel& model) {
        const auto [at, is_new] =
            made_.try_emplace({model.model, model.parameters, model.width, model.height});
        if (is_new) at->second.emplace(model);
        return *at->second;
    }

  private:
    std::map<std::tuple<std::string, std::vector<double>, int, int>, std::optional<Lens>> made_;
};

}  // namespace

std::vector<TrackObservation> track_observations(const Dataset& dataset, std::size_t fewest,
                                                 std::size_t most) {
    std::vector<TrackObservation> all;
    const PointCloud& points = dataset.points;
    if (!points.has_tracks()) return all;
    const std::size_t step = points.seen_by.size() / most + 1;
    Lenses lenses;
    for (std::size_t p = 0; p + 1 < points.seen_begin.size(); p += step) {
        const std::size_t before = all.size();
        for (std::size_t k = points.seen_begin[p]; k < points.seen_begin[p + 1]; ++k) {
            const View& view = dataset.views[points.seen_by[k]];
            const glm::dvec2 at(double(points.seen_at[2 * k]) * view.lens.width,
                                double(points.seen_at[2 * k + 1]) * view.lens.height);
            if (!std::isfinite(at.x + at.y)) continue;
            const auto ray = lenses.of(view.lens).unproject(at);
            if (!ray) continue;
            const Camera& c = view.camera;
            all.push_back({points.seen_by[k],
                           static_cast<std::uint32_t>(p),
                           {c.fx * ray->x + c.cx, c.fy * ray->y + c.cy}});
        }
        if (all.size() - before < fewest) all.resize(before);
    }
    return all;
}

glm::dvec2 pinhole_pixel(const Camera& camera, const glm::dvec3& world) {
    const glm::dvec3 p = camera.rotation * world + camera.translation;
    if (!(p.z > 0)) return glm::dvec2(std::numeric_limits<double>::quiet_NaN());
    return {camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy};
}

double median_track_error_px(const Dataset& dataset,
                             const std::vector<TrackObservation>& observations) {
    std::vector<double> errors;
    for (const TrackObservation& o : observations) {
        const double* x = &dataset.points.position[3 * std::size_t{o.point}];
        const glm::dvec2 at =
            pinhole_pixel(dataset.views[o.view].camera, glm::dvec3(x[0], x[1], x[2]));
        const double error = glm::distance(at, o.at_px);
        if (std::isfinite(error)) errors.push_back(error);
    }
    return errors.empty() ? 0 : nearest_rank(errors, 0.5);
}

}  // namespace darb
