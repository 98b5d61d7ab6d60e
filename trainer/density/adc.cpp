// Strategy adc: clone, split and prune by the screen gradient, reset opacities. Source: 3DGS,
// section 5, with graphdeco's schedule.
#include <algorithm>
#include <cmath>

#include "trainer/density/density_strategy.h"

namespace darb {

namespace {

// Rule of thumb for the growth, of nine runs on photos of 200 and 400 px: splats go up to about so
// many times the root of the photos' pixels (photos of the same scene show each other's pixels), up
// to so many for one point of the start, and not faster than so much a round.
constexpr double kSplatsPerRootPixel = 25;
constexpr double kMaxGrowth = 60;
constexpr double kGrowthPerRound = 1.4;

class Adc : public DensityStrategy {
  public:
    DensityResult round(const DensityRound& round) override {
        return round.control.run(round.splats, round.gradient_sum, round.args, round.limit);
    }
};

std::uint32_t no_target(const TrainOptions&, const Schedule&, int, std::uint32_t,
                        std::uint32_t limit) {
    return limit;
}

std::uint32_t end_by_photos(const TrainOptions& options, const GrowthStart& start) {
    const Schedule::Rounds every = Schedule(options).rounds;
    const int first = every.begin / every.interval;
    const int last = std::max(every.end - 1, 0) / every.interval;
    const int rounds = std::max(0, last - first);
    const double growth = std::min(kMaxGrowth, std::pow(kGrowthPerRound, rounds));
    const double most = std::min(growth * start.splats, static_cast<double>(start.limit));
    const double wanted = kSplatsPerRootPixel * std::sqrt(static_cast<double>(start.photo_pixels));
    const auto end = static_cast<std::uint32_t>(std::min(wanted, most));
    return start.random && rounds > 0 ? end : std::max(start.splats, end);
}

// The count grows evenly while density control runs.
double even_mean(const TrainOptions& options, std::uint32_t start, std::uint32_t end) {
    const double all = options.iterations;
    const Schedule::Rounds rounds = Schedule(options).rounds;
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
