// RunTotals: what a run counts over its iterations.
#pragma once

#include <string>
#include <vector>

#include "trainer/step.h"
#include "trainer/trainer_state.h"

namespace darb {

/// Milliseconds of a pass, summed over `iterations`.
struct PassTotal {
    std::string name;
    double ms = 0;
};

struct RunTotals {
    TrainCounters counters;
    std::vector<PassTotal> passes;
    std::uint64_t timed_iterations = 0;

    /// Its counters.
    void count(const StepOutcome& outcome);
    /// The times of its passes.
    void add_times(const StepOutcome& outcome);
};

/// Throws Error where so many gradients of these splats are not finite that something is broken.
void check_gradients(const StepOutcome& outcome, std::uint32_t splat_count);

}  // namespace darb
