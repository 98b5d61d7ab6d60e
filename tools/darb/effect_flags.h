// --effects and what goes with it, for train, render, view, eval and plan.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "engine/plan/effect_plan.h"
#include "trainer/job/job.h"

namespace darb {

/// Adds --effects.
void add_effects_flag(CLI::App& command, std::string& text);

/// Adds --lens.
void add_lens_flag(CLI::App& command, DatasetOptions& data);

/// The words of --effects; without lenses the photos of data are straightened at load. Throws Error
/// where they cannot be read, ask for an effect that the use cannot have, or contradict --lens.
EffectChoice choose_effects(const std::string& text, EffectUse use, DatasetOptions& data);

}  // namespace darb
