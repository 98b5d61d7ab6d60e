// SPDX-License-Identifier: MIT
// The strategies by which splats grow in number, by name, with what is known of them before a run.
// Their table is density/strategy_list.h; each is one file of density/.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/data/dataset.h"
#include "trainer/options/options.h"

namespace darb {

class DensityStrategy;
class Schedule;
struct StrategySetup;

/// What options take from the strategy where they are not given.
struct StrategyDefaults {
    float initial_opacity = 0.1f;
    float initial_scale = 1;  // times the distance to the neighbours
    // 3DGS prunes below 0.005, at an opacity rate of 0.025. These two leave 59,192 rather than
    // 80,811 splats on fox at 200 px after 2,000 iterations, and 27.47 rather than 26.75 dB on
    // held-out views.
    float prune_opacity = 0.1f;
    // Density control ends after this part of the run, and at this iteration at the latest.
    int rounds_part = 1, rounds_of = 2, rounds_latest = 15'000;
    // The share of a run that ends with a mean, over which the position's rate falls.
    double position_lr_falls = 0.35;
    bool regularises_all = false;  // at each iteration also what its frame does not show
};

/// What a forecast of the splats at the end goes by.
struct GrowthStart {
    std::uint32_t splats = 0;
    std::uint64_t photo_pixels = 0;  // all training photos together
    PhotoDetail detail{};            // the photos' Dataset::detail
    std::uint32_t limit = 0;         // what the device and options.max_splats allow
    bool random = false;             // adc's first rounds take most of these, so fewer may be left
    bool dense = false;              // points on surfaces, found by comparing photos
    std::size_t photos = 0;          // to train on
    double scene_pixels = 0;         // scene_pixels() of them; 0: not known
};

/// What 3DGS does where the defaults depart from it (docs/experiments/README.md says why): constant
/// rates but the position's, those of its paper, pruning below 0.005, no regularisers, one
/// background, the same lengths for every kernel, no largest scale, whole photos from the start, no
/// mean. Effects are not part of it: 3DGS has harmonics by the iteration, +sh, and neither
/// anti-aliasing nor exposure.
void use_3dgs_schedule(TrainOptions& options);

/// StrategyRow::target of the options' strategy.
std::uint32_t growth_target(const Schedule& schedule, int iteration, std::uint32_t count,
                            std::uint32_t limit);

/// Splats that a row's target makes of `start`, for forecasts: at most twice as many in a round.
/// mean: the mean count over the run.
struct Growth {
    std::uint32_t end = 0;
    double mean = 0;
};
Growth simulate_growth(const Schedule& schedule, std::uint32_t start, std::uint32_t limit);

/// [iteration, 0 to options.iterations] splats on the way from the start to the end that is
/// forecast.
std::vector<double> growth_path(const Schedule& schedule, std::uint32_t start, std::uint32_t end);

// Forecasts of strategies that have a target.
std::uint32_t simulated_end(const Schedule& schedule, const GrowthStart& start);
double simulated_mean(const Schedule& schedule, std::uint32_t start, std::uint32_t end);
std::uint64_t end_at_once(const Schedule& schedule, int iteration, double start, std::uint32_t end);
/// Rounds of density control from this one to the last, both counted; at least 1.
int rounds_left(const Schedule& schedule, int iteration);

/// One row of the table.
struct StrategyRow {
    std::string_view name;
    std::string_view summary;  // for people, a few words
    StrategyDefaults defaults;

    /// Settings that nothing else reads, by their names in a checkpoint.
    std::vector<std::string_view> settings = {};
    bool has_setting(std::string_view setting) const {
        return std::find(settings.begin(), settings.end(), setting) != settings.end();
    }

    /// It resets opacities, and the schedule of 3DGS means something with it.
    bool follows_3dgs = false;
    /// Splats grow to a number that is given, or that the first row is forecast to end with.
    bool grows_to_limit = true;
    /// Once growth is over, splats go from time to time that nothing draws any more. Where a number
    /// was asked for, they stay.
    bool drops_undrawn = false;
    /// The first round takes most of a random start.
    bool prunes_random_start = true;

    /// Splats after the round of this iteration, for `count` before it and at most `limit` in the
    /// end; the limit where it has no target.
    std::uint32_t (*target)(const Schedule& schedule, int iteration, std::uint32_t count,
                            std::uint32_t limit);
    // Forecasts: splats at the end; the mean count over the run; the most up to an iteration.
    std::uint32_t (*forecast_end)(const Schedule& schedule,
                                  const GrowthStart& start) = simulated_end;
    double (*forecast_mean)(const Schedule& schedule, std::uint32_t start,
                            std::uint32_t end) = simulated_mean;
    std::uint64_t (*forecast_until)(const Schedule& schedule, int iteration, double start,
                                    std::uint32_t end) = end_at_once;

    /// Device memory between rounds.
    std::uint64_t (*device_bytes)(int kernel);
    std::unique_ptr<DensityStrategy> (*make)(const StrategySetup& setup);
};

const StrategyRow& strategy_row(Strategy strategy);
std::string_view strategy_name(Strategy strategy);
std::optional<Strategy> strategy_from_name(std::string_view name);
std::vector<Strategy> all_strategies();
/// Their names as people list them: "adc, mcmc or budget".
std::string strategy_names();

}  // namespace darb
