// SPDX-License-Identifier: MIT
// Strategy mcmc: dead splats move onto live ones, the number grows by 5 % a round, positions get
// noise. Source: 3DGS-MCMC, arXiv 2404.09591.
#include "trainer/growth/mcmc.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/core/rng.h"
#include "engine/kernels/relocation_table.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/primitives/groups.h"
#include "shaders/shared/kernel_forms.h"
#include "shaders/shared/strategy_args.h"
#include "trainer/growth/density_control.h"
#include "trainer/growth/density_strategy.h"

namespace darb {

namespace {

constexpr double kGrowthARound = 1.05;  // and more where that misses the limit

// The published noise is 5e5 lr Sigma in units of the scene, where the rate lr goes with the
// scene's extent and Sigma with its square: one scene in other units is another training. Here it
// is as published where the extent is 5, near which the scenes lie that it was published on (NeRF's
// synthetic cameras are 4 units from the centre), and follows the units.
constexpr double kNoiseExtent = 5;

// Never below count.
std::uint32_t grow_by_share(const Schedule& schedule, int iteration, std::uint32_t count,
                            std::uint32_t limit) {
    const double rounds = rounds_left(schedule, iteration);
    const double needed = std::pow(double(limit) / std::max(count, 1U), 1 / rounds);
    const double growth =
        schedule.options.max_splats ? std::max(kGrowthARound, needed) : kGrowthARound;
    const double grown = std::ceil(growth * count);
    return std::max(count, static_cast<std::uint32_t>(std::min<double>(grown, limit)));
}

class Mcmc : public DensityStrategy {
  public:
    explicit Mcmc(const StrategySetup& setup)
        : schedule_(setup.schedule),
          extent_(setup.extent),
          relocation_(setup.device, schedule_.options.kernel, schedule_.options.footprint) {}

    void record_after_update(const StepFrame& f) override {
        const double rate = schedule_.options.noise_lr * schedule_.position_rate(f.iteration) *
                            kNoiseExtent * kNoiseExtent / extent_ *
                            std::sqrt(static_cast<double>(schedule_.options.batch));
        const auto stream = 0x6E6F697Eull << 32 | static_cast<std::uint32_t>(f.iteration);
        Pcg32 random(schedule_.options.seed, stream);
        relocation_.record_noise(f.commands, f.splats, f.status, static_cast<float>(rate),
                                 schedule_.prune_opacity, random.next());
    }

    // The table is made for the next round, and not at all where none follows.
    void set_kernel(int kernel) override { next_kernel_ = kernel; }

    DensityResult round(const DensityRound& r) override {
        if (next_kernel_) relocation_.set_kernel(*next_kernel_, schedule_.options.footprint);
        next_kernel_.reset();
        const std::uint32_t count = r.splats.count();
        const std::uint32_t target = grow_by_share(schedule_, r.iteration, count, r.limit);
        return relocation_.run(r.splats, r.control,
                               {r.args.prune_opacity, target - count, r.args.seed, r.fixed});
    }

