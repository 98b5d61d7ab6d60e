// darb train --blocks: a scene larger than one memory, trained a part of the ground at a time.
#pragma once

#include <string>
#include <vector>

#include "engine/ranks/ranks.h"
#include "tools/darb/train_flags.h"
#include "tools/darb/tune_flags.h"
#include "trainer/blocks/partition.h"

namespace darb {

/// "auto" as 0 x 0, else columns x rows. Throws Error for anything else.
Grid parse_blocks(const std::string& text);

/// The run. Throws Error where an option was given that has no place beside --blocks. Returns the
/// exit code.
int train_blocks(Ranks& ranks, const TrainFlags& flags, const TuneFlags& tune);

}  // namespace darb
