// SPDX-License-Identifier: MIT
// Strategy budget: adc steered to a number of splats. Those with the largest gradients on the
// screen grow, however small these are, as many as bring the count on its way.
#include <cfloat>

#include "trainer/growth/density_strategy.h"

namespace darb {

namespace {

// Reaches the limit with the last round; the gap closes as a parabola, fast at first.
std::uint32_t close_the_gap(const Schedule& schedule, int iteration, std::uint32_t count,
                            std::uint32_t limit) {
    if (count >= limit) return limit;
    const double rounds = rounds_left(schedule, iteration);
    const double stays = (rounds - 1) / rounds;
    return limit - static_cast<std::uint32_t>((limit - count) * stays * stays);
}

class Budget : public DensityStrategy {
  public:
    explicit Budget(const StrategySetup& setup) : schedule_(setup.schedule) {}

    DensityResult round(const DensityRound& r) override {
        gpu::DensifyArgs args = r.args;
        args.gradient_threshold = FLT_MIN;
        const std::uint32_t target =
            close_the_gap(schedule_, r.iteration, r.splats.count(), r.limit);
        return r.control.run(r.splats, r.gradient_sum, args, target, r.fixed);
    }

  private:
    Schedule schedule_;
};

}  // namespace

const StrategyRow& budget_row();
const StrategyRow& budget_row() {
    static const StrategyRow row{
        .name = "budget",
        .summary = "as adc, steered to a number of splats",
        .defaults = {},
        .follows_3dgs = true,
        .target = close_the_gap,
        .device_bytes = [](int) { return std::uint64_t{0}; },
        .make = [](const StrategySetup& setup) -> std::unique_ptr<DensityStrategy> {
            return std::make_unique<Budget>(setup);
        }};
    return row;
}

}  // namespace darb
