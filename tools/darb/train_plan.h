// What `darb train` prints before it trains: the data set, the device and a forecast.
#pragma once

#include "engine/gpu/device.h"
#include "tools/darb/train_flags.h"
#include "trainer/job/job.h"

namespace darb {

/// Prints views, notes, and the forecast of splats, time and memory on this device, which takes a
/// few seconds; with --quiet nothing but a warning. Leaves the forecast of the pace in the job,
/// with
/// --quiet too, as run.jsonl has it.
void print_plan(Device& device, TrainJob& job, const TrainFlags& flags);

/// A note for find_start(), which takes about a second of a core for each photo.
void say_stereo_begins();

}  // namespace darb
