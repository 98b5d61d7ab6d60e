// The study as text, JSON and a page. The figures are grids like the paper's: a row a kernel, a
// column a number of primitives.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/report/html.h"
#include "engine/report/page.h"
#include "engine/report/svg_plot.h"
#include "tools/paper/study1d.h"

namespace darb {

namespace {

constexpr double kCellWidth = 150, kCellHeight = 62, kNameWidth = 120, kHead = 46;  // user units
constexpr int kCurvePoints = 240;
constexpr double kLowest = -0.35, kHighest = 1.35;  // of the y axis of a cell

std::string_view signal_name(int signal) {
    return signals_1d()[static_cast<std::size_t>(signal)].name;
}

std::string loss_text(double loss) {
    return std::isfinite(loss) ? fmt::format("{:.2e}", loss) : "-";
}

nlohmann::json number(double v) {
    return std::isfinite(v) ? nlohmann::json(v) : nlohmann::json(nullptr);
}

nlohmann::json number(const std::optional<double>& v) {
    return v ? number(*v) : nlohmann::json(nullptr);
}

std::string path_of(const std::vector<float>& values, double left, double top) {
    std::string path;
    const std::size_t stride = std::max<std::size_t>(1, values.size() / kCurvePoints);
    for (std::size_t i = 0; i < values.size(); i += stride) {
        const double x =
            left + kCellWidth * static_cast<double>(i) / static_cast<double>(values.size() - 1);
        const double v = std::clamp(static_cast<double>(values[i]), kLowest, kHighest);
        const double y = top + kCellHeight * (kHighest - v) / (kHighest - kLowest);
        path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? 'M' : 'L', x, y);
    }
    return path;
}

std::string grid_figure(const Study1dResult& result, std::size_t signal) {
    const Study1dOptions& o = result.options;
    const double width = kNameWidth + (kCellWidth + 8) * static_cast<double>(o.primitives.size());
    const double height = kHead + (kCellHeight + 8) * static_cast<double>(o.kernels.size());
    const std::string name(signal_name(o.signals[signal]));
    std::string svg = fmt::format(
        "<svg viewBox='0 0 {:.0f} {:.0f}' role='img' aria-label='{} and its fits'><text "
        "class='name' x='6' y='18'>{}</text>",
        width, height, html_escape(name), html_escape(name));
    const std::vector<float> target =
        sample_signal(signals_1d()[static_cast<std::size_t>(o.signals[signal])], o.fit.samples);
    for (std::size_t n = 0; n < o.primitives.size(); ++n)
        svg += fmt::format("<text class='label' x='{:.0f}' y='38'>N = {}</text>",
                           kNameWidth + (kCellWidth + 8) * static_cast<double>(n), o.primitives[n]);
    for (std::size_t k = 0; k < o.kernels.size(); ++k) {
        const double top = kHead + (kCellHeight + 8) * static_cast<double>(k);
        svg += fmt::format("<text class='tick' x='6' y='{:.0f}'>{}</text>", top + kCellHeight / 2,
                           kernel_1d_name(o.kernels[k]));
        for (std::size_t n = 0; n < o.primitives.size(); ++n) {
            const double left = kNameWidth + (kCellWidth + 8) * static_cast<double>(n);
            const Study1dRow& row = result.row(signal, k, n);
            svg += fmt::format("<path class='line s7' d='{}'/>", path_of(target, left, top));
            if (!row.shown.empty())
                svg += fmt::format(
                    "<path class='line s1' d='{}'/>",
                    path_of(evaluate_1d(row.kernel, row.shown, o.fit.samples), left, top));
            const std::string failed = row.failed > 0 ? fmt::format(", {} failed", row.failed) : "";
            svg += fmt::format("<text class='tick' x='{:.0f}' y='{:.0f}'>{}{}</text>", left,
                               top + 10, loss_text(row.median), failed);
        }
    }
    return svg + "</svg>\n";
}

std::string curves(const Study1dResult& result, std::size_t signal) {
    const Study1dOptions& o = result.options;
    const std::vector<int> steps = curve_steps(o.fit.steps);
    std::string html;
    for (std::size_t n = 0; n < o.primitives.size(); ++n) {
        Plot plot{fmt::format("{}, N = {}", signal_name(o.signals[signal]), o.primitives[n]),
                  "steps",
                  "mean squared error, median",
                  {},
                  true};
        plot.log_x = true;
        for (std::size_t k = 0; k < o.kernels.size(); ++k) {
            const Study1dRow& row = result.row(signal, k, n);
            PlotSeries series;
            for (std::size_t i = 0; i < row.curve.size(); ++i)
                series.points.emplace_back(std::max(steps[i], 1), row.curve[i]);
            plot.series.push_back(std::move(series));
        }
        html += svg_plot(plot);
    }
    return "<div class='plots'>" + html + "</div>\n";
}

/// How many kernels have a lesser median: 0 for the best, and for all that tie with it. A kernel
/// whose every run failed comes last and is never the best.
std::vector<std::size_t> ranks(const Study1dResult& result, std::size_t signal, std::size_t n) {
    const std::size_t kernels = result.options.kernels.size();
    const auto loss = [&](std::size_t k) { return result.row(signal, k, n).median; };
    std::vector<std::size_t> rank(kernels, 0);
    for (std::size_t k = 0; k < kernels; ++k) {
        if (!std::isfinite(loss(k))) rank[k] = kernels;
        for (std::size_t other = 0; other < kernels && rank[k] < kernels; ++other)
            if (loss(other) < loss(k)) ++rank[k];
    }
    return rank;
}

struct Standing {
    int wins = 0;
    double log_ratio = 0;          // mean over signals of ln(median / Gaussian's median)
    int compared = 0, failed = 0;  // signals with a ratio; runs
};

/// [kernel][N] over the signals; ratios only where the Gaussian takes part.
std::vector<std::vector<Standing>> standings(const Study1dResult& result) {
    const Study1dOptions& o = result.options;
    const auto gauss = std::find(o.kernels.begin(), o.kernels.end(), KERNEL_GAUSSIAN);
    std::vector<std::vector<Standing>> all(o.kernels.size(),
                                           std::vector<Standing>(o.primitives.size()));
    for (std::size_t s = 0; s < o.signals.size(); ++s)
        for (std::size_t n = 0; n < o.primitives.size(); ++n) {
            const std::vector<std::size_t> rank = ranks(result, s, n);
            for (std::size_t k = 0; k < o.kernels.size(); ++k) {
                Standing& standing = all[k][n];
                const Study1dRow& row = result.row(s, k, n);
                standing.wins += rank[k] == 0 ? 1 : 0;
                standing.failed += row.failed;
                if (gauss == o.kernels.end()) continue;
                const double base =
                    result.row(s, static_cast<std::size_t>(gauss - o.kernels.begin()), n).median;
                if (!(row.median > 0) || !(base > 0)) continue;
                standing.log_ratio += std::log(row.median / base);
                ++standing.compared;
            }
        }
    return all;
}

constexpr const char* kFewer =
    "/n: over n of the signals; on the others every run of the kernel, or of the gaussian, failed";

std::string ratio_text(const Standing& s, std::size_t signals) {
    if (s.compared == 0) return "-";
    const double ratio = std::exp(s.log_ratio / s.compared);
    const bool all = static_cast<std::size_t>(s.compared) == signals;
    return (ratio < 0.01 ? fmt::format("{:.1e}", ratio) : fmt::format("{:.2f}", ratio)) +
           (all ? "" : fmt::format("/{}", s.compared));
}

std::string html_standings(const Study1dResult& result) {
    const Study1dOptions& o = result.options;
    std::string html = fmt::format(
        "<p class='soft'>Ratio: geometric mean over the signals of the median loss over the "
        "gaussian's; {}. Won: signals with the least median loss.</p><div class='wide'><table><tr>"
        "<th>kernel</th>",
        kFewer);
    for (const int n : o.primitives)
        html += fmt::format("<th>N = {}: ratio</th><th>won</th><th>failed</th>", n);
    html += "</tr>\n";
    const auto all = standings(result);
    for (std::size_t k = 0; k < o.kernels.size(); ++k) {
        html += fmt::format("<tr><td>{}</td>", kernel_1d_name(o.kernels[k]));
        for (const Standing& s : all[k])
            html += fmt::format("<td>{}</td><td>{}</td><td>{}</td>",
                                ratio_text(s, o.signals.size()), s.wins, s.failed);
        html += "</tr>\n";
    }
    return html + "</table></div>\n";
}

std::string html_rows(const Study1dResult& result) {
    std::string html =
        "<div class='wide'><table><tr><th>signal</th><th class='left'>kernel"
        "</th><th>N</th><th>final loss, median</th><th>quartiles</th><th>range</th>"
        "<th>failed</th><th>reached the target</th><th>steps to it</th><th>ms to it</th>"
        "<th>ms a run</th></tr>\n";
    for (const Study1dRow& r : result.rows)
        html += fmt::format(
            "<tr><td>{}</td><td class='left'>{}</td><td>{}</td><td>{}</td><td>{} to {}</td>"
            "<td>{} to {}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.0f}</td></tr>\n",
            signal_name(r.signal), kernel_1d_name(r.kernel), r.primitives, loss_text(r.median),
            loss_text(r.quartile1), loss_text(r.quartile3), loss_text(r.low), loss_text(r.high),
            r.failed, r.reached, r.steps_to ? fmt::format("{:.0f}", *r.steps_to) : "-",
            r.seconds_to ? fmt::format("{:.1f}", 1e3 * *r.seconds_to) : "-", 1e3 * r.seconds);
    return html + "</table></div>\n";
}

}  // namespace

