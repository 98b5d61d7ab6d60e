// SPDX-License-Identifier: MIT
// What `darb train` prints before it trains: the data set, the device and a forecast.
#pragma once

#include "engine/gpu/device.h"
#include "trainer/job/job.h"

namespace darb {

/// Prints views, notes, and the forecast of splats, time and memory on this device, which takes a
/// few seconds; for a quiet run only a warning. Leaves the forecast of the pace in the job, even
/// for a quiet run, as run.jsonl has it.
void print_plan(Device& device, TrainJob& job, bool quiet);

/// A note for find_start(), which takes about a second of a core for each photo.
void say_stereo_begins();

}  // namespace darb
