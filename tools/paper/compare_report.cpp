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
#include "engine/report/svg_plot.h"
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
                         {"lpips", optional_json(v.lpips)}});
    Json scales = Json::array();
    for (const ComparedScale& s : at.scales)
        scales.push_back({{"scale", s.scale}, {"psnr_db", s.psnr_db}, {"ssim", s.ssim}});
    return {{"iteration", at.iteration},
            {"training_s", at.seconds},
            {"psnr_db", at.psnr_db},
            {"ssim", at.ssim},
            {"lpips", optional_json(at.lpips)},
            {"splats", at.splats},
            {"model_mb", optional_json(at.model_mb)},
            {"views", views},
            {"scales", scales},
            {"arc_psnr_db", optional_json(at.arc_db)},
            {"off_path_psnr_db", optional_json(at.off_path_db)}};
}

Json run_json(const ComparedRun& run) {
    Json json{
        {"kernel", run.kernel},   {"seed", run.seed},      {"folder", run.folder.string()},
        {"failure", run.failure}, {"notes", run.notes},    {"peak_mb", optional_json(run.peak_mb)},
        {"at", Json::array()},    {"curve", Json::array()}};
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

namespace {

// One line per kernel, with a star where it is the best; with several seeds, the range below it.
std::string kernel_lines(const Comparison& c, const ComparedDataset& dataset, int iteration,
                         const std::vector<Column>& columns) {
    std::vector<std::vector<OverSeeds>> values(columns.size());
    std::vector<Marks> marks;
    for (std::size_t k = 0; k < columns.size(); ++k) {
        for (const std::string& kernel : c.kernels)
            values[k].push_back(over_seeds(dataset, kernel, iteration, columns[k]));
        marks.push_back(marks_over_seeds(values[k], columns[k]));
    }
    std::string text;
    for (std::size_t row = 0; row < c.kernels.size(); ++row) {
        std::string line = fmt::format("{:<26}", c.kernels[row]);
        std::string ranges = fmt::format("{:<26}", "  lowest to highest");
        bool several = false;
        for (std::size_t k = 0; k < columns.size(); ++k) {
            const OverSeeds& v = values[k][row];
            const auto number = [&](double value) {
                return format_number(value, columns[k].decimals);
            };
            line += fmt::format(
                " {:>12}",
                v.median ? number(*v.median) + (marks[k][row] == Mark::best ? "*" : "") : "-");
            const bool range = v.count > 1;
            several |= range;
            ranges += fmt::format(" {:>12}", range ? number(v.low) + "-" + number(v.high) : "");
        }
        text += line + "\n" + (several ? ranges + "\n" : "");
    }
    return text;
}

}  // namespace

std::string comparison_table(const Comparison& c) {
    std::string text;
    const std::vector<Column> columns = shown_columns(c);
    for (const ComparedDataset& dataset : c.datasets)
        for (const int iteration : c.iterations) {
            text += fmt::format("{}, {} iterations\n{:<26}", dataset.name, format_number(iteration),
                                "");
            for (const Column& column : columns)
                text += fmt::format(
                    " {:>12}", column.unit.empty() ? column.name : column.name + " " + column.unit);
            text += "\n";
            text += kernel_lines(c, dataset, iteration, columns) + "\n";
        }
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
                 {"medians", summary_json(c, dataset)},
                 {"runs", Json::array()},
                 {"pulses", pulse_json(c, dataset)},
                 {"paper", paper_json(dataset.name)}};
        for (const ComparedRun& run : dataset.runs) one["runs"].push_back(run_json(run));
        datasets.push_back(std::move(one));
    }
    return {{"version", DARB_VERSION}, {"device", c.device},    {"settings", c.settings},
            {"seeds", c.seeds},        {"lpips", c.lpips_note}, {"iterations", c.iterations},
            {"kernels", c.kernels},    {"datasets", datasets},  {"means", means_json(c)}};
}

// The page of `darb compare`: per data set the paper's tables, the curves, the paper's own figures,
// the cost of blending, and crops.

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

/// The means of one group of data sets; the last row tells how many data sets each column covers.
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

/// One curve per kernel, from the first seed.
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

/// The paper's Figure 2: how one covariance looks with each kernel.
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

namespace {

constexpr int kLeastSide = 24;  // px

/// Sums over rectangles in constant time.
class SumTable {
  public:
    SumTable(int width, int height)
        : width_(width), sums_(static_cast<std::size_t>(width + 1) * (height + 1), 0.0) {}
    void set(int x, int y, double v) {
        sums_[at(x + 1, y + 1)] = v + sums_[at(x, y + 1)] + sums_[at(x + 1, y)] - sums_[at(x, y)];
    }
    double square(int x, int y, int side) const {
        return sums_[at(x + side, y + side)] - sums_[at(x, y + side)] - sums_[at(x + side, y)] +
               sums_[at(x, y)];
    }

