// What `darb train` says at the end of a run.
#pragma once

#include <string>

#include "tools/darb/train_flags.h"
#include "trainer/run/run.h"

namespace darb {

/// Of a quiet run the paths, and what goes on with one that was interrupted.
std::string summary_text(const TrainResult& summary, const TrainFlags& flags,
                         const RankGroup& ranks);

}  // namespace darb
