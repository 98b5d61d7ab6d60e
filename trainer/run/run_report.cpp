// SPDX-License-Identifier: MIT
#include "trainer/run/run_report.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "engine/core/files.h"
#include "engine/data/image_io.h"
#include "engine/report/html.h"
#include "engine/report/svg_plot.h"

namespace darb {

namespace {

constexpr int kJpegQuality = 92;  // the pictures take a tenth of the size of PNGs

struct TimeUnit {
    const char* label;
    double seconds;
};

TimeUnit time_unit(double longest_s) {
    if (longest_s > 3 * 3600) return {"training time (h)", 3600};
    if (longest_s > 300) return {"training time (min)", 60};
    return {"training time (s)", 1};
}

double longest_seconds(const ReportData& data) {
    double longest = 0;
    for (const ReportSample& s : data.samples) longest = std::max(longest, s.seconds);
    for (const ReportEvaluation& e : data.evaluations) longest = std::max(longest, e.seconds);
    return longest;
}

template <class Row, class X, class Y>
PlotSeries series_of(const std::string& name, const std::vector<Row>& rows, X&& x, Y&& y,
                     bool dots) {
    PlotSeries series{name, {}, dots};
    for (const Row& row : rows)
        series.points.emplace_back(static_cast<double>(x(row)), static_cast<double>(y(row)));
    return series;
}

// The same curves against x, which is read off a sample and an evaluation alike.
template <class X>
std::string plots_against(const ReportData& data, const std::string& x_label, X&& x) {
    const auto psnr = [](const auto& row) { return row.psnr_db; };
    const Plot quality{"PSNR",
                       x_label,
                       "PSNR (dB)",
                       {series_of("training photos", data.samples, x, psnr, false),
                        series_of("held-out photos", data.evaluations, x, psnr, true)}};
    Plot loss{"Loss", x_label, "loss", {}, true};
    loss.series = {series_of(
        "loss", data.samples, x, [](const auto& s) { return s.loss; }, false)};
    return svg_plot(quality) + svg_plot(loss);
}

// Milliseconds of each pass, on top of one another, over training time.
std::string pass_stack(const ReportData& data, const TimeUnit& unit) {
    StackPlot stack{"Time an iteration, by pass", unit.label, "ms an iteration", {}, {}, {}};
    for (const ReportPass& pass : data.passes) stack.names.push_back(pass.name);
    stack.layers.resize(data.passes.size());
    for (const ReportSample& s : data.samples) {
        if (s.pass_ms.size() != data.passes.size() || s.pass_ms.empty()) continue;
        stack.x.push_back(s.seconds / unit.seconds);
        for (size_t p = 0; p < s.pass_ms.size(); ++p) stack.layers[p].push_back(s.pass_ms[p]);
    }
    return svg_stack(stack);
}

std::string plots(const ReportData& data) {
    const TimeUnit unit = time_unit(longest_seconds(data));
    const auto iteration = [](const auto& row) { return row.iteration; };
    const auto time = [&](const auto& row) { return row.seconds / unit.seconds; };
    std::string html = plots_against(data, "iterations", iteration);
    html += plots_against(data, unit.label, time);
    Plot splats{"Splats", "iterations", "splats", {}};
    splats.from_zero = true;
    splats.series = {series_of(
        "splats", data.samples, iteration, [](const auto& s) { return s.splats; }, false)};
    Plot ssim{"SSIM, held-out photos", "iterations", "SSIM", {}};
    ssim.series = {series_of(
        "SSIM", data.evaluations, iteration, [](const auto& e) { return e.ssim; }, true)};
    html += svg_plot(splats) + svg_plot(ssim) + pass_stack(data, unit);
    return html.empty() ? "" : "<h2>Curves</h2><div class='plots'>" + html + "</div>\n";
}

std::string cards(const ReportData& data) {
    std::string html;
    if (!data.evaluations.empty()) {
        const ReportEvaluation& last = data.evaluations.back();
        html += html_card(format_number(last.psnr_db, 2) + " dB", "PSNR, held out");
        html += html_card(format_number(last.ssim, 4), "SSIM, held out");
    }
    if (!data.samples.empty()) {
        const ReportSample& last = data.samples.back();
        html += html_card(format_number(last.splats), "splats");
        html += html_card(format_number(last.iteration), "iterations");
        html +=
            html_card(format_number(last.seconds, last.seconds < 100 ? 1 : 0) + " s", "training");
        if (last.iteration > 0)
            html += html_card(format_number(1e3 * last.seconds / last.iteration, 1) + " ms",
                              "an iteration");
    }
    return html.empty() ? "" : "<div class='cards'>" + html + "</div>\n";
}

std::string arc_table(const ReportData& data) {
    if (data.arcs.empty()) return {};
    std::string html =
        "<h2>The arc that was held out</h2><div class='wide'><table><tr><th>iteration</th>"
        "<th>PSNR (dB)</th><th>SSIM</th><th>views</th></tr>\n";
    for (const ReportArc& arc : data.arcs)
        html += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
                            format_number(arc.iteration), format_number(arc.psnr_db, 2),
                            format_number(arc.ssim, 4), arc.views);
    return html + "</table></div>\n";
}

std::string evaluation_table(const ReportData& data) {
    if (data.evaluations.empty()) return {};
    std::string html =
        "<h2>Held-out photos</h2><div class='wide'><table><tr><th>iteration</th><th>PSNR (dB)</th>"
        "<th>SSIM</th><th>splats</th><th>training time (s)</th></tr>\n";
    for (const ReportEvaluation& e : data.evaluations)
        html += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
                            format_number(e.iteration), format_number(e.psnr_db, 2),
                            format_number(e.ssim, 4), format_number(e.splats),
                            format_number(e.seconds, 1));
    return html + "</table></div>\n";
}

