// SPDX-License-Identifier: MIT
#include "trainer/growth/predicted_growth.h"

#include <algorithm>

#include "engine/raster/gpu_splats.h"
#include "trainer/growth/initial_model.h"

namespace darb {

namespace {

// Trainer's buffers grow to 1.5 times the intersections that did not fit.
constexpr double kIntersectionRoom = 1.5;
constexpr std::uint32_t kMinIntersectionsPerSplat = 4;

}  // namespace

std::uint32_t predict_splats(const Schedule& schedule, const GrowthStart& start) {
    return strategy_row(schedule.options.strategy).forecast_end(schedule, start);
}

std::uint32_t wanted_splats(const Device& device, const Dataset& dataset, const Schedule& schedule,
                            std::uint64_t photo_pixels, std::uint32_t start) {
    const TrainOptions& options = schedule.options;
    const std::uint32_t limit = std::min(options.max_splats.value_or(kAnyNumberOfSplats),
                                         GpuSplats::max_count(device, options.sh_degree, true));
    return predict_splats(schedule, {start, photo_pixels, dataset.detail, limit,
                                     starts_random(dataset, options), dataset.start.size() > 0});
}

std::uint32_t default_budget(const Dataset& dataset, const TrainOptions& options) {
    TrainOptions usual = options;
    usual.strategy = Strategy{};
    if (usual.start != StartPoints::random)  // the same before the points of stereo are there
        usual.start = dataset.points.size() > 0 ? StartPoints::points : StartPoints::random;
    std::uint64_t pixels = 0;
    for (const View& view : dataset.views)
        if (!view.is_test) pixels += std::uint64_t(view.camera.width) * view.camera.height;
    return predict_splats(
        usual, {initial_count(dataset, usual), pixels, dataset.detail,
                options.max_splats.value_or(kAnyNumberOfSplats), starts_random(dataset, usual)});
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
