// Medians over the seeds of a comparison, and who is best.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/splat_model.h"
#include "tools/paper/compare_runs.h"

namespace darb {

/// "1/2", "2.5": a scale in tables.
std::string scale_text(double scale);

struct OverSeeds {
    std::optional<double> median;  // none where no run has the value
    double low = 0, high = 0;
    int count = 0;
};

/// A column of the tables.
struct Column {
    std::string name;  // "PSNR"
    std::string unit;  // "dB"; may be empty
    std::string json;  // name in JSON
    int decimals = 2;
    bool more_is_better = true;
    std::function<std::optional<double>(const ComparedRun&, const ComparedAt&)> value;
};
/// PSNR, SSIM, LPIPS, model MB, splats, peak MB, seconds.
const std::vector<Column>& quality_columns();
/// These and, after the first, PSNR at each of the comparison's scales and off the path.
std::vector<Column> every_column(const Comparison& comparison);
/// Those that a table shows: without LPIPS and views off the path where no run has them.
std::vector<Column> shown_columns(const Comparison& comparison);
/// splats blended per pixel, intersections per splat, ns per splat-pixel, blend ms, frame ms.
const std::vector<Column>& blending_columns();

/// Of a failed run what it came to counts.
OverSeeds over_seeds(const ComparedDataset& dataset, const std::string& kernel, int iteration,
                     const Column& column);

/// best: none is better; third: two are. Of values as they are printed, so all that look the same
/// are marked the same.
enum class Mark { none, best, third };
using Marks = std::vector<Mark>;
/// One mark a value; none at all where there is one value or where all are the same.
Marks marks_of(const std::vector<std::optional<double>>& values, const Column& column);

/// The same over seeds: best is what no other overlaps, from its lowest to its highest; third is
/// left out where seeds have a range.
Marks marks_over_seeds(const std::vector<OverSeeds>& values, const Column& column);

/// "27.31" or, over several seeds, "27.31 (27.10 to 27.44)"; "-" without a value.
std::string spread_text(const OverSeeds& value, int decimals);

// Means over the data sets of a comparison: over all of them, and over those of each benchmark of
// the paper, with the paper's own.

struct Means {
    std::string benchmark;           // empty: all data sets
    std::vector<std::string> names;  // of the data sets
    /// [column][kernel], over the data sets where every kernel has the value.
    std::vector<std::vector<std::optional<double>>> values;
    std::vector<int> covered;  // [column] how many these are
    /// [column][kernel], over the same names; none where the paper has no such column or kernel.
    std::vector<std::vector<std::optional<double>>> paper;
};

/// Of columns at one iteration, the groups that hold more than one data set; all data sets are left
/// out where they are one benchmark.
std::vector<Means> means_of(const Comparison& comparison, int iteration,
                            const std::vector<Column>& columns);

nlohmann::json means_json(const Comparison& comparison);

// The paper's claim that more pulses than one take less memory and give less quality, on the runs
// of a comparison.

/// A kernel with several pulses against the same kernel with one, medians over seeds. None where
/// one of the two has no such number.
struct PulseChange {
    std::string kernel;  // of one pulse
    int pulses = 0;
    std::optional<double> psnr_db, ssim;                 // differences
    std::optional<double> splats, model, peak, seconds;  // ratios

    bool less_memory() const { return model && *model < 1; }
    bool less_psnr() const { return psnr_db && *psnr_db < 0; }
    bool less_ssim() const { return ssim && *ssim < 0; }
};

/// Every kernel of the comparison that was run with one pulse and with more.
std::vector<PulseChange> pulse_changes(const Comparison& comparison, const ComparedDataset& dataset,
                                       int iteration);

/// All empty where there is no such kernel.
std::string pulse_lines(const Comparison& comparison, const ComparedDataset& dataset);
std::string pulse_html(const Comparison& comparison, const ComparedDataset& dataset);
nlohmann::json pulse_json(const Comparison& comparison, const ComparedDataset& dataset);

// Does a scene want one kernel or many? The shapes that splats learned in the runs of a comparison.

/// Of the splats that are drawn (opacity at or over the cut-off). None where the kernel has no
/// shape, and where no splat is drawn.
std::optional<LearnedShapes> learned_shapes(const SplatModel& model);

/// run.shapes, of the last saved model.
void read_shapes_of(ComparedRun& run);

/// A plot for each kernel that learns shapes, with a curve for each data set, and a table of
/// percentiles, all of the first seed that is there; empty where there is no such kernel.
std::string shapes_html(const Comparison& comparison);
nlohmann::json shapes_json(const LearnedShapes& shapes);

}  // namespace darb
