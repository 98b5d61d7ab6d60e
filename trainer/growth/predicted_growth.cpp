// SPDX-License-Identifier: MIT
#include "trainer/growth/predicted_growth.h"

#include <algorithm>
#include <cmath>

#include "engine/raster/gpu_splats.h"
#include "engine/scene/region.h"
#include "trainer/growth/initial_model.h"
#include "trainer/options/strategy.h"

namespace darb {

namespace {

// Trainer's buffers grow to 1.5 times the intersections that did not fit.
constexpr double kIntersectionRoom = 1.5;
constexpr std::uint32_t kMinIntersectionsPerSplat = 4;
// So many of the points say what all would.
constexpr std::size_t kPointsLookedAt = 2'000;

bool has_in_frame(const Camera& camera, const glm::dvec3& point) {
    const glm::dvec3 p = camera.rotation * point + camera.translation;
    const double x = camera.fx * p.x + camera.cx * p.z, y = camera.fy * p.y + camera.cy * p.z;
    return p.z > 0 && x >= 0 && y >= 0 && x < camera.width * p.z && y < camera.height * p.z;
}

std::size_t training_photos(const Dataset& dataset) {
    return static_cast<std::size_t>(std::count_if(dataset.views.begin(), dataset.views.end(),
                                                  [](const View& view) { return !view.is_test; }));
}

// Of the training photos, with a point in their frame: the mean over the points; 1 without any.
double share_with_a_point(const Dataset& dataset, std::size_t photos) {
    const std::vector<double>& position = dataset.points.position;
    const std::size_t points = dataset.points.size(), looked = std::min(points, kPointsLookedAt);
    std::size_t seen = 0;
    for (std::size_t k = 0; k < looked; ++k) {
        const double* p = &position[3 * (k * points / looked)];
        for (const View& view : dataset.views)
            if (!view.is_test && has_in_frame(view.camera, {p[0], p[1], p[2]})) ++seen;
    }
    return seen == 0 ? 1.0 : double(seen) / (double(looked) * double(photos));
}

GrowthStart growth_start(const Dataset& dataset, const TrainOptions& options,
                         std::uint64_t photo_pixels, std::uint32_t splats, std::uint32_t limit) {
    return {.splats = splats,
            .photo_pixels = photo_pixels,
            .detail = dataset.detail,
            .limit = limit,
            .random = starts_random(dataset, options),
            .dense = dataset.start.size() > 0,
            .photos = training_photos(dataset),
            .scene_pixels = scene_pixels(dataset)};
}

// Of what a run starts with, the share inside options.region, where alone splats grow in number.
// Random splats, which fill all that photos see, count like their places.
double share_in_region(const Dataset& dataset, const TrainOptions& options) {
    if (!options.region) return 1;
    const SplatModel start = initial_model(dataset, options);
    std::size_t inside = 0;
    for (const std::uint8_t outside : splats_outside(*options.region, start))
        inside += outside == 0;
    return start.size() == 0 ? 1 : double(inside) / double(start.size());
}

// Where `whole` splats are forecast of a scene that grows everywhere: what is inside the region
// grows as it would there, and the rest of the start stays as it is.
std::uint32_t grown_in_region(const Dataset& dataset, const TrainOptions& options,
                              std::uint32_t start, std::uint32_t whole) {
    if (!options.region || whole <= start) return whole;
    const double grown = share_in_region(dataset, options) * (double(whole) - double(start));
    return start + static_cast<std::uint32_t>(std::lround(grown));
}

std::uint64_t training_pixels(const Dataset& dataset) {
    std::uint64_t pixels = 0;
    for (const View& view : dataset.views)
        if (!view.is_test) pixels += std::uint64_t(view.camera.width) * view.camera.height;
    return pixels;
}

}  // namespace

double mean_photo_pixels(const Dataset& dataset) {
    const std::size_t photos = training_photos(dataset);
    return photos == 0 ? 0 : double(training_pixels(dataset)) / double(photos);
}

double scene_pixels(const Dataset& dataset) {
    const std::size_t photos = training_photos(dataset);
    if (photos == 0) return 0;
    return mean_photo_pixels(dataset) / share_with_a_point(dataset, photos);
}

std::uint32_t predict_splats(const Schedule& schedule, const GrowthStart& start) {
    return strategy_row(schedule.options.strategy).forecast_end(schedule, start);
}

std::uint32_t wanted_splats(const Device& device, const Dataset& dataset, const Schedule& schedule,
                            std::uint64_t photo_pixels, std::uint32_t start) {
    const TrainOptions& options = schedule.options;
    const std::uint32_t limit = std::min(options.max_splats.value_or(kAnyNumberOfSplats),
                                         GpuSplats::max_count(device, options.sh_degree, true));
    const auto predicted = [&](std::uint32_t most) {
        return predict_splats(schedule, growth_start(dataset, options, photo_pixels, start, most));
    };
    // A strategy with a budget uses all of it inside the region.
    if (!options.region || strategy_row(options.strategy).grows_to_limit) return predicted(limit);
    return std::min(limit, grown_in_region(dataset, options, start, predicted(kAnyNumberOfSplats)));
}

std::uint32_t default_budget(const Dataset& dataset, const TrainOptions& options) {
    TrainOptions usual = options;
    usual.strategy = Strategy{};
    if (usual.start != StartPoints::random)  // the same before the points of stereo are there
        usual.start = dataset.points.size() > 0 ? StartPoints::points : StartPoints::random;
    GrowthStart start =
        growth_start(dataset, usual, training_pixels(dataset), initial_count(dataset, usual),
                     options.max_splats.value_or(kAnyNumberOfSplats));
    start.dense = false;  // nor are they counted here
    return grown_in_region(dataset, usual, start.splats, predict_splats(usual, start));
}

double mean_splats(std::uint32_t start, std::uint32_t end, const Schedule& schedule) {
    return strategy_row(schedule.options.strategy).forecast_mean(schedule, start, end);
}

int predict_degree(const Schedule& schedule, int iterations) {
    const TrainOptions& options = schedule.options;
    if (!options.probe_sh) return options.sh_degree;
    return std::min(options.sh_degree, std::max(iterations - 1, 0) / schedule.degree_interval);
}

bool has_rounds(const Schedule& schedule) {
    return schedule.rounds.end > schedule.rounds.begin;
}

double intersection_room(double intersections) {
    return std::max(double{kMinIntersectionsPerSplat}, kIntersectionRoom * intersections);
}

}  // namespace darb
