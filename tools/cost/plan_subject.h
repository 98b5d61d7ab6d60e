// SPDX-License-Identifier: MIT
// What a plan is made for, either a data set to train on or a scene to render; with its plan, and
// with what frames or iterations of it cost.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/dataset.h"
#include "engine/plan/effect_plan.h"
#include "engine/scene/splat_model.h"
#include "engine/scene/stored_units.h"
#include "tools/cost/effect_prices.h"

namespace darb {

struct PlanRequest {
    std::filesystem::path what;     // a data set, a scene, or the output folder of a run
    std::filesystem::path cameras;  // scenes: the cameras that will look at it
    std::string device, effects = "auto";
    bool depth = false;            // scenes: depth images are wanted, too
    std::optional<int> sh_degree;  // data sets, as is the kernel
    std::optional<int> kernel;
    DatasetOptions data;
    StoredUnits units;  // scenes
};

struct PlanSubject {
    bool training = false;
    SplatModel model;  // set for scenes, as are the views of its cameras
    std::vector<View> views;
    Dataset dataset;  // set for training
    std::vector<ImageU8> photos;
};

/// Opens what the request names and prints the readers' notes. Throws Error where the path cannot
/// be read or an option is for the other kind.
PlanSubject open_subject(const PlanRequest& request);
int degree_of(const PlanSubject& s, const PlanRequest& request);
EffectPlan plan_of(const PlanSubject& s, const PlanRequest& request, const EffectChoice& choice);
/// The effects, of EFFECT_COUNT, that can be on or off for this subject.
std::vector<int> switchable_effects(const PlanSubject& s, const PlanRequest& request);
/// The data set as a run under this plan sees it, through the lenses where the plan keeps them.
Dataset planned_dataset(const PlanSubject& s, const PlanRequest& request, const EffectPlan& plan);
/// Measures on the device of the request; a scene without cameras is looked at from around it.
Measured measure_subject(const PlanSubject& s, const PlanRequest& request, const EffectPlan& plan);

// The views that `darb cost` measures on: those of a data set, with their photos, or eight around
// the splats.

struct CostViews {
    std::vector<Camera> cameras;
    std::vector<std::string> names;
    std::vector<ImageU8> photos;  // RGBA, as load_photo gives them; empty without a data set
    bool alpha_is_mask = false;
};

/// Up to `most` test views, evenly picked, or of all views where none is held out. Views of an arc
/// are taken only where there are no others. Loads the photos.
CostViews dataset_views(const Dataset& dataset, size_t most);

/// `count` cameras on a circle that look slightly down (y is down) at the splats' centre, from far
/// enough away to have nine tenths of the opacity in the picture. The model must have at least one
/// splat.
CostViews orbit_views(const SplatModel& model, int count, int width, int height);

}  // namespace darb
