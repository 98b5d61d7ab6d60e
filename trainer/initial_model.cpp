#include "trainer/initial_model.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <numeric>

#include "engine/core/rng.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_shapes.h"
#include "trainer/schedule.h"

namespace darb {

namespace {

// float32 resolves 1/4,000,000 of a scene's width there: an update late in a run is 1/600,000 of
// it.
constexpr double kFarOff = 4;

struct Region {
    glm::dvec3 centre;
    glm::dvec3 half;
};

// Least squares point of the optical axes: sum (I - d d^T) x = sum (I - d d^T) c.
Region region_in_view(const Dataset& dataset) {
    std::vector<View> views;
    for (const View& v : dataset.views)
        if (!v.is_test) views.push_back(v);
    glm::dmat3 normal(0.0);
    glm::dvec3 right(0.0), low(1e300), high(-1e300);
    for (const View& v : views) {
        const glm::dvec3 c = v.camera.centre();
        const glm::dvec3 axis = glm::transpose(v.camera.rotation)[2];
        const glm::dmat3 across = glm::dmat3(1.0) - glm::outerProduct(axis, axis);
        normal += across;
        right += across * c;
        low = glm::min(low, c);
        high = glm::max(high, c);
    }
    const double scale = static_cast<double>(views.size());
    if (std::abs(glm::determinant(normal)) > 1e-3 * scale * scale * scale) {
        const glm::dvec3 focus = glm::inverse(normal) * right;
        double half = 0.0;
        for (const View& v : views) {
            const double view_half =
                0.5 * std::min(v.camera.width / v.camera.fx, v.camera.height / v.camera.fy);
            half += glm::length(v.camera.centre() - focus) * view_half;
        }
        return {focus, glm::dvec3(half / scale)};
    }
    return {0.5 * (low + high), glm::max(0.5 * (high - low), glm::dvec3(scene_extent(dataset)))};
}

}  // namespace

std::uint64_t start_points(const Dataset& dataset, const TrainOptions& options) {
    if (dataset.points.size() > 0) return dataset.points.size();
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
        }
    }
    return part;
}

}  // namespace

std::uint32_t initial_count(const Dataset& dataset, const TrainOptions& options) {
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(
        start_points(dataset, options), options.max_splats.value_or(kAnyNumberOfSplats)));
}

SplatModel initial_model(const Dataset& dataset, const TrainOptions& options) {
    PointCloud drawn;
    const bool random = dataset.points.size() == 0;
    if (random) drawn = random_points(dataset, options);
    const PointCloud& given = random ? drawn : dataset.points;
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
    }
    return model;
}

}  // namespace darb
