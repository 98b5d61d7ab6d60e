// SPDX-License-Identifier: MIT
// Strategy adc: clone, split and prune by the screen gradient, reset opacities. Source: 3DGS,
// section 5, with graphdeco's schedule.
#include <algorithm>
#include <cmath>

#include "trainer/growth/density_strategy.h"

namespace darb {

namespace {

// Rules of thumb for the growth, of runs on photos of 87 to 1,595 px (docs/experiments/growth.md).
// Splats go up by the detail of the photos' opaque pixels times the root of the pixels that show
// the scene once, which hardly changes with the size of the photos: a threshold in shares of the
// picture asks for as many. They go down with the number of photos, up to the most that were
// tried, and with the threshold; they go up with the weight of SSIM. Where the detail is not known,
// it goes by the root of all pixels. A dense start grows by so much at least; splats go up to so
// many for one of the start, and not faster than so much a round.
constexpr double kSplatsByDetail = 19'000, kDetailPower = 0.774, kPhotoPower = -0.39;
constexpr std::size_t kMostPhotosTried = 60;
constexpr double kUsualThreshold = 2e-4, kThresholdPower = -0.72;
constexpr double kUsualDssim = 0.2, kDssimPower = 0.65;  // 1.3 times as many at 0.3
constexpr double kSplatsPerRootPixel = 25;
constexpr double kDenseGrowth = 1.3;
constexpr double kMaxGrowth = 60;
constexpr double kGrowthPerRound = 1.4;

double splats_wanted(const GrowthStart& start, const TrainOptions& options) {
    const auto pixels = static_cast<double>(start.photo_pixels);
    const auto& [per_pixel, opaque] = start.detail;
    if (opaque == 0 || start.scene_pixels == 0) return kSplatsPerRootPixel * std::sqrt(pixels);
    const double detail = per_pixel * opaque * std::sqrt(start.scene_pixels * opaque);
    const auto photos =
        static_cast<double>(std::clamp<std::size_t>(start.photos, 1, kMostPhotosTried));
    const double by_detail =
        kSplatsByDetail * std::pow(detail, kDetailPower) * std::pow(photos, kPhotoPower) *
        std::pow(options.densify_grad_threshold / kUsualThreshold, kThresholdPower) *
        std::pow(options.dssim_weight() / kUsualDssim, kDssimPower);
    return start.dense ? std::max(by_detail, kDenseGrowth * start.splats) : by_detail;
}

class Adc : public DensityStrategy {
  public:
    DensityResult round(const DensityRound& round) override {
        return round.control.run(round.splats, round.gradient_sum, round.args, round.limit,
                                 round.fixed);
    }
};

std::uint32_t no_target(const Schedule&, int, std::uint32_t, std::uint32_t limit) {
    return limit;
}

std::uint32_t end_by_photos(const Schedule& schedule, const GrowthStart& start) {
    const Schedule::Rounds every = schedule.rounds;
    const int first = every.begin / every.interval;
    const int last = std::max(every.end - 1, 0) / every.interval;
    const int rounds = std::max(0, last - first);
    const double growth = std::min(kMaxGrowth, std::pow(kGrowthPerRound, rounds));
    const double most = std::min(growth * start.splats, static_cast<double>(start.limit));
    const auto end =
        static_cast<std::uint32_t>(std::min(splats_wanted(start, schedule.options), most));
    return start.random && rounds > 0 ? end : std::max(start.splats, end);
}

// The count grows evenly while density control runs.
double even_mean(const Schedule& schedule, std::uint32_t start, std::uint32_t end) {
    const double all = schedule.options.iterations;
    const Schedule::Rounds rounds = schedule.rounds;
    const double to = std::clamp<double>(rounds.end, 0, all);
    const double from = std::clamp<double>(rounds.begin, 0, to);
    return (from * start + (to - from) * 0.5 * (double(start) + end) + (all - to) * end) / all;
}

std::uint64_t even_until(const Schedule& schedule, int iteration, double start, std::uint32_t end) {
    const double rounds = std::max(1, schedule.rounds.end - schedule.rounds.begin);
    const double until = iteration - schedule.rounds.begin;
    const double share = std::clamp(until / rounds, 0.0, 1.0);
    return static_cast<std::uint64_t>(start + share * (end - start));
}

}  // namespace

const StrategyRow& adc_row();
const StrategyRow& adc_row() {
    static const StrategyRow row{
        .name = "adc",
        .summary = "clone, split and prune by the screen gradient, as 3DGS",
        .defaults = {},
        .follows_3dgs = true,
        .grows_to_limit = false,
        .drops_undrawn = true,
        .target = no_target,
        .forecast_end = end_by_photos,
        .forecast_mean = even_mean,
        .forecast_until = even_until,
        .device_bytes = [](int) { return std::uint64_t{0}; },
        .make = [](const StrategySetup&) -> std::unique_ptr<DensityStrategy> {
            return std::make_unique<Adc>();
        }};
    return row;
}

}  // namespace darb
