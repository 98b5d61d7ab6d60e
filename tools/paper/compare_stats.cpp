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
        {"FLIP", "", "flip", 4, false,
         [](const ComparedRun&, const ComparedAt& at) { return at.flip; }},
        {"model", "MB", "model_mb", 2, false,
         [](const ComparedRun&, const ComparedAt& at) { return at.model_mb; }},
        {"splats", "", "splats", 0, false,
         [](const ComparedRun&, const ComparedAt& at) { return Value(at.splats); }},
        {"peak", "MB", "peak_mb", 0, false,
         [](const ComparedRun& run, const ComparedAt&) { return run.peak_mb; }},
        {"training", "s", "training_s", 1, false,
         [](const ComparedRun& run, const ComparedAt& at) {
             return run.trained_here ? Value(at.seconds) : Value();
         }},
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
    const int count = static_cast<int>(values.size());
    OverSeeds over{quantile(values, 0.5), 0.0, {}, values.front(), values.back(), count};
    for (const double v : values) *over.mean += v / count;
    if (count < 3) return over;
    double squares = 0;
    for (const double v : values) squares += (v - *over.mean) * (v - *over.mean);
    over.deviation = std::sqrt(squares / (count - 1));
    return over;
}

TableCell OverSeeds::cell() const {
    TableCell cell(mean);
    if (count < 2) return cell;
    cell.deviation = deviation;
    cell.span = {low, high};
    cell.runs = count;
    return cell;
}

std::string method_text(const Comparison& c, const std::string& method) {
    const bool added = std::find(c.added.begin(), c.added.end(), method) != c.added.end();
    return added ? method + " (not trained here)" : method;
}

namespace {

TableColumn table_column(const Column& column) {
    return {column.name, column.unit, column.more_is_better ? Better::more : Better::less,
            column.decimals};
}

std::string seeds_text(const Comparison& c) {
    if (c.seeds < 2) return "";
    if (c.seeds == 2) return " Means and range of 2 seeds.";
    return fmt::format(" Mean and standard deviation over {} seeds.", c.seeds);
}

/// PSNR, SSIM, LPIPS and FLIP.
std::vector<Column> picture_columns() {
    std::vector<Column> columns;
    for (const Column& column : quality_columns())
        for (const char* name : {"psnr_db", "ssim", "lpips", "flip"})
            if (column.json == name) columns.push_back(column);
    return columns;
}

}  // namespace

Table methods_table(const Comparison& c, const ComparedDataset& dataset, int iteration,
                    const std::vector<Column>& columns) {
    Table table;
    table.name = fmt::format("{} {} {}", columns.front().json == "psnr_db" ? "quality" : "blending",
                             dataset.name, iteration);
    table.title = fmt::format("{}, {} iterations", dataset.name, format_number(iteration));
    table.caption = "Held-out views." + seeds_text(c);
    table.columns = {{"kernel", "", Better::neither, 0, TableColumn::Kind::name}};
    for (const Column& column : columns) table.columns.push_back(table_column(column));
    for (const std::string& method : c.kernels) {
        TableRow& row = table.rows.emplace_back();
        row.cells.emplace_back(method_text(c, method));
        for (const Column& column : columns)
            row.cells.push_back(over_seeds(dataset, method, iteration, column).cell());
    }
    table.contest = Contest::down;
    return table;
}

std::vector<Table> tables_by_dataset(const Comparison& c, int iteration) {
    std::vector<Table> tables;
    if (c.datasets.size() < 2) return tables;
    for (const Column& column : picture_columns()) {
        Table table{
            fmt::format("{} by data set {}", column.name, iteration),
            fmt::format("{}, {} iterations", table_column(column).name, format_number(iteration)),
            (column.more_is_better ? "More is better." : "Less is better.") + seeds_text(c),
            {{"data set", "", Better::neither, 0, TableColumn::Kind::name}},
            {},
            Contest::across};
        TableRow mean;
        mean.cells.emplace_back("mean");
        bool any = false;
        for (const std::string& method : c.kernels) {
            TableColumn one = table_column(column);
            one.name = method_text(c, method);
            table.columns.push_back(one);
        }
        std::vector<double> sums(c.kernels.size(), 0.0);
        int covered = 0;
        for (const ComparedDataset& dataset : c.datasets) {
            TableRow& row = table.rows.emplace_back();
            row.cells.emplace_back(dataset.name);
            bool whole = true;
            for (const std::string& method : c.kernels) {
                row.cells.push_back(over_seeds(dataset, method, iteration, column).cell());
                whole &= row.cells.back().value.has_value();
                any |= row.cells.back().value.has_value();
            }
            covered += whole ? 1 : 0;
            for (std::size_t k = 0; whole && k < sums.size(); ++k)
                sums[k] += *row.cells[k + 1].value;
        }
        for (const double sum : sums)
            mean.cells.push_back(covered > 0 ? TableCell(sum / covered) : TableCell());
        if (covered > 0) table.rows.push_back(std::move(mean));
        if (covered > 0 && covered < static_cast<int>(c.datasets.size()))
            table.caption += " The mean is over the data sets where every method has the value.";
        if (any) tables.push_back(std::move(table));
    }
    return tables;
}

