#include "trainer/strategy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace darb {

namespace {

constexpr std::pair<Strategy, std::string_view> kNames[] = {
    {Strategy::adc, "adc"}, {Strategy::mcmc, "mcmc"}, {Strategy::budget, "budget"}};

constexpr double kGrowth = 1.05;  // of mcmc, a round, and more where that misses the limit
constexpr std::size_t kPhotosThatBear = 50;

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

void use_strategy(Strategy strategy, TrainOptions& options) {
    const TrainOptions adc;
    options.strategy = strategy;
    options.initial_opacity = adc.initial_opacity;
    options.initial_scale = adc.initial_scale;
    options.prune_opacity = adc.prune_opacity;
    options.opacity_decay = adc.opacity_decay;
    options.sh_rest_every = adc.sh_rest_every;
    if (strategy == Strategy::mcmc) {  // its authors' values
        options.initial_opacity = 0.5f;
        options.initial_scale = 0.1f;
        options.prune_opacity = 0.005f;
    }
    if (strategy == Strategy::budget) {
        options.opacity_decay = 0.01f;
        options.sh_rest_every = 16;
    }
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

bool refines_after(const TrainOptions& options, int iteration) {
    return iteration > options.densify_begin() && iteration < options.densify_end() &&
           iteration % options.round_interval() == 0;
}

bool resets_after(const TrainOptions& options, int iteration) {
    if (options.strategy != Strategy::adc || iteration <= 0) return false;
    const bool first_round_follows =
        options.densify_begin() + options.round_interval() < options.densify_end();
    const bool at_start = options.white_background && !options.random_background &&
                          iteration == options.densify_begin() && first_round_follows;
    return at_start || (iteration % options.opacity_reset_interval == 0 &&
                        iteration <= options.last_opacity_reset());
}

bool prunes_by_size(const TrainOptions& options, int iteration) {
    return options.prune_extent > 0 && iteration > options.opacity_reset_interval;
}

bool regularises_unseen(const TrainOptions& options, std::size_t photos, int iteration) {
    const auto interval = static_cast<int>((photos + kPhotosThatBear - 1) / kPhotosThatBear);
    return options.strategy == Strategy::mcmc || iteration % std::max(interval, 1) == 0;
}

std::uint32_t growth_target(const TrainOptions& options, int iteration, std::uint32_t count,
                            std::uint32_t limit) {
    const int interval = options.round_interval();
    const int last = (options.densify_end() - 1) / interval * interval;
    const double rounds = std::max(1, (last - iteration) / interval + 1);  // this one counted
    if (options.strategy == Strategy::mcmc) {
        const bool asked = options.max_splats != std::numeric_limits<std::uint32_t>::max();
        const double needed = std::pow(double(limit) / std::max(count, 1U), 1 / rounds);
        const double grown = std::ceil((asked ? std::max(kGrowth, needed) : kGrowth) * count);
        return std::max(count, static_cast<std::uint32_t>(std::min<double>(grown, limit)));
    }
    if (options.strategy != Strategy::budget || count >= limit) return limit;
    const double stays = (rounds - 1) / rounds;
    return limit - static_cast<std::uint32_t>((limit - count) * stays * stays);
}

Growth simulate_growth(const TrainOptions& options, std::uint32_t start, std::uint32_t limit) {
    double count = start, sum = 0;
    int since = 0;
    const int interval = options.round_interval();
    for (int i = interval; i < options.iterations; i += interval) {
        if (!refines_after(options, i)) continue;
        sum += count * (i - since);
        since = i;
        const auto target = growth_target(options, i, static_cast<std::uint32_t>(count), limit);
        if (count < limit) count = std::min<double>(2 * count, target);
    }
    sum += count * (options.iterations - since);
    return {static_cast<std::uint32_t>(count), sum / std::max(options.iterations, 1)};
}

}  // namespace darb