std::string study_1d_table(const Study1dResult& result) {
    const Study1dOptions& o = result.options;
    std::string text = fmt::format("{:<18} {:<24}", "final loss, median", "");
    for (const int n : o.primitives) text += fmt::format(" {:>17}", fmt::format("N = {}", n));
    text += "\n";
    for (std::size_t s = 0; s < o.signals.size(); ++s)
        for (std::size_t k = 0; k < o.kernels.size(); ++k) {
            text += fmt::format("{:<18} {:<24}", k == 0 ? signal_name(o.signals[s]) : "",
                                kernel_1d_name(o.kernels[k]));
            for (std::size_t n = 0; n < o.primitives.size(); ++n) {
                const Study1dRow& row = result.row(s, k, n);
                const bool best = ranks(result, s, n)[k] == 0;
                text += fmt::format(" {:>9}{}{:>7}", loss_text(row.median), best ? "*" : " ",
                                    row.failed > 0 ? fmt::format("({}!)", row.failed) : "");
            }
            text += "\n";
        }
    text += fmt::format("\n{:<43}", "loss over the gaussian's (signals won, failed)");
    text += "\n";
    const auto all = standings(result);
    for (std::size_t k = 0; k < o.kernels.size(); ++k) {
        text += fmt::format("{:<43}", kernel_1d_name(o.kernels[k]));
        for (const Standing& s : all[k])
            text += fmt::format(
                " {:>17}",
                fmt::format("{} ({}, {})", ratio_text(s, o.signals.size()), s.wins, s.failed));
        text += "\n";
    }
    return text + fmt::format("* least; (n!) failed runs of {}; {}; {:.0f} s\n", o.seeds, kFewer,
                              result.seconds);
}

