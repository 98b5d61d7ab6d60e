// SPDX-License-Identifier: MIT
// What `darb train` prints before it trains: the data set, the device and a forecast.
#pragma once

#include "engine/gpu/device.h"
#include "trainer/job/job.h"

namespace darb {

/// Prints views, notes, and the forecast of splats, time and memory on this device, which takes a
/// few seconds; a quiet run prints only warnings. The forecast of the pace is also kept in the job,
/// even for a quiet run, because run.jsonl records it.
void print_plan(Device& device, TrainJob& job, bool quiet);

/// Prints a note before find_start(), which takes about a second of one core for each photo.
void say_stereo_begins();

}  // namespace darb
