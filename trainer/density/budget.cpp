// Strategy budget: grow to a fixed count where the photos' error is, let opacities decay. Sources:
// see error_score.h.
#include <fmt/format.h>

#include <algorithm>
#include <cfloat>

#include "engine/core/error.h"
#include "trainer/density/density_strategy.h"
#include "trainer/density/error_score.h"

namespace darb {

namespace {

constexpr int kScoresPerRound = 10;  // photos of a round that are scored

// To the limit with the last round, the gap closing as a parabola, fast at first.
std::uint32_t close_the_gap(const TrainOptions&, const Schedule& schedule, int iteration,
                            std::uint32_t count, std::uint32_t limit) {
    if (count >= limit) return limit;
    const double rounds = rounds_left(schedule, iteration);
    const double stays = (rounds - 1) / rounds;
    return limit - static_cast<std::uint32_t>((limit - count) * stays * stays);
}

class Budget : public DensityStrategy {
  public:
    explicit Budget(const StrategySetup& setup)
        : options_(setup.options), schedule_(setup.schedule), score_(setup.device, setup.photos) {
        score_.reset(setup.splats);
    }

    // Evenly over the iterations between two rounds; with few, in each.
    void record_before_loss(const StepFrame& f) override {
        const int interval = std::max(1, schedule_.rounds.interval / kScoresPerRound);
        if (f.iteration >= schedule_.rounds.end || f.iteration % interval != 0) return;
        score_.record(f.commands, f.view, f.frame, f.backward,
                      {f.image, f.photo, f.d_image, f.scores}, f.splats.count());
    }

    void record_scores(Commands& commands, const Buffer& scores, const Buffer& status,
                       std::uint32_t splats) override {
        score_.record_sum(commands, scores, status, splats);
    }

    DensityResult round(const DensityRound& r) override {
        const std::uint32_t target =
            close_the_gap(options_, schedule_, r.iteration, r.splats.count(), r.limit);
        gpu::DensifyArgs args = r.args;
        args.gradient_threshold = FLT_MIN;  // whatever has a share may grow, the largest first
        const DensityResult result = r.control.run(r.splats, score_.shares(), args, target);
        if (schedule_.opacity_decay > 0)
            r.control.decay_opacity(r.splats, 1.0f - schedule_.opacity_decay);
        score_.reset(r.splats.count());
        return result;
    }

    std::vector<float> state(std::uint32_t splats) const override { return score_.state(splats); }

    void restore(std::uint32_t splats, const std::vector<float>& state) override {
        score_.reset(splats);
        if (state.empty()) return;
        if (state.size() != std::size_t{splats} * 2)
            throw Error("budget",
                        fmt::format("{} error shares for {} splats", state.size(), splats),
                        "Restore what state() gave.");
        score_.restore(state);
    }

  private:
    TrainOptions options_;
    Schedule schedule_;
    ErrorScore score_;
};

}  // namespace

const StrategyRow& budget_row();
const StrategyRow& budget_row() {
    static const StrategyRow row{
        .name = "budget",
        .summary = "grow to a number of splats where the photos' error is",
        .defaults = {.opacity_decay = 0.01f, .sh_rest_every = 16},
        .settings = {"opacity_decay"},
        .target = close_the_gap,
        .scores_views = true,
        .device_bytes =
            [](const StrategySize& size) {
                return ErrorScore::device_bytes(size.splats, size.pixels, size.list_segments);
            },
        .make = [](const StrategySetup& setup) -> std::unique_ptr<DensityStrategy> {
            return std::make_unique<Budget>(setup);
        }};
    return row;
}

}  // namespace darb
