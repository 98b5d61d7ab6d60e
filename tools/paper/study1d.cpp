// SPDX-License-Identifier: MIT
#include "tools/paper/study1d.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>

#include "engine/core/error.h"
#include "engine/core/quantile.h"
#include "engine/reference/parallel.h"
#include "engine/report/html.h"
#include "tools/paper/sim1d_terms.h"

namespace darb {

namespace {

constexpr double kFailedShare = 0.5;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

bool has_failed(const Fit1d& fit, double mean_square) {
    return !std::isfinite(fit.loss) || fit.loss >= kFailedShare * mean_square;
}

/// The first recorded step at which the loss is at most `target`.
std::optional<int> step_of(const Fit1d& fit, const std::vector<int>& steps, double target) {
    for (std::size_t i = 0; i < fit.losses.size(); ++i)
        if (fit.losses[i] <= target) return steps[i];
    return std::nullopt;
}

void summarise(const std::vector<const Fit1d*>& good, const std::vector<int>& steps, double target,
               Study1dRow& row) {
    std::vector<double> losses, seconds, steps_to, seconds_to;
    for (const Fit1d* fit : good) {
        losses.push_back(fit->loss);
        seconds.push_back(fit->seconds);
        if (const auto step = step_of(*fit, steps, target)) {
            steps_to.push_back(*step);
            seconds_to.push_back(fit->seconds * *step / std::max(1, steps.back()));
        }
    }
    std::sort(losses.begin(), losses.end());
    row.median = quantile(losses, 0.5);
    row.quartile1 = quantile(losses, 0.25);
    row.quartile3 = quantile(losses, 0.75);
    row.low = losses.empty() ? kNaN : losses.front();
    row.high = losses.empty() ? kNaN : losses.back();
    row.seconds = median(seconds);
    row.reached = static_cast<int>(steps_to.size());
    if (!steps_to.empty()) {
        row.steps_to = median(steps_to);
        row.seconds_to = median(seconds_to);
    }
    if (good.empty()) return;
    for (std::size_t i = 0; i < steps.size(); ++i) {
        std::vector<double> at;
        for (const Fit1d* fit : good) at.push_back(fit->losses[i]);
        row.curve.push_back(median(at));
    }
    const auto nearest =
        std::min_element(good.begin(), good.end(), [&](const Fit1d* a, const Fit1d* b) {
            return std::abs(a->loss - row.median) < std::abs(b->loss - row.median);
        });
    row.shown = (*nearest)->primitives;
}

}  // namespace

Study1dResult study_1d(const Study1dOptions& options,
                       const std::function<void(std::size_t, std::size_t)>& progress) {
    DARB_CHECK(options.seeds >= 1 && !options.signals.empty() && !options.kernels.empty() &&
                   !options.primitives.empty(),
               "{} seeds", options.seeds);
    for (const int k : options.kernels)
        if (!Terms1d::draws(k))
            throw Error(
                fmt::format("kernel {}", kernel_1d_name(k)),
                "has several pulses, or falls to its edge other than by a whole power up to the "
                "fourth, which this study does not draw",
                "Leave it out.");
    const auto start = std::chrono::steady_clock::now();
    Study1dResult result{options, {}, {}, 0};
    std::vector<std::vector<float>> targets;
    for (const int s : options.signals) {
        targets.push_back(
            sample_signal(signals_1d()[static_cast<std::size_t>(s)], options.fit.samples));
        double sum = 0;
        for (const float v : targets.back()) sum += double(v) * v;
        result.mean_squares.push_back(sum / options.fit.samples);
    }
    const std::size_t kernels = options.kernels.size(), counts = options.primitives.size();
    const auto seeds = static_cast<std::size_t>(options.seeds);
    for (const int s : options.signals)
        for (const int k : options.kernels)
            for (const int n : options.primitives) {
                result.rows.emplace_back();
                result.rows.back().signal = s;
                result.rows.back().kernel = k;
                result.rows.back().primitives = n;
            }
    const std::size_t tasks = result.rows.size() * seeds;
    std::vector<Fit1d> fits(tasks);
    std::mutex mutex;
    std::size_t done = 0;
    // Neighbouring tasks are seeds of one row, so that threads end at about the same time.
    reference::parallel_for(tasks, options.threads, [&](std::size_t t) {
        const Study1dRow& row = result.rows[t / seeds];
        fits[t] = fit_1d(row.kernel, targets[t / seeds / counts / kernels], row.primitives,
                         t % seeds, options.fit);
        const std::scoped_lock lock(mutex);
        progress(++done, tasks);
    });
    const std::vector<int> steps = curve_steps(options.fit.steps);
    for (std::size_t r = 0; r < result.rows.size(); ++r) {
        const double mean_square = result.mean_squares[r / counts / kernels];
        std::vector<const Fit1d*> good;
        for (std::size_t seed = 0; seed < seeds; ++seed)
            if (const Fit1d& fit = fits[r * seeds + seed]; !has_failed(fit, mean_square))
                good.push_back(&fit);
        result.rows[r].failed = static_cast<int>(seeds - good.size());
        summarise(good, steps, options.target_share * mean_square, result.rows[r]);
    }
    result.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return result;
}

// The study as text, JSON and a page. The figures are grids like the paper's: one row per kernel,
// one column per number of primitives.

namespace {

constexpr double kCellWidth = 150, kCellHeight = 62, kNameWidth = 120, kHead = 46;  // user units
constexpr int kCurvePoints = 240;
constexpr double kLowest = -0.35, kHighest = 1.35;  // range of the y axis of a cell

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

std::vector<PathStep> path_of(const std::vector<float>& values, double left, double top) {
    std::vector<PathStep> path;
    const std::size_t stride = std::max<std::size_t>(1, values.size() / kCurvePoints);
    for (std::size_t i = 0; i < values.size(); i += stride) {
        const double x =
            left + kCellWidth * static_cast<double>(i) / static_cast<double>(values.size() - 1);
        const double v = std::clamp(static_cast<double>(values[i]), kLowest, kHighest);
        const double y = top + kCellHeight * (kHighest - v) / (kHighest - kLowest);
        path.push_back({path.empty() ? 'M' : 'L', x, y});
    }
    return path;
}

Drawing grid_figure(const Study1dResult& result, std::size_t signal) {
    const Study1dOptions& o = result.options;
    const std::string name(signal_name(o.signals[signal]));
    Drawing drawing;
    drawing.width = kNameWidth + (kCellWidth + 8) * static_cast<double>(o.primitives.size());
    drawing.height = kHead + (kCellHeight + 8) * static_cast<double>(o.kernels.size());
    drawing.title = name + " and its fits";
    drawing.add_text("name", 6, 18, name);
    const std::vector<float> target =
        sample_signal(signals_1d()[static_cast<std::size_t>(o.signals[signal])], o.fit.samples);
    for (std::size_t n = 0; n < o.primitives.size(); ++n)
        drawing.add_text("label", kNameWidth + (kCellWidth + 8) * static_cast<double>(n), 38,
                         fmt::format("N = {}", o.primitives[n]));
    constexpr int kGrey = 7, kOrange = 1;  // series
    for (std::size_t k = 0; k < o.kernels.size(); ++k) {
        const double top = kHead + (kCellHeight + 8) * static_cast<double>(k);
        drawing.add_text("tick", 6, top + kCellHeight / 2,
                         std::string(kernel_1d_name(o.kernels[k])));
        for (std::size_t n = 0; n < o.primitives.size(); ++n) {
            const double left = kNameWidth + (kCellWidth + 8) * static_cast<double>(n);
            const Study1dRow& row = result.row(signal, k, n);
            drawing.add_path("line", path_of(target, left, top), kGrey);
            if (!row.shown.empty())
                drawing.add_path(
                    "line", path_of(evaluate_1d(row.kernel, row.shown, o.fit.samples), left, top),
                    kOrange);
            const std::string failed = row.failed > 0 ? fmt::format(", {} failed", row.failed) : "";
            drawing.add_text("tick", left, top + 10, loss_text(row.median) + failed);
        }
    }
    return drawing;
}

std::vector<Figure> curves(const Study1dResult& result, std::size_t signal) {
    const Study1dOptions& o = result.options;
    const std::vector<int> steps = curve_steps(o.fit.steps);
    std::vector<Figure> figures;
    for (std::size_t n = 0; n < o.primitives.size(); ++n) {
        Plot plot{fmt::format("{}, N = {}", signal_name(o.signals[signal]), o.primitives[n]),
                  "steps",
                  "mean squared error, median",
                  {},
                  true};
        plot.log_x = plot.legend_beside = true;
        for (std::size_t k = 0; k < o.kernels.size(); ++k) {
            const Study1dRow& row = result.row(signal, k, n);
            PlotSeries series{std::string(kernel_1d_name(o.kernels[k]))};
            for (std::size_t i = 0; i < row.curve.size(); ++i)
                series.points.emplace_back(std::max(steps[i], 1), row.curve[i]);
            plot.series.push_back(std::move(series));
        }
        figures.push_back(
            {fmt::format("loss {} {}", signal_name(o.signals[signal]), o.primitives[n]), plot});
    }
    return figures;
}

/// How many kernels have a smaller median: 0 for the best, and for all that tie with it. A kernel
/// whose runs all failed comes last, and is never the best.
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

Table standings_table(const Study1dResult& result) {
    const Study1dOptions& o = result.options;
    Table table{"standings",
                "Over all signals",
                fmt::format("Ratio: geometric mean over the signals of the median loss over the "
                            "gaussian's; {}. Won: signals with the least median loss.",
                            kFewer),
                {{"kernel", "", Better::neither, 0, TableColumn::Kind::name}},
                {}};
    for (const int n : o.primitives) {
        table.columns.push_back({fmt::format("N = {}: ratio", n)});
        table.columns.push_back({"won", "", Better::neither, 0});
        table.columns.push_back({"failed", "", Better::neither, 0});
    }
    const auto all = standings(result);
    for (std::size_t k = 0; k < o.kernels.size(); ++k) {
        TableRow& row = table.rows.emplace_back();
        row.cells = {std::string(kernel_1d_name(o.kernels[k]))};
        for (const Standing& s : all[k])
            row.cells.insert(row.cells.end(), {TableCell(ratio_text(s, o.signals.size())),
                                               TableCell(s.wins), TableCell(s.failed)});
    }
    return table;
}

Table losses_table(const Study1dResult& result) {
    using Kind = TableColumn::Kind;
    Table table{"rows", "Every row", "", {}, {}};
    table.columns = {{"signal", "", Better::neither, 0, Kind::name},
                     {"kernel", "", Better::neither, 0, Kind::name},
                     {"N", "", Better::neither, 0},
                     {"final loss, median", "", Better::neither, 2, Kind::scientific},
                     {"quartiles", "", Better::neither, 2, Kind::scientific},
                     {"range", "", Better::neither, 2, Kind::scientific},
                     {"failed", "", Better::neither, 0},
                     {"reached the target", "", Better::neither, 0},
                     {"steps to it", "", Better::neither, 0},
                     {"ms to it", "", Better::neither, 1},
                     {"ms a run", "", Better::neither, 0}};
    for (const Study1dRow& r : result.rows)
        table.rows.push_back(
            {{std::string(signal_name(r.signal)), std::string(kernel_1d_name(r.kernel)),
              double(r.primitives), r.median, TableCell::between(r.quartile1, r.quartile3),
              TableCell::between(r.low, r.high), double(r.failed), double(r.reached), r.steps_to,
              r.seconds_to ? TableCell(1e3 * *r.seconds_to) : TableCell(), 1e3 * r.seconds}});
    return table;
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

Report study_1d_report(const Study1dResult& result) {
    const Study1dOptions& o = result.options;
    Report report("Kernels in one dimension",
                  "Signals as sums of N kernels, fitted by Adam: the paper's Figures 5 to 11");
    std::vector<std::string> names;
    for (const int k : o.kernels) names.emplace_back(kernel_1d_name(k));
    report.table(standings_table(result), 2);
    report.heading("Signals and fits");
    report.html(
        "<p class='soft'>Grey: the signal; orange: the run with the median loss, which "
        "stands in the cell.</p>");
    std::vector<Figure> grids;
    for (std::size_t s = 0; s < o.signals.size(); ++s)
        grids.push_back({"", grid_figure(result, s)});
    report.plots(std::move(grids));
    report.heading("Loss");
    for (std::size_t s = 0; s < o.signals.size(); ++s)
        report.plots(curves(result, s), s == 0 ? names : std::vector<std::string>());
    report.table(losses_table(result), 2);
    report.html(fmt::format(
        "<h2>How it was done</h2><p>{} samples on [-10, 10]; {} steps of Adam at rate {} on the "
        "mean squared error; {} seeds, which give every kernel the same start. Widths are fitted "
        "as logarithms. A run has failed where its loss is not finite or it explains less than "
        "half of the signal. Target: a loss of {} of the signal's mean square; times are of one "
        "thread. Profiles: the float32 polynomials of the shaders, one pulse within their support; "
        "|sinc| and sinc are then one kernel.</p>\n",
        o.fit.samples, o.fit.steps, o.fit.learning_rate, o.seeds, o.target_share));
    return report;
}

}  // namespace darb
