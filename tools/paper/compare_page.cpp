// The page of `darb compare`: per data set the tables of the paper, its curves, the paper's own
// numbers, what blending takes, and crops.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/kernels/kernel_family.h"
#include "engine/report/html.h"
#include "engine/report/page.h"
#include "engine/report/svg_plot.h"
#include "tools/paper/compare_crops.h"
#include "tools/paper/compare_means.h"
#include "tools/paper/compare_pulses.h"
#include "tools/paper/compare_runs.h"
#include "tools/paper/compare_shapes.h"
#include "tools/paper/compare_stats.h"
#include "tools/paper/paper_numbers.h"
#include "tools/paper/pictures.h"

namespace darb {

namespace {

constexpr int kSplatPicture = 110;    // px
constexpr double kSplatExtent = 4.2;  // standard deviations; times the pulses
constexpr int kCropWidth = 200;       // px on the page

std::string marked(const std::string& text, std::size_t row, const Marks& marks) {
    if (marks[row] == Mark::best) return "<b>" + text + "</b>";
    if (marks[row] == Mark::third) return "<u>" + text + "</u>";
    return text;
}

std::string head_of(const std::string& first, const std::vector<Column>& columns) {
    std::string html = "<div class='wide'><table><tr><th>" + first + "</th>";
    for (const Column& c : columns)
        html += fmt::format("<th>{}{}</th>", c.name, c.unit.empty() ? "" : " (" + c.unit + ")");
    return html + "</tr>\n";
}

std::string table_of(const Comparison& c, const ComparedDataset& dataset, int iteration,
                     const std::vector<Column>& columns) {
    std::vector<Marks> marks;
    std::vector<std::vector<OverSeeds>> values(columns.size());
    for (std::size_t k = 0; k < columns.size(); ++k) {
        for (const std::string& kernel : c.kernels)
            values[k].push_back(over_seeds(dataset, kernel, iteration, columns[k]));
        marks.push_back(marks_over_seeds(values[k], columns[k]));
    }
    std::string html = head_of("kernel", columns);
    for (std::size_t row = 0; row < c.kernels.size(); ++row) {
        html += "<tr><td>" + html_escape(c.kernels[row]) + "</td>";
        for (std::size_t k = 0; k < columns.size(); ++k)
            html += "<td>" +
                    marked(spread_text(values[k][row], columns[k].decimals), row, marks[k]) +
                    "</td>";
        html += "</tr>\n";
    }
    return html + "</table></div>\n";
}

std::string means_row(const std::string& name, const std::vector<Column>& columns,
                      const std::vector<std::vector<std::optional<double>>>& values,
                      std::size_t row, const std::vector<Marks>* marks) {
    std::string html = "<tr><td>" + html_escape(name) + "</td>";
    for (std::size_t k = 0; k < columns.size(); ++k) {
        const auto& value = values[k][row];
        const std::string text = value ? format_number(*value, columns[k].decimals) : "-";
        html += "<td>" + (marks == nullptr ? text : marked(text, row, (*marks)[k])) + "</td>";
    }
    return html + "</tr>\n";
}

/// The means of one group of data sets; the last row says how many each column covers.
std::string means_table(const Comparison& c, const Means& means,
                        const std::vector<Column>& columns) {
    std::vector<Marks> marks;
    for (std::size_t k = 0; k < columns.size(); ++k)
        marks.push_back(marks_of(means.values[k], columns[k]));
    std::string html = head_of("kernel", columns);
    for (std::size_t row = 0; row < c.kernels.size(); ++row) {
        html += means_row(c.kernels[row], columns, means.values, row, &marks);
        if (std::any_of(means.paper.begin(), means.paper.end(),
                        [&](const auto& values) { return values[row].has_value(); }))
            html += means_row(c.kernels[row] + ", the paper", columns, means.paper, row, nullptr);
    }
    html += "<tr><td>data sets</td>";
    for (const int covered : means.covered) html += fmt::format("<td>{}</td>", covered);
    return html + "</tr>\n</table></div>\n";
}

std::string means_part(const Comparison& c, int iteration) {
    const std::vector<Column> columns = shown_columns(c);
    std::string html;
    for (const Means& means : means_of(c, iteration, columns)) {
        std::string names;
        for (const std::string& name : means.names) names += (names.empty() ? "" : ", ") + name;
        html += fmt::format(
                    "<h2>Means, {}, {} iterations</h2><p class='soft'>{}. Each over the data sets "
                    "where every kernel has the value; the last row says how many. {}</p>",
                    means.benchmark.empty() ? "all data sets" : means.benchmark,
                    format_number(iteration), html_escape(names),
                    means.benchmark.empty() ? "" : "The paper's are over the same scenes.") +
                means_table(c, means, columns);
    }
    return html;
}

const ComparedRun* first_run(const Comparison& c, const ComparedDataset& dataset,
                             std::size_t kernel) {
    for (const ComparedRun& run : dataset.runs)
        if (run.kernel == c.kernels[kernel] && run.failure.empty()) return &run;
    return nullptr;
}

/// One curve a kernel, of the first seed.
template <class Points>
std::string plot(const Comparison& c, const ComparedDataset& dataset, Plot frame, bool dots,
                 const Points& points) {
    for (std::size_t k = 0; k < c.kernels.size(); ++k) {
        PlotSeries series;
        series.dots = dots;
        if (const ComparedRun* run = first_run(c, dataset, k)) {
            series.points = points(*run);
            series.dots |= series.points.size() == 1;  // a line of one point is not seen
            for (const auto& [x, y] : series.points)
                series.titles.push_back(fmt::format("{}: {:.5g}, {:.5g}", c.kernels[k], x, y));
        }
        frame.series.push_back(std::move(series));
    }
    return svg_plot(frame);
}

std::string curves(const Comparison& c, const ComparedDataset& dataset) {
    using Points = std::vector<std::pair<double, double>>;
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
    std::string html;
    html += plot(c, dataset, {"Loss", "iterations", "loss", {}, true}, false,
                 of_curve(&CurvePoint::iteration, &CurvePoint::loss));
    html += plot(c, dataset, {"Loss", "training time (s)", "loss", {}, true}, false,
                 of_curve(&CurvePoint::seconds, &CurvePoint::loss));
    html += plot(c, dataset, {"Speed", "iterations", "iterations a second", {}, false, true}, false,
                 speed(&CurvePoint::iteration));
    html += plot(c, dataset, {"Speed", "training time (s)", "iterations a second", {}, false, true},
                 false, speed(&CurvePoint::seconds));
    html += plot(c, dataset, {"Splats", "iterations", "splats", {}, false, true}, false,
                 of_curve(&CurvePoint::iteration, &CurvePoint::splats));
    html += plot(c, dataset, {"Held-out PSNR", "training time (s)", "PSNR (dB)", {}}, true,
                 of_at(&ComparedAt::psnr_db));
    return html_legend(c.kernels) + "<div class='plots'>" + html + "</div>\n";
}

std::string paper_table(const ComparedDataset& dataset) {
    const std::vector<PaperNumbers> rows = paper_numbers_of(dataset.name);
    if (rows.empty()) return {};
    std::string html =
        "<h3>What the paper prints for this scene</h3><div class='wide'><table><tr><th>kernel</th>"
        "<th>iterations</th><th>PSNR (dB)</th><th>SSIM</th><th>LPIPS</th><th>model (MB)</th>"
        "<th>training (s)</th></tr>\n";
    for (const PaperNumbers& p : rows)
        html += fmt::format(
            "<tr><td>{}</td><td>{}</td><td>{:.2f}</td><td>{:.4f}</td><td>{:.4f}</td><td>{:.0f}</td>"
            "<td>{:.0f}</td></tr>\n",
            kernel_name(p.kernel), format_number(p.iteration), p.psnr_db, p.ssim, p.lpips,
            p.model_mb, p.training_s);
    return html + "</table></div><p class='soft'>One RTX 4090, single runs, its own code.</p>\n";
}

std::string crop_rows(const Comparison& c, const ComparedDataset& dataset) {
    const ComparedRun* base = nullptr;
    for (std::size_t k = 0; k < c.kernels.size(); ++k)
        if (const ComparedRun* run = first_run(c, dataset, k);
            run != nullptr && (base == nullptr || run->kernel == kernel_name(KERNEL_GAUSSIAN)))
            base = run;
    if (base == nullptr || base->at.empty()) return {};
    std::string html;
    for (std::size_t k = 0; k < c.kernels.size(); ++k) {
        const ComparedRun* run = first_run(c, dataset, k);
        if (run == nullptr || run == base || run->at.empty()) continue;
        for (const Crop& crop : crops_of(base->at.back(), run->at.back())) {
            const std::string gain =
                fmt::format("{}: {}", run->kernel, format_number(-1e3 * crop.gain, 2));
            html +=
                html_pictures({{crop.photo, fmt::format("{} at {}, {}", crop.view, crop.x, crop.y)},
                               {crop.first, base->kernel},
                               {crop.second, gain}},
                              kCropWidth);
        }
    }
    return html.empty()
               ? ""
               : fmt::format(
                     "<h3>Where the errors differ most</h3><p class='soft'>Photo, {0}, kernel: "
                     "first where the kernel gains most on {0}, then where it loses most; the "
                     "number is its squared error less that of {0}, times 1,000.</p>",
                     html_escape(base->kernel)) +
                     html;
}

/// The paper's Figure 2: what one and the same covariance looks like in each kernel.
std::string splat_figure(const Comparison& c) {
    std::vector<Captioned> pictures;
    Plot profile{"Splats of one covariance", "distance (standard deviations)", "weight", {}};
    std::vector<std::string> names;
    int pulses = 1;
    for (const std::string& name : c.kernels)
        pulses = std::max(pulses, kernel_pulses(kernel_from_name(name).value()));
    const double extent = kSplatExtent * pulses;
    for (const std::string& name : c.kernels) {
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
        PlotSeries series;
        for (int i = 0; i <= 200 * pulses; ++i)
            series.points.emplace_back(0.022 * i, w(0.022 * i * 0.022 * i));
        profile.series.push_back(std::move(series));
        names.push_back(name);
    }
    return "<h2>One covariance, every kernel</h2><p class='soft'>The paper's Figure 2: splats of "
           "the same 3D covariance, psi included.</p>" +
           html_pictures(pictures, 150) + html_legend(names) + "<div class='plots'>" +
           svg_plot(profile) + "</div>\n";
}

std::string dataset_part(const Comparison& c, const ComparedDataset& dataset) {
    std::string html = "<h2>" + html_escape(dataset.name) + "</h2>\n";
    for (const int iteration : c.iterations)
        html += fmt::format("<h3>{} iterations</h3>", format_number(iteration)) +
                table_of(c, dataset, iteration, shown_columns(c));
    html += paper_table(dataset) + pulse_html(c, dataset) + curves(c, dataset);
    if (std::any_of(dataset.runs.begin(), dataset.runs.end(),
                    [](const ComparedRun& run) { return run.blending.has_value(); }))
        html += "<h3>What blending takes</h3>" +
                table_of(c, dataset, c.iterations.back(), blending_columns());
    for (const ComparedRun& run : dataset.runs)
        for (const auto& [what, why] : {std::pair{"Failed", run.failure}, {"Note", run.notes}})
            if (!why.empty())
                html += fmt::format("<p>{}: {}, seed {}: {}</p>\n", what, html_escape(run.kernel),
                                    run.seed, html_escape(why));
    return html + crop_rows(c, dataset);
}

}  // namespace

std::string comparison_html(const Comparison& c) {
    std::string body;
    for (const int iteration : c.iterations) body += means_part(c, iteration);
    body += shapes_html(c);
    for (const ComparedDataset& dataset : c.datasets) body += dataset_part(c, dataset);
    body += splat_figure(c);
    body += fmt::format(
        "<h2>How to read it</h2><p>Bold: best; underlined: third best, of the medians of a column "
        "as they are printed; all that tie are marked. With several seeds only what no other "
        "kernel's range overlaps is bold. "
        "Held-out views. Medians over {} seed{}, range in brackets; curves and crops are of the "
        "first. {}</p><p>{}</p><p>Model: the PLY file. Peak: device memory, over the whole run, "
        "whatever the iteration. Training: without evaluation. Splats blended per pixel are those "
        "with alpha at or over the cut-off before "
        "the pixel is opaque, counted in double precision; ns per splat and pixel is the time of "
        "the blend pass over them.</p>\n",
        c.seeds, c.seeds == 1 ? "" : "s", html_escape(c.settings), html_escape(c.lpips_note));
    return html_page("Kernels compared", c.device, body);
}

}  // namespace darb
