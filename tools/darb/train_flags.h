// The command line of `darb train`.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "tools/darb/accuracy_flags.h"
#include "tools/darb/kernel_flags.h"
#include "tools/darb/option_flags.h"
#include "trainer/run.h"

namespace darb {

struct TrainFlags {
    std::string dataset;
    std::string device;
    std::string effects = "auto", schedule_effects;
    std::string refine_cameras = "auto";
    bool antialiasing = false;  // as 3DGS spells +antialias
    bool resume = false;
    bool verbose = false;      // the table of passes at the end
    bool allow_mixed = false;  // devices of several ranks
    bool view = false;         // follow in a window
    bool page = false;         // OUT/scene.html at the end
    std::string blocks;        // auto, or columns x rows; empty: the scene as a whole
    bool sequential = false;
    int frames = 0;              // of a video; 0: by its length
    bool deterministic = false;  // every run is; the flag only lets scripts say so
    std::filesystem::path start_checkpoint;
    KernelFlags kernel;
    std::string strategy = "adc";
    std::string schedule = "darb";  // or 3dgs
    std::string preset;             // of trainer/presets.h; empty: none was named
    bool length_given = false;      // --iterations
    bool width_given = false;       // -r
    std::string cameras_note;       // what tracks made of the cameras, for people; may be empty
    std::string start_note;         // what plan_start found, for people; may be empty
    std::string strategy_note;      // what plan_strategy decided, for people
    GivenOfStrategies of_strategies;
    int pulses = 1;
    AccuracyFlags accuracy;
    DatasetOptions data;
    TrainOptions train;
    RunOptions run;
    std::vector<ImageU8> photos;  // already loaded, in the order of the views; else empty
};

/// --preset, and the photos' options. Before the others: values are taken over in this order.
void add_data_flags(CLI::App& command, TrainFlags& flags);

/// Adds every option to the subcommand; values land in flags, which must outlive the parse.
void add_train_flags(CLI::App& command, TrainFlags& flags);

/// As if `darb train` had got these words, `train` left out; options: more of them in one text,
/// from the --train-options of `command`, which an Error names.
TrainFlags parse_train_flags(std::vector<std::string> words, const std::string& options,
                             const std::string& command);

/// Names to ids, lists to their defaults, contradictions to an Error.
void finish_train_flags(TrainFlags& flags);

}  // namespace darb
