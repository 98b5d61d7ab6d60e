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
    double ms = 0;  // with the effect less without it; a frame, or an iteration of training
    std::int64_t bytes = 0;  // of device memory, likewise
    double spread_ms = 0;    // of the difference: below it the price is noise
};
using EffectPrices = std::vector<std::optional<EffectPrice>>;  // [EFFECT_COUNT]

struct Measured {
    double ms = 0, spread_ms = 0;                     // median and half of the middle half's width
    std::uint64_t bytes = 0;                          // peak of device memory
    std::uint32_t huge_splats = 0, longest_list = 0;  // the most of any frame
};

/// Frames of up to 4 views, drawn in turn.
Measured measure_rendering(const DeviceOptions& device, const SplatModel& model,
                           const std::vector<View>& views, const EffectPlan& plan);
/// Iterations on the first views at the start of the run.
Measured measure_training(const DeviceOptions& device, const Dataset& dataset,
                          const TrainOptions& options, const EffectPlan& plan);

/// Switches each of `effects` in turn. with(plan) measures; base: what it said of the plan itself.
/// No value for the other effects.
EffectPrices price_effects(const EffectPlan& plan, const Measured& base,
                           const std::vector<int>& effects, int most_degree,
                           const std::function<Measured(const EffectPlan&)>& with);

/// A row an effect, with its price where there is one.
void print_priced(std::FILE* out, const EffectPlan& plan, const EffectPrices& prices,
                  bool training);
nlohmann::json priced_json(const EffectPlan& plan, const EffectPrices& prices);

}  // namespace darb