std::string pass_table(const ReportData& data) {
    double total = 0, largest = 0;
    bool rooflines = false;
    for (const ReportPass& pass : data.passes) {
        total += pass.ms;
        largest = std::max(largest, pass.ms);
        rooflines |= pass.roofline.has_value();
    }
    if (!(total > 0)) return {};
    const char* head = rooflines ? "<th>of the roofline</th>" : "";
    std::string html = fmt::format(
        "<h2>Time an iteration</h2><div class='wide'><table><tr><th>pass</th><th>ms</th>"
        "<th>share</th>{}<th></th></tr>\n",
        head);
    for (const ReportPass& pass : data.passes) {
        const std::string share =
            pass.roofline ? format_number(100 * *pass.roofline, 1) + " %" : "";
        html += fmt::format(
            "<tr><td>{}</td><td>{}</td><td>{} %</td>{}<td class='bar'><i class='s{}' "
            "style='width:{:.1f}%'></i></td></tr>\n",
            html_escape(pass.name), format_number(pass.ms, 3),
            format_number(100 * pass.ms / total, 1),
            rooflines ? "<td>" + share + "</td>" : std::string(), &pass - data.passes.data(),
            100 * pass.ms / largest);
    }
    return html +
           fmt::format("<tr><td>together</td><td>{}</td><td></td>{}<td></td></tr>",
                       format_number(total, 3), rooflines ? "<td></td>" : "") +
           "</table></div>\n";
}

std::string pictures(const ReportData& data) {
    std::string html;
    for (size_t i = 0; i < data.pictures.size(); ++i) {
        const ReportPicture& picture = data.pictures[i];
        const ImageU8 image = read_image(picture.file);
        const std::string name = html_escape(picture.name);
        // A rule of its own, as browsers drop CSS variables of more than 2 MB.
        html += fmt::format(
            "<figure class='f{}' style='--r:{}/{};--x:50%'>"
            "<style>.f{} .pane{{background-image:url(data:image/jpeg;base64,{})}}</style>"
            "<figcaption><span>{}</span><span>{} dB, SSIM {}</span></figcaption>"
            "<div class='pair'><div class='pane photo' role='img' aria-label='photo of {}'>"
            "<div class='pane render' role='img' aria-label='render of {}'></div></div>"
            "<div class='pane error' role='img' aria-label='error of {}'></div></div>"
            "<div class='parts'><label>render left, photo right <input type='range' min='0' "
            "max='100' value='50' oninput='this.closest(\"figure\").style.setProperty(\"--x\","
            "this.value+\"%\")'/></label><span>{}</span></div></figure>\n",
            i, image.width / 3, image.height, i, base64(encode_jpeg(image, kJpegQuality)), name,
            format_number(picture.psnr_db, 2), format_number(picture.ssim, 4), name, name, name,
            html_escape(data.error_caption));
    }
    return html.empty() ? "" : "<h2>Held-out pictures</h2>\n" + html;
}

