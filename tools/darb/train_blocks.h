// darb train --blocks: a scene larger than one memory, trained a part of the ground at a time.
#pragma once

#include <string>
#include <vector>

#include "engine/ranks/ranks.h"
#include "tools/darb/train_summary.h"
#include "trainer/blocks/partition.h"
#include "trainer/job/request.h"

namespace darb {

/// "auto" as 0 x 0, else columns x rows. Throws Error for anything else.
Grid parse_blocks(const std::string& text);

/// The run of a complete request. Throws Error where an option was given that has no place beside
/// --blocks. Returns the exit code.
int train_blocks(Ranks& ranks, const TrainRequest& request, const RunShown& shown, bool retune);

}  // namespace darb
