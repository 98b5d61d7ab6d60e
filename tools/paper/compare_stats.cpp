// SPDX-License-Identifier: MIT
#include "tools/paper/compare_stats.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/core/quantile.h"
#include "engine/kernels/kernel_family.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/report/html.h"
#include "engine/report/svg_plot.h"
#include "engine/scene/splat_file.h"
#include "shaders/shared/limits.h"
#include "tools/paper/paper_numbers.h"

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

namespace {

using Value = std::optional<double>;

constexpr std::pair<std::string_view, double PaperNumbers::*> kPaperColumns[] = {
    {"psnr_db", &PaperNumbers::psnr_db},
    {"ssim", &PaperNumbers::ssim},
    {"lpips", &PaperNumbers::lpips},
    {"model_mb", &PaperNumbers::model_mb},
    {"training_s", &PaperNumbers::training_s}};

Value paper_mean(const std::vector<std::string>& names, const std::string& kernel, int iteration,
                 const std::string& column) {
    double sum = 0;
    std::size_t found = 0;
    for (const auto& [json, member] : kPaperColumns)
        for (const std::string& name : names)
            for (const PaperNumbers& p : paper_numbers_of(name))
                if (json == column && p.iteration == iteration && kernel_name(p.kernel) == kernel) {
                    sum += p.*member;
                    ++found;
                }
    return found > 0 && found == names.size() ? Value(sum / double(found)) : Value();
}

Means means_over(const Comparison& c, int iteration, const std::vector<Column>& columns,
                 const std::string& benchmark, const std::vector<const ComparedDataset*>& sets) {
    Means means{benchmark, {}, {}, {}, {}};
    for (const ComparedDataset* set : sets) means.names.push_back(set->name);
    for (const Column& column : columns) {
        std::vector<double> sums(c.kernels.size(), 0.0);
        int covered = 0;
        for (const ComparedDataset* set : sets) {
            std::vector<Value> values;
            for (const std::string& kernel : c.kernels)
                values.push_back(over_seeds(*set, kernel, iteration, column).median);
            if (std::count(values.begin(), values.end(), std::nullopt) > 0) continue;
            for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += *values[i];
            ++covered;
        }
        std::vector<Value> of_column, of_paper;
        for (std::size_t i = 0; i < sums.size(); ++i) {
            of_column.push_back(covered > 0 ? Value(sums[i] / covered) : Value());
            of_paper.push_back(paper_mean(means.names, c.kernels[i], iteration, column.json));
        }
        means.values.push_back(std::move(of_column));
        means.paper.push_back(std::move(of_paper));
        means.covered.push_back(covered);
    }
    return means;
}

}  // namespace

std::vector<Means> means_of(const Comparison& c, int iteration,
                            const std::vector<Column>& columns) {
    std::vector<Means> groups;
    std::vector<const ComparedDataset*> all;
    for (const ComparedDataset& dataset : c.datasets) all.push_back(&dataset);
    bool one_benchmark = false;
    for (const std::string_view benchmark : paper_benchmarks()) {
        std::vector<const ComparedDataset*> sets;
        for (const ComparedDataset* dataset : all)
            if (paper_benchmark_of(dataset->name) == benchmark) sets.push_back(dataset);
        one_benchmark |= sets.size() == all.size();
        if (sets.size() > 1)
            groups.push_back(means_over(c, iteration, columns, std::string(benchmark), sets));
    }
    if (all.size() > 1 && !one_benchmark)
        groups.insert(groups.begin(), means_over(c, iteration, columns, "", all));
    return groups;
}

nlohmann::json means_json(const Comparison& c) {
    const auto number = [](const Value& v) {
        return v ? nlohmann::json(*v) : nlohmann::json(nullptr);
    };
    const std::vector<Column>& columns = quality_columns();
    nlohmann::json rows = nlohmann::json::array();
    for (const int iteration : c.iterations)
        for (const Means& m : means_of(c, iteration, columns))
            for (std::size_t k = 0; k < columns.size(); ++k)
                for (std::size_t i = 0; i < c.kernels.size(); ++i)
                    rows.push_back({{"benchmark", m.benchmark},
                                    {"data_sets", m.names},
                                    {"iteration", iteration},
                                    {"kernel", c.kernels[i]},
                                    {"value", columns[k].json},
                                    {"mean", number(m.values[k][i])},
                                    {"covered", m.covered[k]},
                                    {"paper", number(m.paper[k][i])}});
    return rows;
}

namespace {

using Value = std::optional<double>;

Value median_of(const ComparedDataset& dataset, const std::string& kernel, int iteration,
                std::string_view column) {
    for (const Column& c : quality_columns())
        if (c.json == column) return over_seeds(dataset, kernel, iteration, c).median;
    return std::nullopt;
}

std::string difference_text(const Value& v, int decimals) {
    return v ? fmt::format("{:+.{}f}", *v, decimals) : "-";
}

std::string ratio_text(const Value& v) {
    return v ? fmt::format("x{:.2f}", *v) : "-";
}

std::string yes(const Value& known, bool so) {
    return !known ? "-" : so ? "yes" : "no";
}

}  // namespace

