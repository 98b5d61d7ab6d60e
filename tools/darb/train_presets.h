// What the presets of `darb train` take on a device.
#pragma once

#include "engine/gpu/device.h"
#include "tools/darb/train_flags.h"
#include "trainer/job/job.h"
#include "trainer/run/forecast.h"

namespace darb {

/// Prints how long the preset of a run and those below it take here, and of a bare run that is slow
/// what to type instead; nothing where --iterations was given. chosen: the forecast of the run.
/// Measures each for a few seconds.
void print_presets(Device& scratch, const TrainJob& job, const TrainFlags& flags,
                   const Forecast& chosen);

}  // namespace darb
