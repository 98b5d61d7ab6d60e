// SPDX-License-Identifier: MIT
// Forecast: what a training run will take on this device, from the data set's size and a few
// measured iterations.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/scene/splat_model.h"
#include "trainer/options/schedule.h"
#include "trainer/step/memory_plan.h"

namespace darb {

struct Forecast {
    std::uint32_t start_splats = 0;
    std::uint32_t splats = 0;         // at the end, within options.max_memory_bytes
    bool falls = false;               // the first round takes most of the start, which is random
    double start_ms = 0, end_ms = 0;  // an iteration at these counts; 0: not measured
    // Each of ramp_steps() at the count at the start, as far as they were measured.
    std::vector<double> ramp_ms;
    double seconds = 0;              // the whole run; 0: not measured
    double start_intersections = 0;  // a splat, of the photos that the start sees; 0: as seconds
    // At the end. Exact is what the plan makes of it; splats, intersections and degree are as
    // uncertain as the constants in the .cpp.
    MemoryDemand demand;
    // Where the run needs most memory: at the end, in the last rounds of density control, while the
    // ramp's smaller photos are there, or at the start, where that has more splats.
    MemoryDemand peak;
};

/// `start` split into pieces, at least as many as it has and at most `count`, which cover what it
/// covers: a stand-in for a trained scene of that size.
SplatModel split_model(const SplatModel& start, std::uint32_t count, std::uint64_t seed);

/// Runs some iterations on grey photos at the start's count and at the predicted one, a few
/// seconds in all; time is a + b * splats through both. measure = false, and where the device has
/// no room for that: splats and memory, and what was measured until then. scratch: a device of its
/// own, so that the run's peak_bytes stay the run's.
Forecast forecast_training(Device& scratch, const Dataset& dataset, const Schedule& schedule,
                           bool measure = true);

// Whether a run can begin at all: before anything is made for its first splats.

/// Bytes of host memory that this process may still take: what the system has left, within its own
/// limits (RLIMIT_AS); the most there is where nothing says.
std::uint64_t free_host_bytes();

/// Throws Error, with the number that fits, where the splats that a run begins with do not fit into
/// the device or the points that they come from not into `host_bytes`. What is counted is less than
/// what a run takes: it refuses only what cannot be.
void check_start_memory(const Device& device, const Dataset& dataset, const Schedule& schedule,
                        std::uint64_t host_bytes = free_host_bytes());

}  // namespace darb
