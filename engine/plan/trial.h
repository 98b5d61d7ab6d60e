// Trial: what one way of training gained over another in two short runs, on photos that neither
// saw.
#pragma once

#include <string>

#include "engine/plan/antialias_probe.h"

namespace darb {

struct Trial {
    std::string tried, usual;  // what is given for each: "--kernel beta"
    int iterations = 0;
    ProbedRun usual_run{}, tried_run{};
    double usual_db = 0, tried_db = 0;  // mean PSNR of the held-out photos
    double price = 0;                   // what it takes longer, as a share: 0.1 is 10 %
    double gain_db() const { return tried_db - usual_db; }
    /// Where it gains more than two runs of one way differ by chance.
    bool pays() const { return gain_db() > kLeastGain_db; }
    /// The advice in words.
    std::string advice() const;

    static constexpr double kLeastGain_db = 0.2;  // docs/experiments/README.md
};

}  // namespace darb
