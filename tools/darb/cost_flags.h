// The command line of `darb cost`.
#pragma once

#include <filesystem>
#include <string>

#include "engine/data/dataset.h"
#include "engine/ranks/ranks.h"
#include "engine/scene/stored_units.h"
#include "tools/darb/kernel_flags.h"
#include "tools/darb/tune_flags.h"

namespace darb {

struct CostFlags {
    std::string scene, dataset, device, train, train_options;
    int seeds = 0, iterations = 0;
    std::filesystem::path json, html;
    bool quick = false, full = false, quiet = false, white_background = false;
    DatasetOptions data;
    TuneFlags tune;
    KernelFlags kernel;  // in the place of the scene's
    std::string size = "640x480";
    StoredUnits units;  // of the scene
};

/// darb cost --train DATASET
int train_cost(Ranks& ranks, const CostFlags& flags);

}  // namespace darb
