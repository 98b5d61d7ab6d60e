// SPDX-License-Identifier: MIT
// Means, medians and differences over the seeds of a comparison, and its tables.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/report/report.h"
#include "engine/scene/splat_model.h"
#include "tools/paper/compare_runs.h"

namespace darb {

/// A scale as tables show it: "1/2", "2.5".
std::string scale_text(double scale);

struct OverSeeds {
    std::optional<double> median, mean;  // empty where no run has the value
    std::optional<double> deviation;     // standard deviation, from three runs on
    double low = 0, high = 0;
    int count = 0;

    /// The mean with its deviation, or with the range of two runs.
    TableCell cell() const;
};

/// A column of the tables.
struct Column {
    std::string name;  // "PSNR"
    std::string unit;  // "dB"; may be empty
    std::string json;  // key in JSON
    int decimals = 2;
    bool more_is_better = true;
    std::function<std::optional<double>(const ComparedRun&, const ComparedAt&)> value;
};
/// PSNR, SSIM, LPIPS, FLIP, model MB, splats, peak MB, seconds.
const std::vector<Column>& quality_columns();
/// Those and, after the first, PSNR at each of the comparison's scales and off the path.
std::vector<Column> every_column(const Comparison& comparison);
/// splats blended per pixel, intersections per splat, ns per splat-pixel, blend ms, frame ms.
const std::vector<Column>& blending_columns();

/// For a failed run, the last value it reached counts.
OverSeeds over_seeds(const ComparedDataset& dataset, const std::string& kernel, int iteration,
                     const Column& column);

/// A method as tables name it; those that were not trained here say so.
std::string method_text(const Comparison& comparison, const std::string& method);

/// A row for each method and a column for each of `columns`, the best marked.
Table methods_table(const Comparison& comparison, const ComparedDataset& dataset, int iteration,
                    const std::vector<Column>& columns);

/// For PSNR, SSIM, LPIPS and FLIP a table with a row for each data set and a column for each
/// method, and their means where every method has the value. None where there is one data set.
std::vector<Table> tables_by_dataset(const Comparison& comparison, int iteration);

/// The differences of two methods in what their runs with equal seeds give.
struct PairedDifference {
    double mean = 0;           // of the other less the base
    double low = 0, high = 0;  // 95 % interval of the mean, by Student's t
    int seeds = 0;

    bool clear() const { return low > 0 || high < 0; }
};
/// Nothing with fewer than three seeds that both have.
std::optional<PairedDifference> paired_difference(const ComparedDataset& dataset,
                                                  const std::string& base, const std::string& other,
                                                  int iteration, const Column& column);
/// The number of standard errors at which a two-sided interval of 95 % ends. freedom: at least 1.
double student_t_95(int freedom);
/// The method that others are compared with: gaussian, else the first; "" where there is none.
std::string base_method(const Comparison& comparison);
/// For PSNR, SSIM, LPIPS and FLIP after the last iteration, a row for each data set and method;
/// none with fewer than three seeds.
std::vector<Table> paired_tables(const Comparison& comparison);
nlohmann::json paired_json(const Comparison& comparison);

// Means over the data sets of a comparison: over all of them, and over those of each benchmark of
// the paper, with the paper's own.

struct Means {
    std::string benchmark;           // empty: all data sets
    std::vector<std::string> names;  // names of the data sets
    /// [column][kernel] means over the data sets in which every kernel has the value.
    std::vector<std::vector<std::optional<double>>> values;
    std::vector<int> covered;  // [column] number of those data sets
    /// [column][kernel] the paper's means over the same names; empty where it lacks the column or
    /// kernel.
    std::vector<std::vector<std::optional<double>>> paper;
};

/// The groups with more than one data set, with means of the columns at one iteration. Where all
/// data sets belong to one benchmark, the group of all is left out.
std::vector<Means> means_of(const Comparison& comparison, int iteration,
                            const std::vector<Column>& columns);

nlohmann::json means_json(const Comparison& comparison);

// Tests the paper's claim that more than one pulse takes less memory and gives less quality, on the
// runs of a comparison.

/// A kernel with several pulses compared with the same kernel with one, by medians over seeds.
/// Empty where one of the two lacks the figure.
struct PulseChange {
    std::string kernel;  // name of the kernel with one pulse
    int pulses = 0;
    std::optional<double> psnr_db, ssim;                 // differences
    std::optional<double> splats, model, peak, seconds;  // ratios

    bool less_memory() const { return model && *model < 1; }
    bool less_psnr() const { return psnr_db && *psnr_db < 0; }
    bool less_ssim() const { return ssim && *ssim < 0; }
};

/// Every kernel of the comparison that was run with one pulse and with several.
std::vector<PulseChange> pulse_changes(const Comparison& comparison, const ComparedDataset& dataset,
                                       int iteration);

/// As sentences and as a table; all empty where there is no such kernel.
std::string pulse_lines(const Comparison& comparison, const ComparedDataset& dataset);
Table pulse_table(const Comparison& comparison, const ComparedDataset& dataset);
nlohmann::json pulse_json(const Comparison& comparison, const ComparedDataset& dataset);

// Whether a scene wants one kernel or many: the shapes that splats learned in the runs of a
// comparison.

/// The shapes of visible splats (opacity at or above the cut-off). Nothing where the kernel has no
/// shapes, or no splat is visible.
std::optional<LearnedShapes> learned_shapes(const SplatModel& model);

/// Sets run.shapes from the last saved model.
void read_shapes_of(ComparedRun& run);

/// A plot for each kernel that learns shapes, with a curve for each data set, and a table of
/// percentiles, all from the first seed available; nothing where there is no such kernel.
void add_shapes(const Comparison& comparison, Report& report);
nlohmann::json shapes_json(const LearnedShapes& shapes);

}  // namespace darb
