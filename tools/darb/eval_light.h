// The --light-share of darb eval: which share of its pictures' light comes from splats that few
// training views see. Photos do not prove these; off the path they show as fog and needles.
#pragma once

#include <cstdio>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/plan/effect_plan.h"
#include "engine/scene/splat_model.h"

namespace darb {

constexpr std::uint32_t kFewViews = 3;  // fewer are few

struct LightOfView {
    std::string name;
    double share = 0;  // 0 to 1
};

struct LightReport {
    std::size_t few = 0, splats = 0;  // few: of the splats, those that few training views see
    std::vector<LightOfView> views;
    std::optional<double> mean, arc, off_path;  // arc: where other views are there, mean is of them
};

/// all: of the data set; those that are not held out see the splats. views: to measure, as are
/// off_path, which may be empty. At the size that the views have, with the default accuracy.
LightReport measure_light(Device& device, const SplatModel& model, const EffectChoice& effects,
                          const std::vector<View>& all, const std::vector<View>& views,
                          const std::vector<View>& off_path);

/// Prints it; returns the same as JSON.
nlohmann::json told_light(std::FILE* out, const LightReport& light);

}  // namespace darb
