// ShapeProbe: what a kernel whose shape each splat learns gained in a trial over a fixed one.
#pragma once

#include <string>

#include "engine/plan/antialias_probe.h"

namespace darb {

struct ShapeProbe {
    int iterations = 0;
    int kernel = 0, fixed_kernel = 0;
    ProbedRun fixed, learned;
    double fixed_db = 0, learned_db = 0;  // mean PSNR of the held-out photos
    double price = 0;                     // what it takes longer, as a share: 0.1 is 10 %
    double gain_db() const { return learned_db - fixed_db; }
    /// Where photos that neither run saw gain more than two runs of one kernel differ by chance.
    bool pays() const { return gain_db() > kLeastGain_db; }
    /// The advice in words.
    std::string advice() const;

    static constexpr double kLeastGain_db = 0.2;  // docs/experiments/README.md
};

}  // namespace darb
