// SPDX-License-Identifier: MIT
// Rules that say which splats a scene can do without: parts that touch nothing else, haze, what
// floats in free space, what few cameras show, and all that lies outside a region. `darb clean` and
// the end of a training run apply them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/gpu/device.h"
#include "engine/render/renderer.h"
#include "engine/scene/camera.h"
#include "engine/scene/clutter.h"
#include "engine/scene/region.h"
#include "engine/scene/splat_model.h"

namespace darb {

struct CleaningRules {
    double isolated = 0;                     // isolated_splats(), share; 0: off
    double haze_opacity = 0, haze_size = 0;  // hazy_splats(); a size of 0: off
    std::uint32_t free_space = 0;            // FreeSpaceOptions::least_views; 0: off
    std::uint32_t few_views = 0;             // splats seen, but in fewer views, go; 0: off
    std::optional<Region> region = {};       // what lies outside goes
    bool any() const {
        return isolated > 0 || haze_size > 0 || free_space > 0 || few_views > 0 || region;
    }
};

/// Reads OPACITY,SIZE, such as 0.1,5, into the rules. Throws Error naming the option.
void take_haze(const std::string& option, const std::string& text, CleaningRules& rules);

/// The splats that one rule removes.
struct ClutterOfRule {
    std::string rule;  // "outside the region", "isolated parts", "haze", "in free space" or
                       // "seen by few"; "together"
    SplatSet set;
    double light = 0;  // their share of a picture's light, 0 to 1, the mean over the cameras
};

/// What each rule removes, and what all of them together do.
struct Clutter {
    std::vector<ClutterOfRule> rules;
    ClutterOfRule together;
};

/// cameras: those by which the rules judge; to measure light, pictures wider than 480 px are scaled
/// down. renderer makes one of this model, and is called only for the rule on free space. progress
/// gets the share that is done of that rule, 0 to 1, as it takes longest; it may be empty.
Clutter find_clutter(Device& device, const SplatModel& model, const std::vector<Camera>& cameras,
                     const CleaningRules& rules,
                     const std::function<std::unique_ptr<Renderer>()>& renderer,
                     const std::function<void(double)>& progress = {});

}  // namespace darb