double student_t_95(int freedom) {
    // The probability within +-t, in closed form for whole degrees of freedom (Abramowitz and
    // Stegun 26.7.3 and 26.7.4), and t by bisection.
    const auto within = [&](double t) {
        const double angle = std::atan(t / std::sqrt(double(freedom)));
        const double cosine = std::cos(angle), sine = std::sin(angle);
        const bool odd = freedom % 2 == 1;
        double term = odd ? cosine : 1, sum = freedom == 1 ? 0 : term;
        for (int k = odd ? 3 : 2; k <= freedom - 2; k += 2) {
            term *= cosine * cosine * (k - 1) / k;
            sum += term;
        }
        return odd ? 2 / std::acos(-1.0) * (angle + sine * sum) : sine * sum;
    };
    double low = 0, high = 100;
    for (int i = 0; i < 100; ++i) {
        const double middle = (low + high) / 2;
        (within(middle) < 0.95 ? low : high) = middle;
    }
    return high;
}

std::string base_method(const Comparison& c) {
    const std::string gaussian(kernel_name(KERNEL_GAUSSIAN));
    if (std::find(c.kernels.begin(), c.kernels.end(), gaussian) != c.kernels.end()) return gaussian;
    return c.kernels.empty() ? "" : c.kernels.front();
}

std::optional<PairedDifference> paired_difference(const ComparedDataset& dataset,
                                                  const std::string& base, const std::string& other,
                                                  int iteration, const Column& column) {
    const auto value = [&](const std::string& method, std::uint64_t seed) {
        for (const ComparedRun& run : dataset.runs)
            for (const ComparedAt& at : run.at)
                if (run.kernel == method && run.seed == seed && at.iteration == iteration)
                    if (const Value v = column.value(run, at); v && std::isfinite(*v)) return v;
        return Value();
    };
    std::vector<double> differences;
    for (const ComparedRun& run : dataset.runs) {
        if (run.kernel != base) continue;
        const Value first = value(base, run.seed), second = value(other, run.seed);
        if (first && second) differences.push_back(*second - *first);
    }
    const int count = static_cast<int>(differences.size());
    if (count < 3) return {};
    PairedDifference found{0, 0, 0, count};
    for (const double d : differences) found.mean += d / count;
    double squares = 0;
    for (const double d : differences) squares += (d - found.mean) * (d - found.mean);
    const double half = student_t_95(count - 1) * std::sqrt(squares / (count - 1) / count);
    found.low = found.mean - half;
    found.high = found.mean + half;
    return found;
}

std::vector<Table> paired_tables(const Comparison& c) {
    std::vector<Table> tables;
    const std::string base = base_method(c);
    if (c.iterations.empty()) return tables;
    const int iteration = c.iterations.back();
    using Kind = TableColumn::Kind;
    for (const Column& column : picture_columns()) {
        Table table{fmt::format("{} against {}", column.name, base),
                    fmt::format("{} less that of {}, {} iterations", column.name, base,
                                format_number(iteration)),
                    "Differences of runs with equal seeds, their mean and its 95 % interval by "
                    "Student's t. Clear: 0 is outside of the interval.",
                    {{"data set", "", Better::neither, 0, Kind::name},
                     {"kernel", "", Better::neither, 0, Kind::name},
                     {"difference", column.unit, Better::neither, column.decimals + 1},
                     {"95 % interval", column.unit, Better::neither, column.decimals + 1},
                     {"seeds", "", Better::neither, 0},
                     {"clear", "", Better::neither, 0, Kind::name}},
                    {}};
        for (const ComparedDataset& dataset : c.datasets)
            for (const std::string& method : c.kernels)
                if (method != base)
                    if (const auto d = paired_difference(dataset, base, method, iteration, column))
                        table.rows.push_back(
                            {{dataset.name, method, d->mean, TableCell::between(d->low, d->high),
                              double(d->seeds), d->clear() ? "yes" : "no"}});
        if (!table.rows.empty()) tables.push_back(std::move(table));
    }
    return tables;
}

