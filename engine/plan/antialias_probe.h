// AntialiasProbe: what anti-aliasing gained in a trial, at the size that was trained on and at
// others, and what a plan makes of it.
#pragma once

#include <cstddef>
#include <vector>

#include "engine/plan/effect_plan.h"

namespace darb {

struct ProbedSize {
    double scale = 1;                    // of the sides of what was trained on
    int width = 0, height = 0;           // px, of the first view
    double without_db = 0, with_db = 0;  // mean PSNR of the held-out photos
};

struct ProbedRun {
    double seconds = 0;
    std::size_t splats = 0;
};

struct AntialiasProbe {
    int iterations = 0;
    ProbedRun without, with;
    std::vector<ProbedSize> sizes;  // by scale, ascending; not empty
    double gain_db() const;         // mean over the sizes
    /// Where it gains in that mean and loses no more than a dB at the trained size.
    bool pays() const;
};

/// The row of anti-aliasing as the probe decides it; where the command line has, the reason alone.
void take_probe(const AntialiasProbe& probe, EffectPlan& plan);

}  // namespace darb
