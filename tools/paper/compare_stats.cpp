#include "tools/paper/compare_stats.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/core/quantile.h"
#include "engine/report/html.h"

namespace darb {

namespace {

using Value = std::optional<double>;

template <class F>
auto of_blending(F member) {
    return [member](const ComparedRun& run, const ComparedAt&) {
        return run.blending ? Value((*run.blending).*member) : Value();
    };
}

}  // namespace

const std::vector<Column>& quality_columns() {
    static const std::vector<Column> columns{
        {"PSNR", "dB", "psnr_db", 2, true,
         [](const ComparedRun&, const ComparedAt& at) { return Value(at.psnr_db); }},
        {"SSIM", "", "ssim", 4, true,
         [](const ComparedRun&, const ComparedAt& at) { return Value(at.ssim); }},
        {"LPIPS", "", "lpips", 4, false,
         [](const ComparedRun&, const ComparedAt& at) { return at.lpips; }},
        {"model", "MB", "model_mb", 2, false,
         [](const ComparedRun&, const ComparedAt& at) { return at.model_mb; }},
        {"splats", "", "splats", 0, false,
         [](const ComparedRun&, const ComparedAt& at) { return Value(at.splats); }},
        {"peak", "MB", "peak_mb", 0, false,
         [](const ComparedRun& run, const ComparedAt&) { return run.peak_mb; }},
        {"training", "s", "training_s", 1, false,
         [](const ComparedRun&, const ComparedAt& at) { return Value(at.seconds); }},
    };
    return columns;
}

std::string scale_text(double scale) {
    const double inverse = 1 / scale;
    if (scale < 1 && std::abs(inverse - std::round(inverse)) < 1e-9)
        return fmt::format("1/{:.0f}", inverse);
    return fmt::format("{:.4g}", scale);
}

std::vector<Column> every_column(const Comparison& comparison) {
    std::vector<Column> columns = quality_columns();
    auto at = columns.begin() + 1;
    for (const double scale : comparison.scales)
        at = 1 + columns.insert(
                     at, {"at " + scale_text(scale), "dB", fmt::format("psnr_db_at_{:.4g}", scale),
                          2, true, [scale](const ComparedRun&, const ComparedAt& run) {
                              for (const ComparedScale& s : run.scales)
                                  if (s.scale == scale) return Value(s.psnr_db);
                              return Value();
                          }});
    at = 1 +
         columns.insert(at, {"arc", "dB", "arc_psnr_db", 2, true,
                             [](const ComparedRun&, const ComparedAt& run) { return run.arc_db; }});
    columns.insert(at, {"off path", "dB", "off_path_psnr_db", 2, true,
                        [](const ComparedRun&, const ComparedAt& run) { return run.off_path_db; }});
    return columns;
}

std::vector<Column> shown_columns(const Comparison& comparison) {
    bool lpips = false, arc = false, off_path = false;
    for (const ComparedDataset& dataset : comparison.datasets)
        for (const ComparedRun& run : dataset.runs)
            for (const ComparedAt& at : run.at) {
                lpips |= at.lpips.has_value();
                arc |= at.arc_db.has_value();
                off_path |= at.off_path_db.has_value();
            }
    std::vector<Column> columns;
    for (const Column& column : every_column(comparison))
        if ((lpips || column.json != "lpips") && (arc || column.json != "arc_psnr_db") &&
            (off_path || column.json != "off_path_psnr_db"))
            columns.push_back(column);
    return columns;
}

const std::vector<Column>& blending_columns() {
    static const std::vector<Column> columns{
        {"blended per pixel", "splats", "blended_per_pixel", 2, false,
         of_blending(&BlendStatistics::blended_per_pixel)},
        {"intersections per splat", "", "pairs_per_splat", 2, false,
         of_blending(&BlendStatistics::intersections_per_splat)},
        {"per splat and pixel", "ns", "ns_per_splat_pixel", 2, false,
         of_blending(&BlendStatistics::ns_per_splat_pixel)},
        {"blend pass", "ms", "blend_ms", 2, false, of_blending(&BlendStatistics::blend_ms)},
        {"forward passes", "ms", "frame_ms", 2, false, of_blending(&BlendStatistics::frame_ms)},
    };
    return columns;
}

OverSeeds over_seeds(const ComparedDataset& dataset, const std::string& kernel, int iteration,
                     const Column& column) {
    std::vector<double> values;
    for (const ComparedRun& run : dataset.runs) {
        if (run.kernel != kernel) continue;
        for (const ComparedAt& at : run.at)
            if (at.iteration == iteration)
                if (const Value v = column.value(run, at); v && std::isfinite(*v))
                    values.push_back(*v);
    }
    if (values.empty()) return {};
    std::sort(values.begin(), values.end());
    return {quantile(values, 0.5), values.front(), values.back(), static_cast<int>(values.size())};
}

Marks marks_of(const std::vector<Value>& values, const Column& column) {
    const double unit = std::pow(10, column.decimals);
    const auto printed = [&](const Value& v) {
        return std::round(*v * unit) * (column.more_is_better ? 1 : -1);
    };
    Marks marks(values.size(), Mark::none);
    bool differ = false;
    for (std::size_t i = 0; i < values.size(); ++i) {
        int better = 0;
        for (const Value& other : values)
            if (values[i] && other && printed(other) > printed(values[i])) ++better;
        differ |= better > 0;
        if (values[i] && better == 0) marks[i] = Mark::best;
        if (values[i] && better == 2) marks[i] = Mark::third;
    }
    return differ ? marks : Marks(values.size(), Mark::none);
}

Marks marks_over_seeds(const std::vector<OverSeeds>& values, const Column& column) {
    std::vector<Value> medians;
    bool ranges = false;
    for (const OverSeeds& value : values) {
        medians.push_back(value.median);
        ranges |= value.count > 1;
    }
    Marks marks = marks_of(medians, column);
    if (!ranges) return marks;
    const auto overlap = [](const OverSeeds& a, const OverSeeds& b) {
        return a.low <= b.high && b.low <= a.high;
    };
    for (std::size_t i = 0; i < values.size(); ++i) {
        bool apart = true;
        for (std::size_t j = 0; j < values.size(); ++j)
            if (j != i && values[j].median && overlap(values[i], values[j])) apart = false;
        if (marks[i] == Mark::third || !apart) marks[i] = Mark::none;
    }
    return marks;
}

std::string spread_text(const OverSeeds& value, int decimals) {
    if (!value.median) return "-";
    const std::string median = format_number(*value.median, decimals);
    if (value.count < 2) return median;
    return fmt::format("{} ({} to {})", median, format_number(value.low, decimals),
                       format_number(value.high, decimals));
}

}  // namespace darb
