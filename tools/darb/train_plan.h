// What `darb train` does before it trains: the data set, cameras by COLMAP where there are none,
// and a forecast.
#pragma once

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "tools/darb/train_flags.h"

namespace darb {

/// Prints views, sizes, notes, and the forecast of splats, time and memory on this device.
void print_plan(Device& device, const Dataset& dataset, const TrainFlags& flags);

}  // namespace darb
