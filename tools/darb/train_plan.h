// What `darb train` prints before it trains: the data set, the device and a forecast.
#pragma once

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "tools/darb/train_flags.h"

namespace darb {

/// Prints views, notes, and the forecast of splats, time and memory on this device, which takes a
/// few seconds; nothing with --quiet. Leaves the forecast of the pace in flags.run.
void print_plan(Device& device, const Dataset& dataset, TrainFlags& flags);

}  // namespace darb
