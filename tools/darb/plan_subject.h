// What darb plan looks at: a data set to train on or a scene to render, with its plan and what
// frames or iterations of it cost.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/plan/effect_plan.h"
#include "engine/scene/splat_model.h"
#include "engine/scene/stored_units.h"
#include "tools/darb/kernel_flags.h"
#include "tools/darb/plan_price.h"
#include "tools/darb/plan_probe.h"

namespace darb {

struct PlanFlags {
    std::filesystem::path what, cameras, json;
    std::string device, effects = "auto";
    bool quiet = false, no_price = false, compare = false, depth = false, probe = false;
    int probe_iterations = 400;
    std::optional<int> sh_degree;
    KernelFlags kernel;
    DatasetOptions data;
    StoredUnits units;  // of a scene
};

struct PlanSubject {
    bool training = false;
    SplatModel model;  // of a scene, as are the views of --cameras
    std::vector<View> views;
    Dataset dataset;  // of training
    std::vector<ImageU8> photos;
};

/// Throws Error where the path cannot be read or a flag is for the other kind.
PlanSubject open_subject(const PlanFlags& flags);
int degree_of(const PlanSubject& s, const PlanFlags& flags);
EffectPlan plan_of(const PlanSubject& s, const PlanFlags& flags, const EffectChoice& choice);
/// Those of EFFECT_COUNT that can be on or off for this subject.
std::vector<int> switchable_effects(const PlanSubject& s, const PlanFlags& flags);
/// Of a data set, see plan_probe.h.
AntialiasProbe probe_subject(const PlanSubject& s, const PlanFlags& flags, const EffectPlan& plan);
/// Of shapes where the kernel to train with has some, of grids where exposure is on.
std::vector<Trial> try_on_subject(const PlanSubject& s, const PlanFlags& flags,
                                  const EffectPlan& plan);
/// On the device that the flags name; a scene without cameras is looked at from around it.
Measured measure_subject(const PlanSubject& s, const PlanFlags& flags, const EffectPlan& plan);

}  // namespace darb
