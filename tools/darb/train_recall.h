// `darb train --resume -o OUT` alone: goes on with the command of the run, which OUT/command.json
// holds.
#pragma once

#include <string>
#include <vector>

#include "tools/darb/train_flags.h"
#include "tools/darb/tune_flags.h"

namespace darb {

/// The text of command.json. arguments: as typed; data set, checkpoint and output become paths as
/// seen from the output folder, so that the run can be resumed from any folder, and moved with its
/// data.
std::string command_text(std::vector<std::string> arguments, const TrainFlags& flags);

/// flags and tune as that file has them; of what was typed now, the device, -q, --view and --tune
/// count. Throws Error for any other option, and for a file that is no list of arguments.
void recall_arguments(const std::vector<std::string>& typed, TrainFlags& flags, TuneFlags& tune);

}  // namespace darb
