// Forecast: what a training run will take on this device, from the data set's size and a few
// measured iterations.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/scene/splat_model.h"
#include "trainer/memory_plan.h"
#include "trainer/options.h"
#include "trainer/strategy.h"

namespace darb {

struct Forecast {
    std::uint32_t start_splats = 0;
    std::uint32_t splats = 0;         // at the end, within options.max_memory_bytes
    bool falls = false;               // the first round takes most of the start, which is random
    double start_ms = 0, end_ms = 0;  // an iteration at these counts; 0: not measured
    std::vector<double> ramp_ms;      // of each of ramp_steps(), at the count at the start, as far
                                      // as they were measured
    double seconds = 0;               // of the whole run; 0: not measured
    double start_intersections = 0;   // a splat, of the photos that the start sees; 0: as seconds
    // At the end. Exact is what the plan makes of it; splats, intersections and degree are as
    // uncertain as the constants in the .cpp.
    MemoryDemand demand;
    // Where the run needs most memory: at the end, in the last rounds of density control, while the
    // ramp's smaller photos are there, or at the start, where that has more splats.
    MemoryDemand peak;
};

/// Splats at the end: by the strategy's rule of thumb.
std::uint32_t predict_splats(const TrainOptions& options, const GrowthStart& start);

/// Whether training photos wait on the host and stream: as Tuning::photos says, else where a run
/// from so many splats has no room for them. A device with memory of its own has it where all that
/// the run is forecast to come to fits into options.max_memory_bytes, or the most of the device
/// that a run can hope for. Where host and device share theirs streaming frees nothing, and a
/// budget alone calls for it, where it does not hold the start. photos: as add_photos gives them.
bool photos_stream(const Device& device, const Dataset& dataset, const TrainOptions& options,
                   const MemoryDemand& photos, std::uint32_t start_splats);
/// Of the device's memory, what a run can hope to have.
std::uint64_t usable_bytes(const DeviceInfo& info);

/// The degree of colour that a run has after so many iterations, where options.probe_sh does not
/// refuse the first.
int predict_degree(const TrainOptions& options, int iterations);

/// The count that a strategy grows to where no --max-splats is given: what adc would be forecast to
/// end with from its points, or from random ones where there are none.
std::uint32_t default_budget(const Dataset& dataset, const TrainOptions& options);

/// Mean count over the run; adc: where it grows evenly while density control runs.
double mean_splats(std::uint32_t start, std::uint32_t end, const TrainOptions& options);

/// `start` split into pieces, at least as many as it has and at most `count`, which cover what it
/// covers: a stand-in for a trained scene of that size.
SplatModel split_model(const SplatModel& start, std::uint32_t count, std::uint64_t seed);

/// Runs some iterations on grey photos at the start's count and at the predicted one, a few
/// seconds in all; time is a + b * splats through both. measure = false, and where the device has
/// no room for that: splats and memory, and what was measured until then. scratch: a device of its
/// own, so that the run's peak_bytes stay the run's.
Forecast forecast_training(Device& scratch, const Dataset& dataset, const TrainOptions& options,
                           bool measure = true);

}  // namespace darb
