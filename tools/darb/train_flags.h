// SPDX-License-Identifier: MIT
// The command line of `darb train`: the rows of trainer/job/request_options.h as flags, and a few
// flags that say how the command shows its run.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "tools/darb/train_summary.h"
#include "trainer/job/request_options.h"

namespace darb {

struct TrainFlags {
    TrainRequest request;  // valid once the command line has been parsed
    GivenOptions given;    // the options that were named, as they were typed
    RunShown shown;
    bool retune = false;
    bool deterministic = false;  // has no effect, as every run is; scripts can state it
};

/// Adds every option to the subcommand. The values go to flags, which must outlive the parse. The
/// parse throws Error for a value that a row does not accept.
void add_train_flags(CLI::App& command, TrainFlags& flags);

/// The complete request as if `darb train` had got these words, without `train`. options: more of
/// them in one text, from the --train-options of `command`, which an Error names.
TrainRequest parse_train_words(std::vector<std::string> words, const std::string& options,
                               const std::string& command);

}  // namespace darb
