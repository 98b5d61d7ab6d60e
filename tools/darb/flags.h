// SPDX-License-Identifier: MIT
// Options that several commands share; the first are --accuracy and a flag for each accuracy
// setting, named as in the table of engine/plan.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/kernels/kernel_definition.h"
#include "engine/plan/accuracy.h"
#include "engine/scene/splat_model.h"
#include "engine/scene/stored_units.h"

namespace darb {

struct AccuracyFlags {
    std::string preset;                              // empty: balanced
    std::array<std::string, kAccuracyCount> choice;  // empty: the preset's choice
};

/// For pictures; for training they are rows of trainer/job/request_options.h.
void add_accuracy_flags(CLI::App& command, AccuracyFlags& flags);

/// The preset with the changes of single flags. Throws Error for unknown names.
Accuracy chosen_accuracy(const AccuracyFlags& flags);

/// Prints a note where a choice that was given has no effect on this kernel.
void note_unused_choices(const AccuracyFlags& flags, int kernel);

// --effects and related options, for render, view, eval and plan; for training they are rows of
// trainer/job/request_options.h.

/// Adds --effects.
void add_effects_flag(CLI::App& command, std::string& text);

/// Adds --lens.
void add_lens_flag(CLI::App& command, DatasetOptions& data);

// Kernels on the command line: names, expressions, files and lists of these.

/// --kernel and --kernel-file, for a command that takes one kernel.
struct KernelFlags {
    std::string kernel;  // empty: not given
    std::vector<std::filesystem::path> files;
};

/// Adds both options; --kernel gets this help.
void add_kernel_flags(CLI::App& command, KernelFlags& flags, const std::string& help,
                      const std::string& group = "OPTIONS");
/// Adds --kernel-file alone.
CLI::Option* add_kernel_file_flag(CLI::App& command, std::vector<std::filesystem::path>& files);

/// Registers the kernels of the files in order and prints notes about them. Throws Error.
std::vector<int> kernels_of_files(const std::vector<std::filesystem::path>& files);

/// The kernel that --kernel names, by name or as "expr: ...", otherwise the last kernel of the
/// files; nothing where neither is given. Throws Error, also for a row with more than one pulse.
std::optional<int> chosen_kernel(const KernelFlags& flags);

/// The splats in the chosen kernel, if one is chosen; with its psi where it has no exact footprint.
SplatModel in_kernel(const KernelFlags& flags, SplatModel model);

/// Turns a list as split_kernel_list takes it, followed by the kernels of the files, into kernels
/// without repeats. In it "all" means the nine of the family and "paper" the five of the paper's
/// tables. Throws an Error that names `option` for an item that is not a kernel, or has more than
/// one pulse.
std::vector<int> kernels_from_list(const std::string& option, const std::string& list,
                                   const std::vector<std::filesystem::path>& files = {});

// What is measured: which views are held out, at which sizes, and views away from the path.

/// --hold-out, which implies --eval.
CLI::Option* add_hold_out_flag(CLI::App& command, DatasetOptions& data);

/// --depth-scale: world units per metre of measured depth.
CLI::Option* add_depth_scale_flag(CLI::App& command, DatasetOptions& data);

/// --scales: sizes to measure at, as factors of the size of -r, each above 0.
CLI::Option* add_scales_flag(CLI::App& command, std::vector<double>& scales);

/// The data set DATASET/off_path, all of it held out, at the size of -r: pictures away from the
/// path of the photos. It has no views where that folder has no transforms_test.json.
Dataset off_path_of(const std::filesystem::path& dataset, const DatasetOptions& options);

// How a file stores its splats where it differs from its format.

/// --scales, --opacities, --colours, --rotations and --harmonics. with_scales: false where the
/// command has another option --scales, which then takes these words, too.
void add_unit_options(CLI::App& command, StoredUnits& units, bool with_scales = true);

// A size in pixels, as --size takes it.

struct PixelSize {
    int width = 0, height = 0;
};

/// Reads WIDTHxHEIGHT, 16 to 16384 px each. Throws Error.
PixelSize parse_size(const std::string& text);

// Numbers and values of a command line, as typed or as kept by a run.

/// Throws Error for an option with the value "", which would count as not given.
void refuse_empty_values(const std::vector<std::string>& arguments);

/// Throws Error for values that the parser accepts as numbers within any limits: nan, infinities,
/// and what becomes infinity in float32. Options that are text are not checked, so that files and
/// folders may have such names. app: after it has parsed.
void refuse_no_numbers(const CLI::App& app);

/// Checks of an option. CLI11's own checks answer with a limit of 309 digits. Infinity passes
/// these, because refuse_no_numbers() has the better message for it.
CLI::Validator above_zero();
CLI::Validator zero_or_more();

}  // namespace darb
