// SPDX-License-Identifier: MIT
// What `darb compare` is asked for, and the training runs that follow from it.
#pragma once

#include <CLI/CLI.hpp>
#include <atomic>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/ranks/ranks.h"
#include "tools/paper/compare_runs.h"
#include "tools/paper/lpips.h"
#include "trainer/job/request.h"

namespace darb {

/// --add NAME=FILE: the splats of another program, to be measured beside the kernels.
struct AddedMethod {
    std::string name;
    std::string dataset;  // the name of the one that it belongs to
    std::filesystem::path file;
};

struct CompareFlags {
    std::vector<std::string> datasets;
    std::filesystem::path output, html, json, paper;
    std::string kernels = "paper", device, train_options;
    std::vector<std::filesystem::path> kernel_files;
    std::vector<int> iterations{7'000, 30'000};
    std::vector<int> pulses{1};
    std::vector<double> scales;  // sizes to measure at, besides that of training
    int seeds = 1;
    std::uint32_t max_splats = 0;        // 0: as many as the threshold makes
    std::vector<std::string> forwarded;  // options of `darb train`, as words
    std::vector<std::filesystem::path> lpips;
    std::vector<std::string> add;              // NAME=FILE or NAME@DATASET=FILE
    std::vector<std::filesystem::path> merge;  // reports, instead of data sets
    bool lpips_as_3dgs = false, flip = false, quiet = false;
    int blending_views = 4;
};

/// The kernels of --kernels, each with the variants of --pulses that it has, in that order. Throws
/// Error where none is left.
std::vector<int> kernels_of(const CompareFlags& flags);

/// Adds every option to the subcommand. The values go to flags, which must outlive the parse.
void add_compare_flags(CLI::App& command, CompareFlags& flags);

/// "PATH@IMAGES" names the photo folder of one data set; a name without that part keeps --images.
std::string dataset_path(const std::string& dataset);

/// The last folder of the path as it was given, so that a link keeps its name.
std::string dataset_name(const std::string& dataset);

/// The methods of --add. Throws Error for a name that is taken or a file that is missing, and where
/// it is not said to which of several data sets one belongs.
std::vector<AddedMethod> added_methods(const CompareFlags& flags);

/// darb compare --merge: writes the page and the file of several reports as one.
int merge_reports(const CompareFlags& flags);

/// The options that `darb train` would have for this run. Throws Error for unknown --train-options.
TrainRequest train_request_of(const CompareFlags& flags, const std::string& dataset, int kernel,
                              std::uint64_t seed);

/// The files and folders named by the options of the runs.
std::vector<std::filesystem::path> paths_in_options(const CompareFlags& flags);

/// What the runs have in common, as sentences, with paths as seen from the output.
std::string settings_of(const CompareFlags& flags);

/// Shortens the paths in what the runs say: the data set, the output and the files of options keep
/// their names, without the folders around them.
void leave_folders_out(ComparedDataset& dataset, const CompareFlags& flags);

/// Throws Error where ranks have other photos or options, or would measure other things.
/// fingerprint: that of the data set, empty where it cannot be read. All ranks must call this.
void check_same_runs(Ranks& ranks, const CompareFlags& flags, const std::string& dataset,
                     const std::vector<int>& kernels, const std::string& fingerprint,
                     const std::string& measurements);

/// The metric for --lpips. note: which one it is, or why there is none.
std::optional<Lpips> load_lpips(const CompareFlags& flags, std::string& note);

/// Trains what is missing, then reads and measures everything, for one data set. It ends early with
/// what there is when *stop is set. lpips may be null. Several ranks train and measure a share of
/// the runs each, into the same folders. All ranks get all results, and the first also the
/// blending.
ComparedDataset compare_on(const CompareFlags& flags, const std::string& dataset,
                           const std::vector<int>& kernels, const Lpips* lpips, Ranks& ranks,
                           const std::atomic<bool>& stop);

}  // namespace darb