std::vector<PulseChange> pulse_changes(const Comparison& comparison, const ComparedDataset& dataset,
                                       int iteration) {
    std::vector<PulseChange> changes;
    const std::vector<std::string>& names = comparison.kernels;
    for (const std::string& name : names) {
        const int row = kernel_from_name(name).value();
        const std::string one(kernel_name(kernel_with_pulses(row, 1).value()));
        if (name == one || std::find(names.begin(), names.end(), one) == names.end()) continue;
        const auto both = [&](std::string_view column, auto change) {
            const Value more = median_of(dataset, name, iteration, column);
            const Value base = median_of(dataset, one, iteration, column);
            return more && base ? Value(change(*more, *base)) : Value();
        };
        const auto less = [](double more, double base) { return more - base; };
        const auto over = [](double more, double base) { return more / base; };
        changes.push_back({one, kernel_pulses(row), both("psnr_db", less), both("ssim", less),
                           both("splats", over), both("model_mb", over), both("peak_mb", over),
                           both("training_s", over)});
    }
    return changes;
}

std::string pulse_lines(const Comparison& comparison, const ComparedDataset& dataset) {
    std::string text;
    for (const int iteration : comparison.iterations)
        for (const PulseChange& c : pulse_changes(comparison, dataset, iteration))
            text += fmt::format(
                "{}, {} iterations, {} with {} pulses against one: PSNR {} dB, SSIM {}, splats {}, "
                "model {}, peak {}, time {}; less memory: {}, less PSNR: {}, less SSIM: {}\n",
                dataset.name, format_number(iteration), c.kernel, c.pulses,
                difference_text(c.psnr_db, 2), difference_text(c.ssim, 4), ratio_text(c.splats),
                ratio_text(c.model), ratio_text(c.peak), ratio_text(c.seconds),
                yes(c.model, c.less_memory()), yes(c.psnr_db, c.less_psnr()),
                yes(c.ssim, c.less_ssim()));
    return text;
}

std::string pulse_html(const Comparison& comparison, const ComparedDataset& dataset) {
    std::string rows;
    for (const int iteration : comparison.iterations)
        for (const PulseChange& c : pulse_changes(comparison, dataset, iteration))
            rows += fmt::format(
                "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
                "<td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
                html_escape(c.kernel), c.pulses, format_number(iteration),
                difference_text(c.psnr_db, 2), difference_text(c.ssim, 4), ratio_text(c.splats),
                ratio_text(c.model), ratio_text(c.peak), ratio_text(c.seconds),
                yes(c.model, c.less_memory()), yes(c.psnr_db, c.less_psnr()),
                yes(c.ssim, c.less_ssim()));
    if (rows.empty()) return {};
    return "<h3>More pulses against one</h3><p class='soft'>The paper: less memory and less "
           "quality. Memory is that of the model.</p><div class='wide'><table>"
           "<tr><th>kernel</th><th>pulses</th><th>iterations</th><th>PSNR (dB)</th><th>SSIM</th>"
           "<th>splats</th><th>model</th><th>peak</th><th>training</th><th>less memory</th>"
           "<th>less PSNR</th><th>less SSIM</th></tr>\n" +
           rows + "</table></div>\n";
}

nlohmann::json pulse_json(const Comparison& comparison, const ComparedDataset& dataset) {
    const auto number = [](const Value& v) {
        return v ? nlohmann::json(*v) : nlohmann::json(nullptr);
    };
    nlohmann::json rows = nlohmann::json::array();
    for (const int iteration : comparison.iterations)
        for (const PulseChange& c : pulse_changes(comparison, dataset, iteration))
            rows.push_back({{"kernel", c.kernel},
                            {"pulses", c.pulses},
                            {"iteration", iteration},
                            {"psnr_db_difference", number(c.psnr_db)},
                            {"ssim_difference", number(c.ssim)},
                            {"splats_ratio", number(c.splats)},
                            {"model_ratio", number(c.model)},
                            {"peak_ratio", number(c.peak)},
                            {"training_ratio", number(c.seconds)},
                            {"less_memory", c.less_memory()},
                            {"less_psnr", c.less_psnr()},
                            {"less_ssim", c.less_ssim()}});
    return rows;
}

