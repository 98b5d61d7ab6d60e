#include "trainer/initial_model.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <numeric>

#include "engine/core/rng.h"
#include "engine/data/region.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_shapes.h"
#include "trainer/schedule.h"

namespace darb {

namespace {

// float32 resolves 1/4,000,000 of a scene's width there: an update late in a run is 1/600,000 of
// it.
constexpr double kFarOff = 4;

// Of splats on surfaces (docs/experiments/dense_start.md): the standard deviation along the surface
// as a share of the distance to the next point, that across it as a share of that along.
constexpr double kSurfaceWidth = 0.6, kSurfaceThickness = 0.3, kSurfaceOpacity = 0.5;

// Empty: random ones.
const PointCloud& given_points(const Dataset& dataset, const TrainOptions& options) {
    static const PointCloud kNone;
    if (options.start == StartPoints::random) return kNone;
    const bool takes_start = options.start != StartPoints::points && dataset.start.size() > 0;
    return takes_start ? dataset.start : dataset.points;
}

}  // namespace

bool starts_random(const Dataset& dataset, const TrainOptions& options) {
    return given_points(dataset, options).size() == 0;
}

std::uint64_t start_points(const Dataset& dataset, const TrainOptions& options) {
    const std::size_t given = given_points(dataset, options).size();
    if (given > 0) return given;
    std::uint64_t pixels = 0;
    for (const View& v : dataset.views)
        if (!v.is_test) pixels += std::uint64_t(v.camera.width) * v.camera.height;
    return options.random_points ? *options.random_points
                                 : std::clamp<std::uint64_t>(pixels / 32, 1'000, 100'000);
}

namespace {

PointCloud random_points(const Dataset& dataset, const TrainOptions& options) {
    const std::uint64_t wanted = start_points(dataset, options);
    const Region region = region_in_view(dataset);
    Pcg32 random(options.seed, 1);
    PointCloud cloud;
    for (std::uint64_t i = 0; i < wanted; ++i)
        for (int a = 0; a < 3; ++a) {
            cloud.position.push_back(region.centre[a] + region.half[a] * random.uniform(-1.0, 1.0));
            cloud.colour.push_back(static_cast<std::uint8_t>(random.below(256)));
        }
    return cloud;
}

// A drawn part of the cloud: a file's order follows its making, from one end of a scene to the
// other.
PointCloud drawn_from(const PointCloud& cloud, std::uint32_t count, std::uint64_t seed) {
    std::vector<std::uint32_t> order(cloud.size());
    std::iota(order.begin(), order.end(), 0U);
    Pcg32 random(seed, 2);
    PointCloud part;
    for (std::uint32_t i = 0; i < count; ++i) {
        std::swap(order[i], order[i + random.below(static_cast<std::uint32_t>(order.size()) - i)]);
        for (int a = 0; a < 3; ++a) {
            part.position.push_back(cloud.position[3 * order[i] + a]);
            part.colour.push_back(cloud.colour[3 * order[i] + a]);
            if (!cloud.normal.empty()) part.normal.push_back(cloud.normal[3 * order[i] + a]);
        }
        // As many cover the same surface.
        if (!cloud.spacing.empty())
            part.spacing.push_back(
                cloud.spacing[order[i]] *
                std::sqrt(static_cast<float>(cloud.size()) / static_cast<float>(count)));
    }
    return part;
}

// A splat of the surface: flat along the normal, as wide as the points are apart.
void lay_flat(const PointCloud& points, size_t i, double length_scale, SplatModel& model) {
    const glm::dvec3 n(points.normal[3 * i], points.normal[3 * i + 1], points.normal[3 * i + 2]);
    const double width = std::log(kSurfaceWidth * points.spacing[i] * length_scale);
    const double scale[3] = {width, width, width + std::log(kSurfaceThickness)};
    // The shortest turn from z to the normal, which may point either way.
    const glm::dvec3 up = n.z < 0 ? -n : n;
    const double norm = std::sqrt(2 * (1 + up.z));
    const double rotation[4] = {1 + up.z, -up.y, up.x, 0};
    for (int a = 0; a < 3; ++a) model.log_scale[3 * i + a] = static_cast<float>(scale[a]);
    for (int a = 0; a < 4; ++a) model.rotation[4 * i + a] = static_cast<float>(rotation[a] / norm);
    model.opacity_logit[i] = static_cast<float>(std::log(kSurfaceOpacity / (1 - kSurfaceOpacity)));
}

}  // namespace

std::uint32_t initial_count(const Dataset& dataset, const TrainOptions& options) {
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(
        start_points(dataset, options), options.max_splats.value_or(kAnyNumberOfSplats)));
}

SplatModel initial_model(const Dataset& dataset, const TrainOptions& options) {
    PointCloud drawn;
    const bool random = starts_random(dataset, options);
    if (random) drawn = random_points(dataset, options);
    const PointCloud& given = random ? drawn : given_points(dataset, options);
    const std::uint32_t most = options.max_splats.value_or(kAnyNumberOfSplats);
    const bool too_many = given.size() > most;
    if (too_many) drawn = drawn_from(given, most, options.seed);
    const PointCloud& points = random || too_many ? drawn : given;
    const std::vector<double> distance2 = neighbour_distance2(points.position);
    SplatModel model;
    model.sh_degree = options.sh_degree;
    model.kernel = options.kernel;
    model.footprint = options.footprint;
    model.origin = choose_origin(points.position, kFarOff);
    model.resize(points.size());
    set_kernel(model, options.kernel);
    const Schedule schedule(options);
    // A hair above: the default is what is pruned, too, and a point that no frame has shown stays.
    const double opacity = std::min(1.001 * schedule.initial_opacity, 0.999);
    const auto logit = static_cast<float>(std::log(opacity / (1 - opacity)));
    const double initial_scale = schedule.initial_scale * schedule.length_scale;
    for (size_t i = 0; i < model.size(); ++i) {
        model.rotation[4 * i] = 1.0f;
        model.opacity_logit[i] = logit;
        for (int a = 0; a < 3; ++a) {
            const size_t at = 3 * i + a;
            model.position[at] = static_cast<float>(points.position[at] - model.origin[a]);
            model.log_scale[at] =
                static_cast<float>(0.5 * std::log(distance2[i]) + std::log(initial_scale));
            model.sh_dc[at] = static_cast<float>((points.colour[at] / 255.0 - 0.5) / SH_C0);
        }
        if (!points.spacing.empty() && points.spacing[i] > 0)
            lay_flat(points, i, schedule.length_scale, model);
    }
    return model;
}

}  // namespace darb
