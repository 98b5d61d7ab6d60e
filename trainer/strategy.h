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

/// Sets options.strategy and what it has other defaults for: the opacity and the scale at the
/// start, the opacity below which a splat goes, its decay, how often harmonics make a step. adc:
/// those of TrainOptions.
void use_strategy(Strategy strategy, TrainOptions& options);

/// What 3DGS does where the defaults depart from it (ARCHITECTURE says why they do): constant rates
/// but the position's, those of its paper, pruning below 0.005, no regularisers, one background,
/// the same lengths for every kernel, no largest scale, whole photos from the start, no mean.
/// Effects are not part of it: 3DGS has harmonics by the iteration, +sh, and neither anti-aliasing
/// nor exposure.
void use_3dgs_schedule(TrainOptions& options);

/// Splats after the round of this iteration, for `count` before it and at most `limit` in the end:
/// mcmc grows by 5 %; budget comes to the limit with the last round, the gap closing as a parabola,
/// fast at first. Never below count for mcmc; adc has no target: the limit.
std::uint32_t growth_target(const TrainOptions& options, int iteration, std::uint32_t count,
                            std::uint32_t limit);

/// Whether density control has a round after this iteration.
bool refines_after(const TrainOptions& options, int iteration);

/// Whether adc resets opacities after this iteration: every so many up to last_opacity_reset(),
/// and, as 3DGS does, where growth begins over a white background.
bool resets_after(const TrainOptions& options, int iteration);

/// Whether a round after this iteration prunes by size: as 3DGS does after its first opacity reset,
/// where there is a size to prune by.
bool prunes_by_size(const TrainOptions& options, int iteration);

/// Whether the regularisers act at this iteration on what its frame does not show too. A splat that
/// few photos show is worth less than one that many show: in sets of up to 50 photos at each, in
/// larger ones at 50 in a round of the photos, so that what ten of a thousand show stays; with mcmc
/// at each, as its authors do.
bool regularises_unseen(const TrainOptions& options, std::size_t photos, int iteration);

/// What growth_target makes of `start` splats up to an iteration, for forecasts: budget at most
/// doubles in a round. mean: the mean count over the run.
struct Growth {
    std::uint32_t end = 0;
    double mean = 0;
};
Growth simulate_growth(const TrainOptions& options, std::uint32_t start, std::uint32_t limit);

}  // namespace darb
