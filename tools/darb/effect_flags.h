// --effects and what goes with it, for train, render, view, eval and plan.
#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/plan/effect_plan.h"
#include "trainer/options.h"

namespace darb {

/// Adds --effects.
void add_effects_flag(CLI::App& command, std::string& text);

/// Adds --lens.
void add_lens_flag(CLI::App& command, DatasetOptions& data);

/// The words of --effects; without lenses the photos of data are straightened at load. Throws Error
/// where they cannot be read, ask for an effect that the use cannot have, or contradict --lens.
EffectChoice choose_effects(const std::string& text, EffectUse use, DatasetOptions& data);

/// Whether --effects turns exposure on, or refined cameras.
bool asks_for_exposure(const std::string& text);
bool refuses_exposure(const std::string& text);
/// The same changes, with exposure.
std::string with_exposure(const std::string& text);
bool asks_for_cameras(const std::string& text);

/// A row an effect: name, on, overridden, measured, reason.
nlohmann::json plan_json(const EffectPlan& plan);

/// The run as the plan wants it.
void apply_plan(const EffectPlan& plan, TrainOptions& options);

}  // namespace darb