  private:
    Schedule schedule_;
    double extent_;
    Relocation relocation_;
    std::optional<int> next_kernel_;
};

}  // namespace

const StrategyRow& mcmc_row();
const StrategyRow& mcmc_row() {
    static const StrategyRow row{
        .name = "mcmc",
        .summary = "move dead splats onto live ones, add noise, as 3DGS-MCMC",
        // Its authors' values. The noise falls with the position's rate.
        .defaults = {.initial_opacity = 0.5f,
                     .initial_scale = 0.1f,
                     .prune_opacity = 0.005f,
                     .rounds_part = 5,
                     .rounds_of = 6,
                     .rounds_latest = 25'000,
                     .position_lr_falls = 1,
                     .regularises_all = true},
        .settings = {"noise_lr"},
        .prunes_random_start = false,
        .target = grow_by_share,
        .device_bytes = [](int kernel) { return Relocation::device_bytes(kernel); },
        .make = [](const StrategySetup& setup) -> std::unique_ptr<DensityStrategy> {
            return std::make_unique<Mcmc>(setup);
        }};
    return row;
}

namespace {

// Integer weight of opacity 1 for this many splats: their sum fits 32 bits with some room for
// float32's rounding.
float weight_scale(std::uint32_t splats) {
    return static_cast<float>(std::min(0.99 * 4'294'967'295.0 / splats, 16'777'216.0));
}

}  // namespace

Relocation::Relocation(Device& device, int kernel, Footprint footprint)
    : device_(&device), commands_(device) {
    const SpecConstants threads{{"THREADS", SPLAT_GROUP}};
    weight_ = Pipeline(device, "relocation_weight", threads);
    draw_ = Pipeline(device, "relocation_draw", threads);
    sources_ = Pipeline(device, "relocation_sources", threads);
    SpecConstants relocate = shape_row_constants(kernel);
    relocate["THREADS"] = SPLAT_GROUP;
    relocate_ = Pipeline(device, "relocate", relocate);
    noise_ = Pipeline(device, "position_noise", threads);
    table_ = Buffer(device, "relocation table", device_bytes(kernel));
    set_kernel(kernel, footprint);
}

void Relocation::set_kernel(int kernel, Footprint footprint) {
    table_.upload(relocation_table(kernel, footprint, RELOCATION_OPACITIES, RELOCATION_COUNTS));
}

std::uint64_t Relocation::device_bytes(int kernel) {
    const std::uint64_t row = std::uint64_t{RELOCATION_OPACITIES} * RELOCATION_COUNTS;
    return row * (kernel_has_shape(kernel) ? SHAPE_ROWS : 1) * sizeof(float);
}

DensityResult Relocation::run(GpuSplats& splats, DensityControl& density,
                              const RelocationRound& round) {
    const std::uint32_t grown = round.grown;
    const std::uint32_t n = splats.count();
    DensityResult result{n, n, 0, 0};
    if (n == 0) return result;
    Device& d = *device_;
    const std::uint64_t bytes = std::uint64_t{n} * 4;
    Buffer dead(d, "dead", bytes), weight(d, "weight", bytes), copies(d, "copies", bytes);
    Buffer dead_offset(d, "dead offset", bytes), weight_offset(d, "weight offset", bytes);
    Buffer count(d, "relocation count", 4), dead_total(d, "dead total", 4),
        weight_total(d, "weight total", 4);
    Scan scan(d, n);
    const Groups g = groups_for(n);
    gpu::RelocationArgs args{n, n, 0, 0, round.dead_opacity, weight_scale(n), round.seed};
    commands_.begin();
    commands_.pass("relocate");
    commands_.fill(count, n);
    commands_.dispatch(weight_, args, {splats.parameters(kOpacityLogit), dead, weight, copies}, g.x,
                       g.y);
    keep_frozen(commands_, splats.frozen(), {{&dead, 0}, {&weight, 0}});
    if (!round.fixed.empty()) {
        commands_.submit_and_wait();
        clear_words(round.fixed, weight);
        commands_.begin();
        commands_.pass("relocate");
    }
    scan.record(commands_, dead, dead_offset, count, 0, dead_total);
    scan.record(commands_, weight, weight_offset, count, 0, weight_total);
    commands_.submit_and_wait();

    args.dead_count = dead_total.download<std::uint32_t>(1)[0];
    args.weight_total = weight_total.download<std::uint32_t>(1)[0];
    const std::uint32_t draws = args.dead_count + grown;
    if (draws == 0 || args.weight_total == 0) return result;
    args.splats_after = n + grown;
    result = {n, args.splats_after, args.dead_count, grown};

    Buffer drawn(d, "drawn", std::uint64_t{draws} * 4);
    Buffer sources(d, "densify sources", std::uint64_t{args.splats_after} * 8);
    const Groups each_draw = groups_for(draws), after = groups_for(args.splats_after);
    commands_.begin();
    commands_.pass("relocate");
    commands_.dispatch(draw_, args, {weight_offset, drawn, copies}, each_draw.x, each_draw.y);
    commands_.dispatch(sources_, args, {dead, dead_offset, drawn, copies, sources}, after.x,
                       after.y);
    commands_.submit_and_wait();
    density.move(splats, sources, args.splats_after);
    commands_.begin();
    commands_.pass("relocate");
    commands_.dispatch(relocate_, args,
                       {sources, copies, table_, splats.parameters(kLogScale),
                        splats.parameters(kOpacityLogit), splats.parameters(kShape)},
                       after.x, after.y);
    commands_.submit_and_wait();
    return result;
}

void Relocation::record_noise(Commands& commands, GpuSplats& splats, const Buffer& status,
                              float rate, float dead_opacity, std::uint32_t seed) {
    const std::uint32_t n = splats.trained_count();
    if (n == 0 || rate <= 0) return;
    const Groups g = groups_for(n);
    commands.pass("position noise");
    commands.dispatch(noise_, gpu::NoiseArgs{n, seed, rate, dead_opacity},
                      {splats.trained(splats.parameters(kPosition), 3),
                       splats.trained(splats.parameters(kLogScale), 3),
                       splats.trained(splats.parameters(kRotation), 4),
                       splats.trained(splats.parameters(kOpacityLogit), 1), status},
                      g.x, g.y);
}

}  // namespace darb
