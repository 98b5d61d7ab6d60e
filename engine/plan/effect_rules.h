// The rules of the effect plan that have a file of their own. Of engine/plan only.
#pragma once

#include "engine/plan/effect_plan.h"

namespace darb {

/// Near-plane care for pictures of a model through these cameras. O(splats times cameras), on all
/// cores. near_plane: world units; splats before it take no part.
EffectRow near_rule(const SplatModel& model, const std::vector<View>& views, float near_plane);

}  // namespace darb
