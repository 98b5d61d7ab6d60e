// The strategies by which splats grow in number, by name, with their defaults and their growth:
//   adc     clone, split and prune by the screen gradient, reset opacities (3DGS)
//   mcmc    move dead splats onto live ones, grow by 5 % a round, add noise (3DGS-MCMC,
//           arXiv 2404.09591)
//   budget  grow to a fixed count where the photos' error is, let opacities decay
#pragma once

#include <optional>
#include <string_view>

#include "trainer/options.h"

namespace darb {

std::string_view strategy_name(Strategy strategy);
std::optional<Strategy> strategy_from_name(std::string_view name);

/// What options take from the strategy where they are not given.
struct StrategyDefaults {
    float initial_opacity = 0.1f;
    float initial_scale = 1;  // times the distance to the neighbours
    // 3DGS prunes below 0.005, at an opacity rate of 0.025. These two leave 59,192 rather than
    // 80,811 splats on fox at 200 px after 2,000 iterations, and 27.47 rather than 26.75 dB on
    // held-out views.
    float prune_opacity = 0.1f;
    float opacity_decay = 0;
    int sh_rest_every = 1;
};
StrategyDefaults strategy_defaults(Strategy strategy);

/// What 3DGS does where the defaults depart from it (ARCHITECTURE says why they do): constant rates
/// but the position's, those of its paper, pruning below 0.005, no regularisers, one background,
/// the same lengths for every kernel, no largest scale, whole photos from the start, no mean.
/// Effects are not part of it: 3DGS has harmonics by the iteration, +sh, and neither anti-aliasing
/// nor exposure.
void use_3dgs_schedule(TrainOptions& options);

class Schedule;

/// Splats after the round of this iteration, for `count` before it and at most `limit` in the end:
/// mcmc grows by 5 %; budget comes to the limit with the last round, the gap closing as a parabola,
/// fast at first. Never below count for mcmc; adc has no target: the limit.
std::uint32_t growth_target(const TrainOptions& options, const Schedule& schedule, int iteration,
                            std::uint32_t count, std::uint32_t limit);

/// What growth_target makes of `start` splats up to an iteration, for forecasts: budget at most
/// doubles in a round. mean: the mean count over the run.
struct Growth {
    std::uint32_t end = 0;
    double mean = 0;
};
Growth simulate_growth(const TrainOptions& options, std::uint32_t start, std::uint32_t limit);

}  // namespace darb
