// Short training runs side by side, for the probes of darb plan.
#pragma once

#include <vector>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/plan/antialias_probe.h"
#include "engine/scene/splat_model.h"
#include "trainer/options/options.h"

namespace darb {

struct Arm {
    ProbedRun run;
    SplatModel model;
    std::vector<double> turns_s;  // all but the first, in which shaders are compiled
};

/// Runs of these options side by side, a few iterations of each in turn, the order of turns
/// changing: what the machine does meanwhile falls on all of them alike.
std::vector<Arm> train_arms(Device& device, const Dataset& dataset,
                            const std::vector<ImageU8>& photos,
                            const std::vector<TrainOptions>& options);

/// By how much a turn of `other` takes longer than one of `one`: the median, which a turn that
/// compiles does not move.
double price_of(const Arm& one, const Arm& other);

}  // namespace darb
