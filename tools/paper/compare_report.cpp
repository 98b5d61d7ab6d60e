// SPDX-License-Identifier: MIT
// A comparison as text and as JSON.
#include "tools/paper/compare_report.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/data/image_io.h"
#include "engine/kernels/kernel_family.h"
#include "engine/report/html.h"
#include "tools/paper/compare_merge.h"
#include "tools/paper/compare_pictures.h"
#include "tools/paper/compare_runs.h"
#include "tools/paper/compare_stats.h"
#include "tools/paper/paper_numbers.h"

namespace darb {

namespace {

using Json = nlohmann::json;

Json optional_json(const std::optional<double>& v) {
    return v ? Json(*v) : Json(nullptr);
}

Json at_json(const ComparedAt& at) {
    Json views = Json::array();
    for (const ComparedView& v : at.views)
        views.push_back({{"name", v.name},
                         {"psnr_db", v.psnr_db},
                         {"ssim", v.ssim},
                         {"lpips", optional_json(v.lpips)},
                         {"flip", optional_json(v.flip)}});
    Json scales = Json::array();
    for (const ComparedScale& s : at.scales)
        scales.push_back({{"scale", s.scale}, {"psnr_db", s.psnr_db}, {"ssim", s.ssim}});
    return {{"iteration", at.iteration},
            {"training_s", at.seconds},
            {"psnr_db", at.psnr_db},
            {"ssim", at.ssim},
            {"lpips", optional_json(at.lpips)},
            {"flip", optional_json(at.flip)},
            {"splats", at.splats},
            {"model_mb", optional_json(at.model_mb)},
            {"views", views},
            {"scales", scales},
            {"arc_psnr_db", optional_json(at.arc_db)},
            {"off_path_psnr_db", optional_json(at.off_path_db)}};
}

Json run_json(const ComparedRun& run) {
    Json json{
        {"kernel", run.kernel},  {"trained_here", run.trained_here},      {"machine", run.machine},
        {"seed", run.seed},      {"folder", run.folder.string()},         {"failure", run.failure},
        {"notes", run.notes},    {"peak_mb", optional_json(run.peak_mb)}, {"at", Json::array()},
        {"curve", Json::array()}};
    for (const ComparedAt& at : run.at) json["at"].push_back(at_json(at));
    for (const CurvePoint& p : run.curve)
        json["curve"].push_back({{"iteration", p.iteration},
                                 {"seconds", p.seconds},
                                 {"loss", p.loss},
                                 {"splats", p.splats}});
    if (const auto& b = run.blending)
        json["blending"] = {{"blended_per_pixel", b->blended_per_pixel},
                            {"pairs_per_splat", b->intersections_per_splat},
                            {"ns_per_splat_pixel", b->ns_per_splat_pixel},
                            {"blend_ms", b->blend_ms},
                            {"frame_ms", b->frame_ms}};
    if (run.shapes) json["shapes"] = shapes_json(*run.shapes);
    return json;
}

Json summary_json(const Comparison& c, const ComparedDataset& dataset) {
    Json rows = Json::array();
    for (const int iteration : c.iterations)
        for (const std::string& kernel : c.kernels) {
            Json row{{"kernel", kernel}, {"iteration", iteration}};
            for (const Column& column : every_column(c)) {
                const OverSeeds v = over_seeds(dataset, kernel, iteration, column);
                row[column.json] = v.median ? Json{{"median", *v.median},
                                                   {"mean", *v.mean},
                                                   {"deviation", optional_json(v.deviation)},
                                                   {"low", v.low},
                                                   {"high", v.high},
                                                   {"runs", v.count}}
                                            : Json(nullptr);
            }
            rows.push_back(std::move(row));
        }
    return rows;
}

Json paper_json(const std::string& dataset) {
    Json rows = Json::array();
    for (const PaperNumbers& p : paper_numbers_of(dataset))
        rows.push_back({{"kernel", kernel_name(p.kernel)},
                        {"iteration", p.iteration},
                        {"psnr_db", p.psnr_db},
                        {"ssim", p.ssim},
                        {"lpips", p.lpips},
                        {"model_mb", p.model_mb},
                        {"training_s", p.training_s}});
    return rows;
}

}  // namespace

std::string comparison_table(const Comparison& c) {
    std::string text;
    for (const ComparedDataset& dataset : c.datasets)
        for (const int iteration : c.iterations) {
            const Table table = methods_table(c, dataset, iteration, every_column(c));
            text += table.title + "\n" + text_table(table) + "\n";
        }
    for (const Table& table : paired_tables(c))
        text += table.title + "\n" + text_table(table) + "\n";
    for (const ComparedDataset& dataset : c.datasets) text += pulse_lines(c, dataset);
    for (const ComparedDataset& dataset : c.datasets)
        for (const ComparedRun& run : dataset.runs)
            for (const auto& [what, why] : {std::pair{"failed", run.failure}, {"note", run.notes}})
                if (!why.empty())
                    text += fmt::format("{}: {}, {}, seed {}: {}\n", what, dataset.name, run.kernel,
                                        run.seed, why);
    return text;
}

nlohmann::json comparison_json(const Comparison& c) {
    Json datasets = Json::array();
    for (const ComparedDataset& dataset : c.datasets) {
        Json one{{"name", dataset.name},
                 {"path", dataset.path.string()},
                 {"fingerprint", dataset.fingerprint},
                 {"width", dataset.width},
                 {"height", dataset.height},
                 {"medians", summary_json(c, dataset)},
                 {"runs", Json::array()},
                 {"pulses", pulse_json(c, dataset)},
                 {"paper", paper_json(dataset.name)}};
        for (const ComparedRun& run : dataset.runs) one["runs"].push_back(run_json(run));
        datasets.push_back(std::move(one));
    }
    Json machines = Json::array();
    for (const Machine& machine : c.machines)
        machines.push_back({{"device", machine.device}, {"driver", machine.driver}});
    return {{"format", "darb-compare"},   {"format_version", kCompareFormatVersion},
            {"version", DARB_VERSION},    {"machines", machines},
            {"device", c.device},         {"settings", c.settings},
            {"seeds", c.seeds},           {"lpips", c.lpips_note},
            {"iterations", c.iterations}, {"kernels", c.kernels},
            {"added", c.added},           {"scales", c.scales},
            {"datasets", datasets},       {"means", means_json(c)},
            {"paired", paired_json(c)}};
}

// The page of `darb compare`: per data set the paper's tables, the curves, the paper's own figures,
// the cost of blending, and crops.

namespace {

constexpr int kSplatPicture = 110;    // px
constexpr double kSplatExtent = 4.2;  // standard deviations; times the pulses

/// The means of one group of data sets; the last row tells how many data sets each column covers.
Table means_table(const Comparison& c, int iteration, const Means& means,
                  const std::vector<Column>& columns) {
    std::string names;
    for (const std::string& name : means.names) names += (names.empty() ? "" : ", ") + name;
    const std::string group = means.benchmark.empty() ? "all data sets" : means.benchmark;
    Table table{
        fmt::format("means {} {}", group, iteration),
        fmt::format("Means, {}, {} iterations", group, format_number(iteration)),
        fmt::format("{}. Each over the data sets where every kernel has the value; the last "
                    "row says how many.{}",
                    names, means.benchmark.empty() ? "" : " The paper's are over the same scenes."),
        {{"kernel", "", Better::neither, 0, TableColumn::Kind::name}},
        {},
        Contest::down};
    for (const Column& column : columns)
        table.columns.push_back({column.name, column.unit,
                                 column.more_is_better ? Better::more : Better::less,
                                 column.decimals});
    const auto add = [&](const std::string& name,
                         const std::vector<std::vector<std::optional<double>>>& values,
                         std::size_t row, bool ranked) {
        TableRow& added = table.rows.emplace_back();
        added.cells.emplace_back(name);
        added.ranked = ranked;
        for (std::size_t k = 0; k < columns.size(); ++k) added.cells.emplace_back(values[k][row]);
    };
    for (std::size_t row = 0; row < c.kernels.size(); ++row) {
        add(method_text(c, c.kernels[row]), means.values, row, true);
        if (std::any_of(means.paper.begin(), means.paper.end(),
                        [&](const auto& values) { return values[row].has_value(); }))
            add(c.kernels[row] + ", the paper", means.paper, row, false);
    }
    TableRow& last = table.rows.emplace_back();
    last.ranked = false;
    last.cells.emplace_back("data sets");
    for (const int covered : means.covered)
        last.cells.push_back(covered > 0 ? TableCell(fmt::format("{}", covered)) : TableCell());
    return table;
}

using Points = std::vector<std::pair<double, double>>;

/// The points of all runs of a method, averaged point by point as far as all of them go, with a
/// standard deviation to both sides as a band, or the range of two runs.
PlotSeries mean_curve(const std::string& method, const std::vector<Points>& runs, bool dots) {
    PlotSeries series{method};
    series.dots = dots;
    std::size_t length = runs.empty() ? 0 : runs.front().size();
    for (const Points& points : runs) length = std::min(length, points.size());
    const double count = static_cast<double>(runs.size());
    for (std::size_t i = 0; i < length; ++i) {
        double x = 0, y = 0, squares = 0, low = 1e300, high = -1e300;
        for (const Points& points : runs) {
            x += points[i].first / count;
            y += points[i].second / count;
            low = std::min(low, points[i].second);
            high = std::max(high, points[i].second);
        }
        for (const Points& points : runs)
            squares += (points[i].second - y) * (points[i].second - y);
        series.points.emplace_back(x, y);
        series.titles.push_back(fmt::format("{}: {:.5g}, {:.5g}", method, x, y));
        if (runs.size() < 2) continue;
        const double deviation = std::sqrt(squares / (count - 1));
        series.band.push_back(runs.size() == 2 ? std::pair{low, high}
                                               : std::pair{y - deviation, y + deviation});
    }
    series.dots |= length == 1;  // a line of one point is not seen
    return series;
}

/// One curve for each method, over its seeds.
template <class Of>
Figure plot(const Comparison& c, const ComparedDataset& dataset, Plot frame, bool dots,
            const Of& points) {
    frame.legend_beside = true;
    for (const std::string& method : c.kernels) {
        std::vector<Points> runs;
        for (const ComparedRun& run : dataset.runs)
            if (run.kernel == method && run.failure.empty() && run.trained_here)
                runs.push_back(points(run));
        frame.series.push_back(mean_curve(method, runs, dots));
    }
    return {fmt::format("{} {} {}", dataset.name, frame.title, frame.x_label), frame};
}

void add_curves(const Comparison& c, const ComparedDataset& dataset, Report& report) {
    const auto of_curve = [](auto x, auto y) {
        return [x, y](const ComparedRun& run) {
            Points points;
            for (const CurvePoint& p : run.curve) points.emplace_back(double(p.*x), double(p.*y));
            return points;
        };
    };
    const auto of_at = [](auto y) {
        return [y](const ComparedRun& run) {
            Points points;
            for (const ComparedAt& at : run.at) points.emplace_back(at.seconds, at.*y);
            return points;
        };
    };
    const auto speed = [](auto x) {
        return [x](const ComparedRun& run) {
            Points points;
            for (std::size_t i = 1; i < run.curve.size(); ++i) {
                const CurvePoint &a = run.curve[i - 1], &b = run.curve[i];
                const double seconds = std::max(b.seconds - a.seconds, 1e-9);
                points.emplace_back(double(b.*x), (b.iteration - a.iteration) / seconds);
            }
            return points;
        };
    };
    std::vector<Figure> figures;
    const auto add = [&](Plot frame, bool dots, const auto& points) {
        figures.push_back(plot(c, dataset, std::move(frame), dots, points));
    };
    add({"Loss", "iterations", "loss", {}, true}, false,
        of_curve(&CurvePoint::iteration, &CurvePoint::loss));
    add({"Loss", "training time (s)", "loss", {}, true}, false,
        of_curve(&CurvePoint::seconds, &CurvePoint::loss));
    add({"Speed", "iterations", "iterations a second", {}, false, true}, false,
        speed(&CurvePoint::iteration));
    add({"Speed", "training time (s)", "iterations a second", {}, false, true}, false,
        speed(&CurvePoint::seconds));
    add({"Splats", "iterations", "splats", {}, false, true}, false,
        of_curve(&CurvePoint::iteration, &CurvePoint::splats));
    add({"Held-out PSNR", "training time (s)", "PSNR (dB)", {}}, true, of_at(&ComparedAt::psnr_db));
    report.plots(std::move(figures), c.kernels);
}

Table paper_table(const ComparedDataset& dataset) {
    Table table{"paper " + dataset.name,
                "What the paper prints for this scene",
                "One RTX 4090, single runs, its own code.",
                {{"kernel", "", Better::neither, 0, TableColumn::Kind::name},
                 {"iterations", "", Better::neither, 0},
                 {"PSNR", "dB"},
                 {"SSIM", "", Better::neither, 4},
                 {"LPIPS", "", Better::neither, 4},
                 {"model", "MB", Better::neither, 0},
                 {"training", "s", Better::neither, 0}},
                {}};
    for (const PaperNumbers& p : paper_numbers_of(dataset.name))
        table.rows.push_back({{std::string(kernel_name(p.kernel)), double(p.iteration), p.psnr_db,
                               p.ssim, p.lpips, p.model_mb, p.training_s}});
    return table;
}

/// The paper's Figure 2: how one covariance looks with each kernel.
void add_splat_figure(const Comparison& c, Report& report) {
    std::vector<Captioned> pictures;
    Plot profile{"Splats of one covariance", "distance (standard deviations)", "weight", {}};
    profile.legend_beside = true;
    std::vector<std::string> names;
    int pulses = 1;
    for (const std::string& name : c.kernels)
        if (const std::optional<int> kernel = kernel_from_name(name)) {
            names.push_back(name);
            pulses = std::max(pulses, kernel_pulses(*kernel));
        }
    const double extent = kSplatExtent * pulses;
    for (const std::string& name : names) {
        const int k = kernel_from_name(name).value();
        const double scale = covariance_scale(k, Footprint::psi);
        const auto w = [&](double q) { return kernel_value(k, Footprint::psi, q / scale); };
        const auto at = [&](int x, int y) {
            const double u = extent * (2 * (x + 0.5) / kSplatPicture - 1);
            const double v = extent * (2 * (y + 0.5) / kSplatPicture - 1);
            const double a = 0.8 * u + 0.6 * v, b = -0.6 * u + 0.8 * v;  // a turned ellipse, 2 to 1
            return w(a * a / 2 + b * b * 2);
        };
        pictures.push_back({grey_field(kSplatPicture, 1, at), name});
        PlotSeries series{name};
        for (int i = 0; i <= 200 * pulses; ++i)
            series.points.emplace_back(0.022 * i, w(0.022 * i * 0.022 * i));
        profile.series.push_back(std::move(series));
    }
    if (names.empty()) return;
    report.heading("One covariance, every kernel");
    report.html(
        "<p class='soft'>The paper's Figure 2: splats of the same 3D covariance, psi "
        "included.</p>" +
        html_pictures(pictures, 150));
    report.plots({{"", profile}}, names);
}

void add_dataset(const Comparison& c, const ComparedDataset& dataset, Report& report) {
    report.heading(dataset.name);
    for (const int iteration : c.iterations)
        report.table(methods_table(c, dataset, iteration, every_column(c)));
    report.table(paper_table(dataset));
    report.table(pulse_table(c, dataset));
    add_curves(c, dataset, report);
    if (std::any_of(dataset.runs.begin(), dataset.runs.end(),
                    [](const ComparedRun& run) { return run.blending.has_value(); })) {
        Table table = methods_table(c, dataset, c.iterations.back(), blending_columns());
        table.title = "What blending takes, " + table.title;
        table.caption.clear();
        report.table(std::move(table));
    }
    for (const ComparedRun& run : dataset.runs)
        for (const auto& [what, why] : {std::pair{"Failed", run.failure}, {"Note", run.notes}})
            if (!why.empty())
                report.html(fmt::format("<p>{}: {}, seed {}: {}</p>\n", what,
                                        html_escape(run.kernel), run.seed, html_escape(why)));
    add_pictures(c, dataset, report);
}

}  // namespace

Report comparison_report(const Comparison& c) {
    Report report("Kernels compared", c.device);
    for (const int iteration : c.iterations) {
        const std::vector<Column> columns = every_column(c);
        for (const Means& means : means_of(c, iteration, columns))
            report.table(means_table(c, iteration, means, columns), 2);
        for (Table& table : tables_by_dataset(c, iteration)) report.table(std::move(table));
    }
    for (Table& table : paired_tables(c)) report.table(std::move(table), 2);
    add_shapes(c, report);
    for (const ComparedDataset& dataset : c.datasets) add_dataset(c, dataset, report);
    add_splat_figure(c, report);
    report.html(fmt::format(
        "<h2>How to read it</h2><p>Bold: best; underlined: second best of three or more, as they "
        "are printed; all that tie are marked. With several seeds only what no other "
        "kernel's range overlaps is bold, and none is underlined. "
        "Held-out views. {} seed{}: with two, means and ranges in brackets; with more, means and "
        "standard deviations, which are the bands of the curves; crops are of the first. "
        "{}</p><p>{}</p><p>Model: the PLY file. Peak: device memory, over the whole run, "
        "whatever the iteration. Training: without evaluation. Splats blended per pixel are those "
        "with alpha at or over the cut-off before "
        "the pixel is opaque, counted in double precision; ns per splat and pixel is the time of "
        "the blend pass over them.</p>\n",
        c.seeds, c.seeds == 1 ? "" : "s", html_escape(c.settings), html_escape(c.lpips_note)));
    return report;
}

}  // namespace darb

