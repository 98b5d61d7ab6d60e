// SPDX-License-Identifier: MIT
// What each effect of a plan costs on this device: the same work with it and without it.
#pragma once

#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "engine/gpu/device.h"
#include "engine/plan/effect_plan.h"
#include "trainer/options/options.h"

namespace darb {

struct EffectPrice {
    // the time with the effect less the time without it, for a frame or a training iteration
    double ms = 0;
    std::int64_t bytes = 0;  // device memory, also with less without
    double spread_ms = 0;    // spread of the difference; a smaller price is noise
};
using EffectPrices = std::vector<std::optional<EffectPrice>>;  // [EFFECT_COUNT]

struct Measured {
    double ms = 0, spread_ms = 0;  // median, and half the width of the middle half
    std::uint64_t bytes = 0;       // peak of device memory
    std::uint32_t huge_splats = 0, longest_list = 0;  // the largest of any frame
};

/// Measures frames of up to 4 views, drawn in turn.
Measured measure_rendering(const DeviceOptions& device, const SplatModel& model,
                           const std::vector<View>& views, const EffectPlan& plan);
/// Measures iterations on the first views at the start of the run.
Measured measure_training(const DeviceOptions& device, const Dataset& dataset,
                          const TrainOptions& options, const EffectPlan& plan);

/// Switches each of `effects` in turn and measures with `with(plan)`. base: what was measured for
/// the plan itself. The other effects get no value.
EffectPrices price_effects(const EffectPlan& plan, const Measured& base,
                           const std::vector<int>& effects, int most_degree,
                           const std::function<Measured(const EffectPlan&)>& with);

/// Prints a row for each effect, with its price where there is one.
void print_priced(std::FILE* out, const EffectPlan& plan, const EffectPrices& prices,
                  bool training);
nlohmann::json priced_json(const EffectPlan& plan, const EffectPrices& prices);

}  // namespace darb