std::string settings(const ReportData& data) {
    std::string html;
    for (const auto& [name, value] : data.settings)
        html += fmt::format("<tr><td>{}</td><td class='text'>{}</td></tr>\n", html_escape(name),
                            html_escape(value));
    return html.empty() ? "" : "<h2>Settings</h2><table>" + html + "</table>\n";
}

std::string notes(const ReportData& data) {
    std::string html;
    for (const std::string& note : data.notes) html += "<p>" + html_escape(note) + "</p>\n";
    return html.empty() ? "" : "<h2>Notes</h2>\n" + html;
}

}  // namespace

std::string report_html(const ReportData& data) {
    return html_page(data.title, data.device,
                     cards(data) + plots(data) + pictures(data) + evaluation_table(data) +
                         arc_table(data) + pass_table(data) + settings(data) + notes(data));
}

void write_report(const std::filesystem::path& path, const ReportData& data) {
    write_file_atomic(path, report_html(data));
}

namespace {

// The means over the views in the arc, or over the others.
ArcMeans means_of(const std::vector<ViewMetrics>& views, bool in_arc) {
    ArcMeans means;
    double count = 0;
    for (const ViewMetrics& v : views) {
        if (v.in_arc != in_arc) continue;
        ++means.views;
        if (std::isnan(v.psnr_db)) continue;
        means.psnr_db += v.psnr_db;
        means.ssim += v.ssim;
        ++count;
    }
    if (means.views == 0) return means;
    means.psnr_db /= count;
    means.ssim /= count;
    return means;
}

std::optional<DepthError> depth_means(const std::vector<ViewMetrics>& views) {
    DepthError sum;
    double count = 0;
    for (const ViewMetrics& v : views) {
        if (!v.depth) continue;
        sum.mean_m += v.depth->mean_m;
        sum.median_m += v.depth->median_m;
        ++count;
    }
    if (count == 0) return std::nullopt;
    return DepthError{sum.mean_m / count, sum.median_m / count};
}

std::optional<double> flip_mean(const std::vector<ViewMetrics>& views, bool in_arc) {
    double sum = 0, count = 0;
    for (const ViewMetrics& v : views) {
        if (v.in_arc != in_arc || !v.flip || std::isnan(*v.flip)) continue;
        sum += *v.flip;
        ++count;
    }
    return count > 0 ? std::optional(sum / count) : std::nullopt;
}

}  // namespace

void take_means(Evaluation& evaluation) {
    evaluation.depth = depth_means(evaluation.views);
    const ArcMeans arc = means_of(evaluation.views, true);
    const ArcMeans others = means_of(evaluation.views, false);
    evaluation.arc.reset();
    if (arc.views > 0 && others.views > 0) evaluation.arc = arc;
    const ArcMeans& means = others.views > 0 ? others : arc;
    evaluation.psnr_db = means.psnr_db;
    evaluation.ssim = means.ssim;
    evaluation.flip = flip_mean(evaluation.views, others.views == 0);
}

Evaluation evaluate_held_out(Trainer& trainer, const Dataset& dataset,
                             const std::vector<ImageU8>& photos,
                             const std::function<ImageF(const Camera&)>& render) {
    Evaluation evaluation;
    for (size_t i = 0; i < dataset.views.size(); ++i) {
        const View& view = dataset.views[i];
        if (!view.is_test) continue;
        const Camera& camera = trainer.camera(i);
        evaluation.views.push_back(
            compare_view(view.name, render ? render(camera) : trainer.render(camera), photos[i],
                         trainer.background(), dataset.alpha_is_mask));
        evaluation.views.back().in_arc = view.in_arc;
    }
    take_means(evaluation);
    return evaluation;
}

std::vector<std::filesystem::path> write_side_by_side(Trainer& trainer, const Dataset& dataset,
                                                      const std::vector<ImageU8>& photos,
                                                      const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    std::set<std::string> used;
    for (size_t i = 0; i < dataset.views.size(); ++i) {
        const View& view = dataset.views[i];
        if (!view.is_test) continue;
        const auto path = folder / picture_name(view.name, used);
        write_png(path, side_by_side(composite(photos[i], trainer.background()),
                                     trainer.render(trainer.camera(i))));
        files.push_back(path);
    }
    return files;
}

}  // namespace darb
