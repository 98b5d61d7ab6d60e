// SPDX-License-Identifier: MIT
#include "trainer/options/strategy.h"

#include <algorithm>

#include "trainer/options/schedule.h"

namespace darb {

#define DARB_STRATEGY(name) const StrategyRow& name##_row();
DARB_STRATEGIES(DARB_STRATEGY)
#undef DARB_STRATEGY

const StrategyRow& strategy_row(Strategy strategy) {
    switch (strategy) {
#define DARB_STRATEGY(name) \
    case Strategy::name:    \
        return name##_row();
        DARB_STRATEGIES(DARB_STRATEGY)
#undef DARB_STRATEGY
    }
    return strategy_row(Strategy{});
}

std::vector<Strategy> all_strategies() {
    return {
#define DARB_STRATEGY(name) Strategy::name,
        DARB_STRATEGIES(DARB_STRATEGY)
#undef DARB_STRATEGY
    };
}

std::string_view strategy_name(Strategy strategy) {
    return strategy_row(strategy).name;
}

std::optional<Strategy> strategy_from_name(std::string_view name) {
    for (const Strategy strategy : all_strategies())
        if (strategy_name(strategy) == name) return strategy;
    return std::nullopt;
}

std::string strategy_names() {
    const std::vector<Strategy> all = all_strategies();
    std::string names;
    for (std::size_t i = 0; i < all.size(); ++i) {
        if (i > 0) names += i + 1 < all.size() ? ", " : " or ";
        names += strategy_name(all[i]);
    }
    return names;
}

std::uint32_t growth_target(const Schedule& schedule, int iteration, std::uint32_t count,
                            std::uint32_t limit) {
    return strategy_row(schedule.options.strategy).target(schedule, iteration, count, limit);
}

int rounds_left(const Schedule& schedule, int iteration) {
    const int interval = schedule.rounds.interval;
    const int last = (schedule.rounds.end - 1) / interval * interval;
    return std::max(1, (last - iteration) / interval + 1);
}

Growth simulate_growth(const Schedule& schedule, std::uint32_t start, std::uint32_t limit) {
    const TrainOptions& options = schedule.options;
    double count = start, sum = 0;
    int since = 0;
    const int interval = schedule.rounds.interval;
    for (int i = interval; i < options.iterations; i += interval) {
        if (!schedule.refines_after(i)) continue;
        sum += count * (i - since);
        since = i;
        const auto target = growth_target(schedule, i, static_cast<std::uint32_t>(count), limit);
        if (count < limit) count = std::min<double>(2 * count, target);
    }
    sum += count * (options.iterations - since);
    return {static_cast<std::uint32_t>(count), sum / std::max(options.iterations, 1)};
}

std::vector<double> growth_path(const Schedule& schedule, std::uint32_t start, std::uint32_t end) {
    const TrainOptions& options = schedule.options;
    const StrategyRow& row = strategy_row(options.strategy);
    std::vector<double> path;
    double count = start;
    for (int i = 0; i <= options.iterations; ++i) {
        if (!row.grows_to_limit) {
            count = double(row.forecast_until(schedule, i, start, end));
        } else if (schedule.refines_after(i) && count < end) {
            const auto target = row.target(schedule, i, static_cast<std::uint32_t>(count), end);
            count = std::min<double>(2 * count, target);
        }
        path.push_back(count);
    }
    return path;
}

std::uint32_t simulated_end(const Schedule& schedule, const GrowthStart& start) {
    return std::max(start.splats, simulate_growth(schedule, start.splats, start.limit).end);
}

double simulated_mean(const Schedule& schedule, std::uint32_t start, std::uint32_t end) {
    return simulate_growth(schedule, start, end).mean;
}

std::uint64_t end_at_once(const Schedule&, int, double, std::uint32_t end) {
    return end;
}

}  // namespace darb