nlohmann::json study_1d_json(const Study1dResult& result) {
    const Study1dOptions& o = result.options;
    nlohmann::json rows = nlohmann::json::array();
    for (const Study1dRow& r : result.rows) {
        nlohmann::json terms = nlohmann::json::array();
        for (const Primitive1d& p : r.shown)
            terms.push_back({p.position, p.width, p.weight, p.shape});
        rows.push_back({{"signal", signal_name(r.signal)},
                        {"kernel", kernel_1d_name(r.kernel)},
                        {"primitives", r.primitives},
                        {"loss",
                         {{"median", number(r.median)},
                          {"quartiles", {number(r.quartile1), number(r.quartile3)}},
                          {"range", {number(r.low), number(r.high)}}}},
                        {"failed", r.failed},
                        {"reached_target", r.reached},
                        {"steps_to_target", number(r.steps_to)},
                        {"seconds_to_target", number(r.seconds_to)},
                        {"seconds_a_run", number(r.seconds)},
                        {"curve", r.curve},
                        {"position_width_weight_shape", terms}});
    }
    return {{"version", DARB_VERSION},
            {"samples", o.fit.samples},
            {"steps", o.fit.steps},
            {"learning_rate", o.fit.learning_rate},
            {"seeds", o.seeds},
            {"target_share_of_mean_square", o.target_share},
            {"curve_steps", curve_steps(o.fit.steps)},
            {"seconds", result.seconds},
            {"rows", rows}};
}

std::string study_1d_html(const Study1dResult& result) {
    const Study1dOptions& o = result.options;
    std::vector<std::string> names;
    for (const int k : o.kernels) names.emplace_back(kernel_1d_name(k));
    std::string body = "<h2>Over all signals</h2>" + html_standings(result) +
                       "<h2>Signals and fits</h2><p class='soft'>Grey: the signal; orange: the run "
                       "with the median loss, which stands in the cell.</p><div class='plots'>";
    for (std::size_t s = 0; s < o.signals.size(); ++s) body += grid_figure(result, s);
    body += "</div>\n<h2>Loss</h2>" + html_legend(names);
    for (std::size_t s = 0; s < o.signals.size(); ++s) body += curves(result, s);
    body += "<h2>Every row</h2>" + html_rows(result);
    body += fmt::format(
        "<h2>How it was done</h2><p>{} samples on [-10, 10]; {} steps of Adam at rate {} on the "
        "mean squared error; {} seeds, which give every kernel the same start. Widths are fitted "
        "as logarithms. A run has failed where its loss is not finite or it explains less than "
        "half of the signal. Target: a loss of {} of the signal's mean square; times are of one "
        "thread. Profiles: the float32 polynomials of the shaders, one pulse within their support; "
        "|sinc| and sinc are then one kernel.</p>\n",
        o.fit.samples, o.fit.steps, o.fit.learning_rate, o.seeds, o.target_share);
    return html_page("Kernels in one dimension",
                     "Signals as sums of N kernels, fitted by Adam: the paper's Figures 5 to 11",
                     body);
}

}  // namespace darb