// NLOHMANN_DEFINE_TYPE looks for these by the type's namespace.
namespace nlohmann {
template <class T>
struct adl_serializer<std::optional<T>> {
    static void to_json(json& j, const std::optional<T>& value) {
        j = value ? json::array({*value}) : json::array();
    }
    static void from_json(const json& j, std::optional<T>& value) {
        value = j.empty() ? std::nullopt : std::optional<T>(j.at(0).get<T>());
    }
};
}  // namespace nlohmann

namespace darb {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ComparedView, name, psnr_db, ssim, lpips, flip, picture)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ComparedScale, scale, psnr_db, ssim)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ComparedAt, iteration, seconds, psnr_db, ssim, lpips, flip,
                                   splats, model_mb, model, views, scales, arc_db, off_path_db)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CurvePoint, iteration, seconds, loss, splats)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LearnedShapes, edges, shares, percentiles)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(BlendStatistics, blended_per_pixel, intersections_per_splat,
                                   blend_ms, frame_ms, ns_per_splat_pixel)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ComparedRun, kernel, trained_here, machine, seed, folder,
                                   failure, notes, exit_code, at, curve, peak_mb, blending, shapes)

Bytes bytes_of_runs(const std::vector<ComparedRun>& runs) {
    const std::vector<std::uint8_t> cbor = nlohmann::json::to_cbor(runs);
    const auto bytes = std::as_bytes(std::span(cbor));
    return {bytes.begin(), bytes.end()};
}

std::vector<ComparedRun> runs_of_bytes(std::span<const std::byte> bytes) {
    const auto* const first = reinterpret_cast<const std::uint8_t*>(bytes.data());
    return nlohmann::json::from_cbor(first, first + bytes.size());
}

std::vector<ComparedRun> runs_of_all(Ranks& ranks, const std::vector<ComparedRun>& own,
                                     std::size_t items) {
    std::vector<std::vector<ComparedRun>> of_rank;
    for (const Bytes& bytes : ranks.gather(bytes_of_runs(own)))
        of_rank.push_back(runs_of_bytes(bytes));
    std::vector<ComparedRun> runs;
    for (std::size_t i = 0; i < items; ++i) {
        std::vector<ComparedRun>& its = of_rank[turn_of(i, of_rank.size())];
        const std::size_t at = i / of_rank.size();
        if (at >= its.size()) continue;
        runs.push_back(std::move(its[at]));
    }
    return runs;
}

}  // namespace darb
