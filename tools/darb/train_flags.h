// The command line of `darb train`.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "tools/darb/accuracy_flags.h"
#include "tools/darb/kernel_flags.h"
#include "tools/darb/option_flags.h"
#include "trainer/job/request.h"

namespace darb {

/// The words of the command line. finish_train_flags() leaves what they ask for in `request`; the
/// others are for the command alone.
struct TrainFlags {
    TrainRequest request;
    bool quiet = false, verbose = false;  // less and more on the terminal
    bool view = false;                    // follow in a window
    bool deterministic = false;           // every run is; the flag only lets scripts say so
    bool length_given = false;            // --iterations
    bool width_given = false;             // -r
    std::filesystem::path depths;         // as 3DGS spells +depth: the folder
    // Words that become ids and lists of the request.
    KernelFlags kernel;
    int pulses = 1;
    AccuracyFlags accuracy;
    std::string strategy = "adc", effects = "auto";
    GivenOfStrategies of_strategies;
};

/// --preset, and the photos' options. Before the others: values are taken over in this order.
void add_data_flags(CLI::App& command, TrainFlags& flags);

/// Adds every option to the subcommand; values land in flags, which must outlive the parse.
void add_train_flags(CLI::App& command, TrainFlags& flags);

/// As if `darb train` had got these words, `train` left out; options: more of them in one text,
/// from the --train-options of `command`, which an Error names.
TrainFlags parse_train_flags(std::vector<std::string> words, const std::string& options,
                             const std::string& command);

/// Completes flags.request: names become ids, what is missing its default, and contradictions an
/// Error.
void finish_train_flags(TrainFlags& flags);

}  // namespace darb
