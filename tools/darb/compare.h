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

struct CompareFlags {
    std::vector<std::string> datasets;
    std::filesystem::path output, html, json;
    std::string kernels = "paper", device, train_options;
    std::vector<std::filesystem::path> kernel_files;
    std::vector<int> iterations{7'000, 30'000};
    std::vector<int> pulses{1};
    std::vector<double> scales;  // sizes to measure at, beside that of training
    int seeds = 1;
    std::uint32_t max_splats = 0;        // 0: as many as the threshold makes
    std::vector<std::string> forwarded;  // options of `darb train`, as words
    std::vector<std::filesystem::path> lpips;
    bool lpips_as_3dgs = false, quiet = false;
    int blending_views = 4;
};

/// The kernels of --kernels, each with those of --pulses that it has; in that order. Throws Error
/// where that leaves none.
std::vector<int> kernels_of(const CompareFlags& flags);

/// Adds every option to the subcommand; values land in flags, which must outlive the parse.
void add_compare_flags(CLI::App& command, CompareFlags& flags);

/// "PATH@IMAGES" names the photo folder of one data set; what has no such part keeps --images.
std::string dataset_path(const std::string& dataset);

/// The last folder of the path as it is given: a link keeps its name.
std::string dataset_name(const std::string& dataset);

/// The options that `darb train` would have for this run. Throws Error for --train-options that it
/// does not know.
TrainRequest train_request_of(const CompareFlags& flags, const std::string& dataset, int kernel,
                              std::uint64_t seed);

/// Files and folders that the options of the runs name.
std::vector<std::filesystem::path> paths_in_options(const CompareFlags& flags);

/// What the runs have in common, as sentences; paths in them as seen from the output.
std::string settings_of(const CompareFlags& flags);

/// What runs say names their data set, the output and files of their options, and no folder around
/// these.
void leave_folders_out(ComparedDataset& dataset, const CompareFlags& flags);

/// Throws Error where ranks have other photos or options, or would measure other things.
/// fingerprint: of the data set, empty where it cannot be read. All ranks call it.
void check_same_runs(Ranks& ranks, const CompareFlags& flags, const std::string& dataset,
                     const std::vector<int>& kernels, const std::string& fingerprint,
                     const std::string& measurements);

/// The metric for --lpips; note: which one it is, or why there is none.
std::optional<Lpips> load_lpips(const CompareFlags& flags, std::string& note);

/// Trains what is not there yet and reads and measures everything, one data set; ends early, with
/// what there is, when *stop is set. lpips may be null. Several ranks train and measure a share of
/// the runs each, into the same folders; all get them all, the first with blending.
ComparedDataset compare_on(const CompareFlags& flags, const std::string& dataset,
                           const std::vector<int>& kernels, const Lpips* lpips, Ranks& ranks,
                           const std::atomic<bool>& stop);

}  // namespace darb
