// SPDX-License-Identifier: MIT
// AntialiasProbe: what anti-aliasing gained in a trial, at the size that was trained on and at
// others, and what a plan makes of it.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "engine/plan/effect_plan.h"

namespace darb {

struct ProbedSize {
    double scale = 1;                    // relative to the sides of the training photos
    int width = 0, height = 0;           // size of the first view, px
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
    /// Whether it gains in that mean and loses no more than 1 dB at the trained size.
    bool pays() const;
};

/// Sets the row of anti-aliasing as the probe decides; where the command line has decided, only its
/// reason.
void take_probe(const AntialiasProbe& probe, EffectPlan& plan);

// Trial: what one way of training gained over another in two short runs, on photos that neither
// saw.

struct Trial {
    std::string tried, usual;  // what is given for each: "--kernel beta"
    int iterations = 0;
    ProbedRun usual_run{}, tried_run{};
    double usual_db = 0, tried_db = 0;  // mean PSNR of the held-out photos
    double price = 0;                   // extra time, as a share: 0.1 is 10 %
    double gain_db() const { return tried_db - usual_db; }
    /// Whether it gains more than two runs of one way differ by chance.
    bool pays() const { return gain_db() > kLeastGain_db; }
    /// The advice in words.
    std::string advice() const;

    static constexpr double kLeastGain_db = 0.2;  // docs/experiments/README.md
};

}  // namespace darb