nlohmann::json paired_json(const Comparison& c) {
    nlohmann::json rows = nlohmann::json::array();
    const std::string base = base_method(c);
    for (const int iteration : c.iterations)
        for (const ComparedDataset& dataset : c.datasets)
            for (const std::string& method : c.kernels)
                for (const Column& column : picture_columns())
                    if (method != base)
                        if (const auto d =
                                paired_difference(dataset, base, method, iteration, column))
                            rows.push_back({{"data_set", dataset.name},
                                            {"iteration", iteration},
                                            {"kernel", method},
                                            {"base", base},
                                            {"value", column.json},
                                            {"mean_difference", d->mean},
                                            {"low_95", d->low},
                                            {"high_95", d->high},
                                            {"seeds", d->seeds}});
    return rows;
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
                values.push_back(over_seeds(*set, kernel, iteration, column).mean);
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
        const std::optional<int> known = kernel_from_name(name);
        if (!known) continue;  // a method that was not trained here
        const int row = *known;
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

Table pulse_table(const Comparison& comparison, const ComparedDataset& dataset) {
    Table table{fmt::format("pulses {}", dataset.name),
                "More pulses against one",
                "The paper: less memory and less quality. Memory is that of the model.",
                {{"kernel", "", Better::neither, 0, TableColumn::Kind::name},
                 {"pulses", "", Better::neither, 0},
                 {"iterations", "", Better::neither, 0},
                 {"PSNR", "dB"},
                 {"SSIM"},
                 {"splats"},
                 {"model"},
                 {"peak"},
                 {"training"},
                 {"less memory"},
                 {"less PSNR"},
                 {"less SSIM"}},
                {}};
    for (const int iteration : comparison.iterations)
        for (const PulseChange& c : pulse_changes(comparison, dataset, iteration))
            table.rows.push_back(
                {{c.kernel, double(c.pulses), double(iteration), difference_text(c.psnr_db, 2),
                  difference_text(c.ssim, 4), ratio_text(c.splats), ratio_text(c.model),
                  ratio_text(c.peak), ratio_text(c.seconds), yes(c.model, c.less_memory()),
                  yes(c.psnr_db, c.less_psnr()), yes(c.ssim, c.less_ssim())}});
    return table;
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

Table shapes_table(const Comparison& c, const std::string& kernel) {
    Table table{"shapes " + kernel, kernel, "Percentiles of what splats learned.", {}, {}};
    table.columns = {{"data set", "", Better::neither, 0, TableColumn::Kind::name}};
    for (const int p : LearnedShapes::kPercentiles)
        table.columns.push_back({fmt::format("{} %", p)});
    for (const ComparedDataset& dataset : c.datasets)
        if (const ComparedRun* run = first_with_shapes(dataset, kernel)) {
            TableRow& row = table.rows.emplace_back();
            row.cells.emplace_back(dataset.name);
            for (const double value : run->shapes->percentiles)
                row.cells.emplace_back(fmt::format("{:.3g}", value));
        }
    return table;
}

Figure plot_of(const Comparison& c, const std::string& kernel) {
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
    return {"", plot};
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

void add_shapes(const Comparison& c, Report& report) {
    std::vector<Figure> figures;
    std::vector<Table> tables;
    for (const std::string& kernel : c.kernels)
        if (std::any_of(c.datasets.begin(), c.datasets.end(), [&](const ComparedDataset& dataset) {
                return first_with_shapes(dataset, kernel) != nullptr;
            })) {
            figures.push_back(plot_of(c, kernel));
            tables.push_back(shapes_table(c, kernel));
        }
    if (figures.empty()) return;
    report.heading("One kernel, or many?");
    report.html(
        "<p class='soft'>The shapes that splats learned, of those that are drawn, first "
        "seed that is there. Where a curve is narrow, one kernel would do.</p>");
    report.plots(std::move(figures));
    for (Table& table : tables) report.table(std::move(table));
}

nlohmann::json shapes_json(const LearnedShapes& shapes) {
    nlohmann::json json{{"edges", shapes.edges}, {"shares", shapes.shares}};
    for (std::size_t i = 0; i < shapes.percentiles.size(); ++i)
        json[fmt::format("p{}", LearnedShapes::kPercentiles[i])] = shapes.percentiles[i];
    return json;
}

}  // namespace darb
