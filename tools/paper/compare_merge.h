// SPDX-License-Identifier: MIT
// The reports of darb compare as files that are read back, and several of them, from several
// machines, as one.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/report/report.h"
#include "tools/paper/compare_runs.h"

namespace darb {

/// docs/compare.schema.json describes this version of the file.
constexpr int kCompareFormatVersion = 1;

/// A comparison from comparison_json(). file: where it lies, from which its paths go; it names the
/// report in errors. Throws Error where it is no such report, or one of another version.
Comparison parse_comparison(const nlohmann::json& json, const std::filesystem::path& file);
Comparison read_comparison(const std::filesystem::path& file);

/// A run, at one iteration, that two reports have.
struct RepeatedCell {
    std::string dataset, kernel;
    std::uint64_t seed = 0;
    int iteration = 0;
    std::string first, second;     // the files, by name
    double psnr_db = 0, ssim = 0;  // of the second less the first
    double largest_view_db = 0;    // most by which a view's PSNR differs
    bool same_bits = false;        // every view has the same PSNR and SSIM
    bool same_machine = false;

    /// They print alike.
    bool agree() const;
};

struct MergedComparison {
    Comparison comparison;
    std::vector<RepeatedCell> repeated;
    std::vector<std::string> notes;  // what differs and does not forbid it
};

/// The runs of all reports as one comparison. A cell that several have on one machine is taken from
/// the first; where machines differ, the methods of each carry its name. files: names for errors,
/// one for each report. Throws Error where reports differ in iterations, settings, sizes, held-out
/// views or LPIPS, so that their figures are not comparable.
MergedComparison merge_comparisons(const std::vector<std::filesystem::path>& files,
                                   const std::vector<Comparison>& reports);

/// A row for each cell that was repeated; no rows where none was.
Table repeated_table(const std::vector<RepeatedCell>& repeated);
nlohmann::json repeated_json(const std::vector<RepeatedCell>& repeated);
/// A line for each disagreement, and how many cells agree; empty where none was repeated.
std::string repeated_lines(const std::vector<RepeatedCell>& repeated);

}  // namespace darb
