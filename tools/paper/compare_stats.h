// Medians over the seeds of a comparison, and who is best.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

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

}  // namespace darb
