// SPDX-License-Identifier: MIT
#include "trainer/options/schedule.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/kernels/kernel_family.h"
#include "engine/scene/splat_model.h"
#include "shaders/shared/limits.h"

namespace darb {

namespace {

constexpr int kShortRun = 4'000;  // iterations
constexpr float kMostSpeedup = 5, kMostRateScale = 10;
constexpr std::size_t kPhotosThatBear = 50;

struct RampSize {
    int divisor;
    double until;  // share of the run
};
constexpr RampSize kRampSizes[] = {{4, 0.1}, {2, 0.3}};
constexpr int kSmallestSide = 100;     // px
constexpr int kKernelSampleEvery = 8;  // iterations
// Drops of undrawn splats, in rounds of density control.
constexpr int kRoundsADrop = 5;

// A run that is shorter than kShortRun is that run in fast motion, at most kMostSpeedup times.
float speedup_of(const TrainOptions& o) {
    const float times = float(kShortRun) / static_cast<float>(std::max(o.iterations, 1));
    return o.speed_up_short_runs ? std::clamp(times, 1.0f, kMostSpeedup) : 1.0f;
}

// Scales the rates of what would not settle in a run shorter than the 30,000 iterations of 3DGS.
float rate_scale_of(const TrainOptions& o) {
    return std::sqrt(std::max(1.0f, 30'000.0f / static_cast<float>(std::max(o.iterations, 1))));
}

int sped_up(std::optional<int> given, int usual, float speedup) {
    return given ? *given : static_cast<int>(std::lround(static_cast<float>(usual) / speedup));
}

// Harmonics above the first band: of steps of the mean of so many iterations.
float rest_rate(const TrainOptions& o, int every) {
    float times = std::sqrt(static_cast<float>(every));
    const float rate_scale = rate_scale_of(o);
    if (o.speed_up_sh_rest) times *= std::min(rate_scale * rate_scale, kMostRateScale);
    return o.sh_dc_lr * std::min(1.0f, times / 20);
}

int rounds_end(const TrainOptions& o) {
    if (o.densify_until) return std::min(*o.densify_until, o.iterations);
    const StrategyDefaults& d = strategy_row(o.strategy).defaults;
    return std::min(o.iterations / d.rounds_of * d.rounds_part, d.rounds_latest);
}

// What is reset keeps twice the opacity that is pruned, as 3DGS does, and at least 0.01, its value,
// or twice what is drawn at all: what is not seen never comes back.
Schedule::Resets resets_of(const TrainOptions& o, float prune_opacity,
                           const Schedule::Rounds& rounds) {
    Schedule::Resets resets;
    resets.interval = o.opacity_reset_interval;
    const int last = rounds.end - (o.late_resets ? 1 : resets.interval);
    resets.last = std::max(last, 0) / resets.interval * resets.interval;
    const auto seen = static_cast<float>(2 * o.accuracy.value(kAlphaCutoff));
    resets.to = std::clamp(2.0f * prune_opacity, std::max(0.01f, seen), 0.9f);
    const bool first_round_follows = rounds.begin + rounds.interval < rounds.end;
    resets.at_begin = o.white_background && !o.random_background && first_round_follows;
    return resets;
}

}  // namespace

Schedule::Schedule(const TrainOptions& o) : options(o), last(o.iterations), speedup(speedup_of(o)) {
    if (o.batch < 1 || (o.batch & (o.batch - 1)) != 0)
        throw Error(fmt::format("--batch {}", o.batch), "is no power of two",
                    "Give 1, 2, 4, 8 and so on: gradients are added in pairs.");
    const StrategyDefaults& defaults = strategy_row(o.strategy).defaults;
    initial_opacity = o.initial_opacity.value_or(defaults.initial_opacity);
    initial_scale = o.initial_scale.value_or(defaults.initial_scale);
    prune_opacity = o.prune_opacity.value_or(defaults.prune_opacity);
    rest_every = o.sh_rest_every;
    undrawn_opacity =
        undrawn_below(std::min(o.accuracy.value(kAlphaCutoff), double{ALPHA_CUTOFF_DEFAULT}));

    degree_interval = sped_up(o.sh_interval, 1'000, speedup);
    rounds.begin = sped_up(o.densify_from, 500, speedup);
    rounds.interval = sped_up(o.densify_interval, 100, speedup);
    degree_interval = std::max(degree_interval, 1);
    rounds.interval = std::max(rounds.interval, 1);
    rounds.end = rounds_end(o);
    resets = resets_of(o, prune_opacity, rounds);
    average_begin = std::max(static_cast<int>(o.average_from * options.iterations), rounds.end);

    kernel_end = std::max(std::min(average_begin, options.iterations), 1);

    // A kernel that covers less of the picture than a Gaussian has its lengths longer, learns its
    // scales faster, and gains from a limit of them; a Gaussian loses with one.
    if (o.lengths_by_area) length_scale = std::max(1.0, equal_area_scale(o.kernel, o.footprint));
    largest_scale = o.largest_scale.value_or(length_scale > 1 ? 1.0f : 0.0f);

    const float rate_scale = rate_scale_of(o),
                first_position = o.position_lr_init.value_or(1.6e-4f * rate_scale);
    first.position = first_position;
    last_position_rate = o.position_lr_final.value_or(1.6e-6f * rate_scale);
    first.scale = o.scale_lr.value_or(0.005f * speedup) * (length_scale > 1 ? 1.5f : 1.0f);
    first.rotation = o.rotation_lr.value_or(0.001f * speedup);
    // The root of the speedup: with the whole, fewer splats and less time, but 0.8 dB less.
    first.opacity = o.opacity_lr.value_or(0.05f * std::sqrt(speedup));
    first.sh_dc = o.sh_dc_lr;
    first.shape = o.shape_lr.value_or(0.004f * speedup);
    first.sh_rest = rest_rate(o, rest_every);
    // A mean settles what large steps scatter.
    position_falls_for =
        o.position_lr_falls.value_or(averages() ? defaults.position_lr_falls : 1.0);
    last_share = o.final_lr_share.value_or(averages() ? 1.0 : 0.3);
}

int Schedule::step_end(int iteration) const {
    const int end = iteration / options.batch * options.batch + options.batch;
    return iteration < last ? std::min(end, last) : end;
}

double Schedule::position_rate(int iteration) const {
    const double t =
        std::clamp(double(iteration) / std::max(options.iterations, 1), 0.0, position_falls_for);
    const auto from = static_cast<float>(first.position);
    return std::exp((1 - t) * std::log(from) + t * std::log(last_position_rate));
}

Schedule::Rates Schedule::rates(int iteration) const {
    const double t = std::clamp(double(iteration) / std::max(options.iterations, 1), 0.0, 1.0);
    const auto late = static_cast<float>(std::pow(last_share, std::max(0.0, 2 * t - 1)));
    Rates now = first;
    now.position = position_rate(iteration);
    for (float* rate :
         {&now.scale, &now.rotation, &now.opacity, &now.shape, &now.sh_dc, &now.sh_rest})
        *rate *= late;
    return now;
}

double Schedule::exposure_rate(int iteration) const {
    const double t = std::clamp(double(iteration) / options.iterations, 0.0, 1.0);
    const float from = options.exposure_lr_init;
    return from * std::pow(options.exposure_lr_final / from, t);
}

int Schedule::sh_degree(int iteration) const {
    return std::min(options.sh_degree, iteration / degree_interval);
}

bool Schedule::refines_after(int iteration) const {
    return iteration > rounds.begin && iteration < rounds.end && iteration % rounds.interval == 0;
}

bool Schedule::resets_after(int iteration) const {
    if (!strategy_row(options.strategy).follows_3dgs || iteration <= 0) return false;
    return (resets.at_begin && iteration == rounds.begin) ||
           (iteration % resets.interval == 0 && iteration <= resets.last);
}

bool Schedule::prunes_by_size(int iteration) const {
    return options.prune_extent > 0 && iteration > resets.interval;
}

bool Schedule::regularises_unseen(std::size_t photos, int iteration) const {
    const auto interval = static_cast<int>((photos + kPhotosThatBear - 1) / kPhotosThatBear);
    return strategy_row(options.strategy).defaults.regularises_all ||
           iteration % std::max(interval, 1) == 0;
}

bool Schedule::averages_after(int iteration) const {
    const int interval = std::clamp(options.iterations / 160, 1, 10);
    return iteration > average_begin && (last - iteration) % interval == 0;
}

void Schedule::end_early(int iteration) {
    if (!averages()) {
        last = iteration;
        return;
    }
    if (iteration >= average_begin) return;
    const double of_mean = double(options.iterations - average_begin) / std::max(average_begin, 1);
    last = std::min(options.iterations,
                    iteration + std::max(1, static_cast<int>(iteration * of_mean)));
    average_begin = iteration;
}

bool Schedule::changes_kernel_after(int iteration) const {
    if (options.learn_kernel == 0 || iteration <= 0 ||
        iteration > std::min(kernel_end, average_begin))
        return false;
    const auto changes = [&](int until) {
        return std::int64_t{until} * options.learn_kernel / kernel_end;
    };
    return changes(iteration) > changes(iteration - 1);
}

bool Schedule::samples_kernel_at(int iteration) const {
    if (options.learn_kernel == 0 || iteration > std::min(kernel_end, average_begin)) return false;
    const int every = std::max(kKernelSampleEvery, options.batch);
    return (iteration - 1) % every == 0;
}

bool Schedule::drops_undrawn_after(int iteration) const {
    return strategy_row(options.strategy).drops_undrawn && rounds.end > rounds.begin &&
           iteration >= rounds.end && iteration <= average_begin && iteration < last &&
           iteration % (kRoundsADrop * rounds.interval) == 0;
}

int Schedule::last_change() const {
    return strategy_row(options.strategy).drops_undrawn ? std::max(rounds.end, average_begin)
                                                        : rounds.end;
}

std::vector<RampStep> Schedule::ramp_steps(int longest_side) const {
    std::vector<RampStep> steps;
    if (!options.resolution_ramp) return steps;
    int before = 0;
    for (const RampSize& size : kRampSizes) {
        const int until = static_cast<int>(size.until * options.iterations);
        if (longest_side < kSmallestSide * size.divisor || until == before) continue;
        steps.push_back({size.divisor, until - before});
        before = until;
    }
    return steps;
}

int Schedule::resolution_divisor(int iteration, int longest_side) const {
    for (const RampStep& step : ramp_steps(longest_side)) {
        if (iteration <= step.iterations) return step.divisor;
        iteration -= step.iterations;
    }
    return 1;
}

}  // namespace darb