namespace {

constexpr std::size_t kBins = 32;

// Bins are even in the exponent, or in its logarithm where no exponent is 0.
bool by_logarithm(const ShapedKernel& kernel) {
    return kernel.exponent_least() > 0;
}

std::vector<double> edges_of(const ShapedKernel& kernel) {
    const double least = kernel.exponent_least(), most = kernel.exponent_most();
    std::vector<double> edges;
    for (std::size_t i = 0; i <= kBins; ++i) {
        const double share = static_cast<double>(i) / kBins;
        edges.push_back(by_logarithm(kernel) ? least * std::pow(most / least, share)
                                             : least + share * (most - least));
    }
    return edges;
}

const ComparedRun* first_with_shapes(const ComparedDataset& dataset, const std::string& kernel) {
    for (const ComparedRun& run : dataset.runs)
        if (run.kernel == kernel && run.shapes) return &run;
    return nullptr;
}

std::string table_of(const Comparison& c, const std::string& kernel) {
    std::string rows;
    for (const ComparedDataset& dataset : c.datasets)
        if (const ComparedRun* run = first_with_shapes(dataset, kernel)) {
            rows += "<tr><td>" + html_escape(dataset.name) + "</td>";
            for (const double value : run->shapes->percentiles)
                rows += fmt::format("<td>{:.3g}</td>", value);
            rows += "</tr>\n";
        }
    std::string head;
    for (const int p : LearnedShapes::kPercentiles) head += fmt::format("<th>{} %</th>", p);
    return "<div class='wide'><table><tr><th>" + html_escape(kernel) + "</th>" + head + "</tr>\n" +
           rows + "</table></div>\n";
}

std::string plot_of(const Comparison& c, const std::string& kernel) {
    Plot plot{"Learned by " + kernel, "exponent", "splats (%)", {}};
    plot.from_zero = true;
    for (const ComparedDataset& dataset : c.datasets) {
        PlotSeries series;
        series.name = dataset.name;
        series.stairs = true;
        if (const ComparedRun* run = first_with_shapes(dataset, kernel)) {
            const LearnedShapes& s = *run->shapes;
            plot.log_x = s.edges.front() > 0;
            if (!plot.log_x) plot.x_label = "weight of the second kernel";
            for (std::size_t i = 0; i < s.shares.size(); ++i)
                series.points.emplace_back(s.edges[i], 100 * s.shares[i]);
            series.points.emplace_back(s.edges.back(), 100 * s.shares.back());
        }
        plot.series.push_back(std::move(series));
    }
    return svg_plot(plot);
}

}  // namespace

std::optional<LearnedShapes> learned_shapes(const SplatModel& model) {
    if (!kernel_has_shape(model.kernel)) return {};
    std::vector<double> exponents;
    for (std::size_t i = 0; i < model.size(); ++i)
        if (sigmoid(model.opacity_logit[i]) >= ALPHA_CUTOFF_DEFAULT)
            exponents.push_back(
                splat_exponent(model.kernel, model.footprint, double{model.shape[i]}));
    if (exponents.empty()) return {};
    LearnedShapes shapes;
    shapes.edges = edges_of(shaped_kernel(model.kernel));
    shapes.shares.resize(kBins);
    for (const double exponent : exponents) {
        const auto above = std::upper_bound(shapes.edges.begin(), shapes.edges.end(), exponent);
        const auto bin = std::max<std::ptrdiff_t>(above - shapes.edges.begin() - 1, 0);
        shapes.shares[std::min<std::size_t>(std::size_t(bin), kBins - 1)] +=
            1.0 / static_cast<double>(exponents.size());
    }
    for (const int p : LearnedShapes::kPercentiles)
        shapes.percentiles.push_back(nearest_rank(exponents, p / 100.0));
    return shapes;
}

void read_shapes_of(ComparedRun& run) {
    if (run.at.empty() || run.at.back().model.empty()) return;
    const std::optional<int> kernel = kernel_from_name(run.kernel);
    if (kernel && kernel_has_shape(*kernel))
        run.shapes = learned_shapes(load_splats(run.at.back().model));
}

std::string shapes_html(const Comparison& c) {
    std::string plots, tables;
    for (const std::string& kernel : c.kernels)
        if (std::any_of(c.datasets.begin(), c.datasets.end(), [&](const ComparedDataset& dataset) {
                return first_with_shapes(dataset, kernel) != nullptr;
            })) {
            plots += plot_of(c, kernel);
            tables += table_of(c, kernel);
        }
    if (plots.empty()) return {};
    return "<h2>One kernel, or many?</h2><p class='soft'>The shapes that splats learned, of those "
           "that are drawn, first seed that is there. Where a curve is narrow, one kernel would "
           "do. The tables "
           "have percentiles.</p><div class='plots'>" +
           plots + "</div>\n" + tables;
}

nlohmann::json shapes_json(const LearnedShapes& shapes) {
    nlohmann::json json{{"edges", shapes.edges}, {"shares", shapes.shares}};
    for (std::size_t i = 0; i < shapes.percentiles.size(); ++i)
        json[fmt::format("p{}", LearnedShapes::kPercentiles[i])] = shapes.percentiles[i];
    return json;
}

}  // namespace darb