  private:
    std::size_t at(int x, int y) const { return static_cast<std::size_t>(y) * (width_ + 1) + x; }
    int width_;
    std::vector<double> sums_;
};

double squared_error(const ImageU8& a, const ImageU8& b, int x, int y) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
        const double d = (double(a.at(x, y, c)) - b.at(x, y, c)) / 255;
        sum += d * d / 3;
    }
    return sum;
}

ImageU8 cut(const ImageU8& image, const Crop& crop) {
    ImageU8 part(crop.side, crop.side, 3);
    for (int y = 0; y < crop.side; ++y)
        for (int x = 0; x < crop.side; ++x)
            for (int c = 0; c < 3; ++c) part.at(x, y, c) = image.at(crop.x + x, crop.y + y, c);
    return part;
}

void take(std::optional<Crop>& best, bool better, const Crop& place, const HeldOutPicture& a,
          const HeldOutPicture& b) {
    if (best && !better) return;
    best = place;
    best->photo = cut(a.photo, place);
    best->first = cut(a.render, place);
    best->second = cut(b.render, place);
}

}  // namespace

std::vector<Crop> crops_of(const ComparedAt& first, const ComparedAt& second) {
    std::optional<Crop> gain, loss;
    for (const ComparedView& view : first.views) {
        const auto other = std::find_if(second.views.begin(), second.views.end(),
                                        [&](const ComparedView& v) { return v.name == view.name; });
        if (other == second.views.end() || !std::filesystem::exists(view.picture) ||
            !std::filesystem::exists(other->picture))
            continue;
        const HeldOutPicture a = read_held_out(view.picture), b = read_held_out(other->picture);
        const int width = a.photo.width, height = a.photo.height;
        const int shorter = std::min(width, height);
        const int side = std::min(shorter, std::max(shorter / 4, kLeastSide));
        if (b.photo.width != width || b.photo.height != height) continue;
        SumTable table(width, height);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                table.set(x, y,
                          squared_error(a.render, a.photo, x, y) -
                              squared_error(b.render, b.photo, x, y));
        Crop most{view.name, 0, 0, side, -1e30, {}, {}, {}}, least = most;
        least.gain = 1e30;
        for (int y = 0; y + side <= height; ++y)
            for (int x = 0; x + side <= width; ++x) {
                const double mean = table.square(x, y, side) / (double(side) * side);
                if (mean > most.gain) most.x = x, most.y = y, most.gain = mean;
                if (mean < least.gain) least.x = x, least.y = y, least.gain = mean;
            }
        take(gain, gain && most.gain > gain->gain, most, a, b);
        take(loss, loss && least.gain < loss->gain, least, a, b);
    }
    if (!gain) return {};
    return {std::move(*gain), std::move(*loss)};
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

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ComparedView, name, psnr_db, ssim, lpips, picture)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ComparedScale, scale, psnr_db, ssim)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ComparedAt, iteration, seconds, psnr_db, ssim, lpips, splats,
                                   model_mb, model, views, scales, arc_db, off_path_db)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CurvePoint, iteration, seconds, loss, splats)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LearnedShapes, edges, shares, percentiles)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(BlendStatistics, blended_per_pixel, intersections_per_splat,
                                   blend_ms, frame_ms, ns_per_splat_pixel)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ComparedRun, kernel, seed, folder, failure, notes, exit_code, at,
                                   curve, peak_mb, blending, shapes)

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

namespace {

std::uint8_t byte(double v) {
    return static_cast<std::uint8_t>(std::clamp(v, 0.0, 1.0) * 255 + 0.5);
}

}  // namespace

ImageU8 grey_field(int size, double white, const std::function<double(int, int)>& value) {
    ImageU8 image(size, size, 1);
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) image.at(x, y, 0) = byte(value(x, y) / white);
    return image;
}

ImageU8 signed_field(int size, double limit, const std::function<double(int, int)>& value) {
    ImageU8 image(size, size, 3);
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            const double v = limit > 0 ? value(x, y) / limit : 0;
            image.at(x, y, 0) = byte(1 + std::min(v, 0.0));
            image.at(x, y, 1) = byte(1 - std::abs(v));
            image.at(x, y, 2) = byte(1 - std::max(v, 0.0));
        }
    return image;
}

std::string html_pictures(const std::vector<Captioned>& pictures, int width_px) {
    std::string html = "<div style='display:flex;flex-wrap:wrap;gap:.8rem'>";
    for (const Captioned& one : pictures)
        html += fmt::format(
            "<figure style='margin:0;width:{0}px'><img alt='{1}' style='width:100%;"
            "image-rendering:pixelated;border-radius:4px' src='data:image/png;base64,{2}'/>"
            "<figcaption style='overflow-wrap:anywhere'>{1}</figcaption></figure>",
            width_px, html_escape(one.caption), base64(encode_png(one.picture)));
    return html + "</div>\n";
}

}  // namespace darb
