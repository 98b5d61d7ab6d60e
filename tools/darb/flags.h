// SPDX-License-Identifier: MIT
// --accuracy and one flag for each accuracy setting, as the table of engine/plan names them.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/kernels/kernel_words.h"
#include "engine/plan/accuracy.h"
#include "engine/scene/splat_model.h"
#include "engine/scene/stored_units.h"

namespace darb {

struct AccuracyFlags {
    std::string preset;                              // empty: balanced
    std::array<std::string, kAccuracyCount> choice;  // empty: the preset's
};

/// For pictures; for training they are rows of trainer/job/request_options.h.
void add_accuracy_flags(CLI::App& command, AccuracyFlags& flags);

/// The preset with what single flags change. Throws Error on names that do not exist.
Accuracy chosen_accuracy(const AccuracyFlags& flags);

/// A note where a choice that was given changes nothing of this kernel.
void note_unused_choices(const AccuracyFlags& flags, int kernel);

// --effects and what goes with it, for render, view, eval and plan; of training they are rows of
// trainer/job/request_options.h.

/// Adds --effects.
void add_effects_flag(CLI::App& command, std::string& text);

/// Adds --lens.
void add_lens_flag(CLI::App& command, DatasetOptions& data);

// Kernels on the command line: names, expressions, files and lists of them.

/// --kernel and --kernel-file of a command that takes one kernel.
struct KernelFlags {
    std::string kernel;  // empty: not given
    std::vector<std::filesystem::path> files;
};

/// Both options, kernel's with this help.
void add_kernel_flags(CLI::App& command, KernelFlags& flags, const std::string& help,
                      const std::string& group = "OPTIONS");
/// --kernel-file alone.
CLI::Option* add_kernel_file_flag(CLI::App& command, std::vector<std::filesystem::path>& files);

/// Registers the kernels of the files, in order; prints what should be said of them. Throws Error.
std::vector<int> kernels_of_files(const std::vector<std::filesystem::path>& files);

/// What --kernel names, by name or "expr: ...", else the last kernel of the files; nothing where
/// neither is given. Throws Error, for a row with more than one pulse too.
std::optional<int> chosen_kernel(const KernelFlags& flags);

/// The splats in the chosen kernel, if one is; with its psi where it has no exact footprint.
SplatModel in_kernel(const KernelFlags& flags, SplatModel model);

/// A list as split_kernel_list has it, in which "all" are the nine of the family and "paper" the
/// five of the paper's tables, and behind it the kernels of the files; to kernels without repeats.
/// Throws Error naming `option` for an item that is no kernel, or one with more than one pulse.
std::vector<int> kernels_from_list(const std::string& option, const std::string& list,
                                   const std::vector<std::filesystem::path>& files = {});

// What is measured: which views are held out, at which sizes, and views off the path.

/// --hold-out, which implies --eval.
CLI::Option* add_hold_out_flag(CLI::App& command, DatasetOptions& data);

/// --depth-scale: world units a metre of measured depths.
CLI::Option* add_depth_scale_flag(CLI::App& command, DatasetOptions& data);

/// --scales: sizes to measure at, as multiples of that of -r, each above 0.
CLI::Option* add_scales_flag(CLI::App& command, std::vector<double>& scales);

/// DATASET/off_path, a data set that is all held out, at the size of -r: pictures away from the
/// path of the photos. Without views where that folder has no transforms_test.json.
Dataset off_path_of(const std::filesystem::path& dataset, const DatasetOptions& options);

// How a file stores its splats, where it does so in another way than its format.

/// --scales, --opacities, --colours, --rotations and --harmonics: how the file stores its splats.
/// with_scales: false where the command has another option --scales, which takes its words, too.
void add_unit_options(CLI::App& command, StoredUnits& units, bool with_scales = true);

// A size in pixels, as --size takes it.

struct PixelSize {
    int width = 0, height = 0;
};

/// WIDTHxHEIGHT, 16 to 16384 px each. Throws Error.
PixelSize parse_size(const std::string& text);

// Numbers and values of a command line, typed or kept by a run.

/// `count` finite numbers with commas between them. Throws Error naming the option.
std::vector<double> numbers_from(const std::string& option, const std::string& text,
                                 std::size_t count);

/// Throws Error for an option whose value is "": it would count as not given.
void refuse_empty_values(const std::vector<std::string>& arguments);

/// Throws Error for values that the parser took for numbers and lets through every limit: nan,
/// infinities, and what float32 holds as infinity. Text is none of them, so that files and folders
/// may have such names. app: after it has parsed.
void refuse_no_numbers(const CLI::App& app);

/// Checks of an option: CLI11's own ones answer with a limit of 309 digits. Infinity passes them,
/// as refuse_no_numbers() has the better message for it.
CLI::Validator above_zero();
CLI::Validator zero_or_more();

}  // namespace darb
