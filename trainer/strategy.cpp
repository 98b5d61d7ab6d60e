#include "trainer/strategy.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trainer/schedule.h"

namespace darb {

namespace {

constexpr std::pair<Strategy, std::string_view> kNames[] = {
    {Strategy::adc, "adc"}, {Strategy::mcmc, "mcmc"}, {Strategy::budget, "budget"}};

constexpr double kGrowth = 1.05;  // of mcmc, a round, and more where that misses the limit

}  // namespace

std::string_view strategy_name(Strategy strategy) {
    for (const auto& [row, name] : kNames)
        if (row == strategy) return name;
    return "";
}

std::optional<Strategy> strategy_from_name(std::string_view name) {
    for (const auto& [strategy, row] : kNames)
        if (row == name) return strategy;
    return std::nullopt;
}

StrategyDefaults strategy_defaults(Strategy strategy) {
    StrategyDefaults d;
    if (strategy == Strategy::mcmc) {  // its authors' values
        d.initial_opacity = 0.5f;
        d.initial_scale = 0.1f;
        d.prune_opacity = 0.005f;
    }
    if (strategy == Strategy::budget) {
        d.opacity_decay = 0.01f;
        d.sh_rest_every = 16;
    }
    return d;
}

void use_3dgs_schedule(TrainOptions& options) {
    options.position_lr_init = 1.6e-4f;
    options.position_lr_final = 1.6e-6f;
    options.opacity_lr = 0.025f;
    options.paced = options.sh_rest_hastens = false;
    options.final_lr_share = options.average_from = 1;
    options.prune_opacity = 0.005f;
    options.prune_extent = 0.1f;
    options.late_resets = true;
    options.opacity_weight = options.scale_weight = 0;
    options.random_background = options.resolution_ramp = false;
    options.lengths_by_area = false;
    options.largest_scale = 0;
    options.clearance = 0;
}

std::uint32_t growth_target(const TrainOptions& options, const Schedule& schedule, int iteration,
                            std::uint32_t count, std::uint32_t limit) {
    const int interval = schedule.rounds.interval;
    const int last = (schedule.rounds.end - 1) / interval * interval;
    const double rounds = std::max(1, (last - iteration) / interval + 1);  // this one counted
    if (options.strategy == Strategy::mcmc) {
        const double needed = std::pow(double(limit) / std::max(count, 1U), 1 / rounds);
        const double growth = options.max_splats ? std::max(kGrowth, needed) : kGrowth;
        const double grown = std::ceil(growth * count);
        return std::max(count, static_cast<std::uint32_t>(std::min<double>(grown, limit)));
    }
    if (options.strategy != Strategy::budget || count >= limit) return limit;
    const double stays = (rounds - 1) / rounds;
    return limit - static_cast<std::uint32_t>((limit - count) * stays * stays);
}

Growth simulate_growth(const TrainOptions& options, std::uint32_t start, std::uint32_t limit) {
    const Schedule schedule(options);
    double count = start, sum = 0;
    int since = 0;
    const int interval = schedule.rounds.interval;
    for (int i = interval; i < options.iterations; i += interval) {
        if (!schedule.refines_after(i)) continue;
        sum += count * (i - since);
        since = i;
        const auto target =
            growth_target(options, schedule, i, static_cast<std::uint32_t>(count), limit);
        if (count < limit) count = std::min<double>(2 * count, target);
    }
    sum += count * (options.iterations - since);
    return {static_cast<std::uint32_t>(count), sum / std::max(options.iterations, 1)};
}

}  // namespace darb
