// SPDX-License-Identifier: MIT
#include "engine/report/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace darb {

// The view box of every plot, in user units; CSS scales the whole.
constexpr double kPlotWidth = 480, kPlotHeight = 260;
constexpr double kPlotLeft = 70, kPlotRight = 28, kPlotTop = 30, kPlotBottom = 44;

struct Axis {
    double low = 0, high = -1;  // low > high: nothing included yet; logarithms where log
    double from = 0, to = 1;    // where low and high lie in the picture
    bool log = false;

    bool takes(double v) const;  // finite, and positive where log
    void include(double v);      // v must be one that takes() accepts
    bool empty() const { return low > high; }
    void widen();  // makes sure that the range has a width
    double place(double v) const;
};

std::vector<double> ticks_of(const Axis& axis);
/// Draws the grid, ticks, both axes and their labels.
void draw_axes(const std::string& x_label, const std::string& y_label, const Axis& x, const Axis& y,
               Drawing& drawing);
/// An empty drawing with the title. kind: a CSS class of the element.
Drawing open_plot(const std::string& title, double height = kPlotHeight, double width = kPlotWidth,
                  const std::string& kind = {});

struct LegendEntry {
    std::string name;
    enum class Swatch { line, dot, area } swatch = Swatch::line;
};
/// Draws names, each with a colour swatch, below the title, in as many lines as they need; nothing
/// for a single name. Returns by how much the plot moves down, user units.
double draw_legend(const std::vector<LegendEntry>& entries, Drawing& drawing);
/// The width of a text in the font of ticks and legends, user units.
double text_width(const std::string& text);
/// The text, or where it is wider than that, its beginning and an ellipsis.
std::string fit_text(const std::string& text, double width);

namespace {

constexpr std::size_t kMaxPoints = 600;  // per curve; more cannot be distinguished at this size

void draw_dot(const PlotSeries& series, std::size_t index, std::size_t point, const Axis& x,
              const Axis& y, Drawing& drawing) {
    const auto& [px, py] = series.points[point];
    const std::string title = point < series.titles.size()
                                  ? series.titles[point]
                                  : fmt::format("{}: {:.6g}, {:.6g}", series.name, px, py);
    drawing.add_circle(x.place(px), y.place(py), 3.5, static_cast<int>(index), title);
}

void draw_band(const PlotSeries& series, std::size_t index, const Axis& x, const Axis& y,
               Drawing& drawing) {
    std::vector<PathStep> there, back;
    for (std::size_t i = 0; i < std::min(series.band.size(), series.points.size()); ++i) {
        const double px = series.points[i].first;
        const auto& [low, high] = series.band[i];
        if (!x.takes(px) || !y.takes(low) || !y.takes(high)) continue;
        there.push_back({there.empty() ? 'M' : 'L', x.place(px), y.place(high)});
        back.push_back({'L', x.place(px), y.place(low)});
    }
    if (there.size() < 2) return;
    there.insert(there.end(), back.rbegin(), back.rend());
    there.push_back({'z'});
    drawing.add_path("band", std::move(there), static_cast<int>(index));
}

void draw_series(const PlotSeries& series, std::size_t index, const Axis& x, const Axis& y,
                 Drawing& drawing) {
    std::vector<PathStep> path;
    std::vector<std::size_t> dots;
    const std::size_t stride =
        series.line ? (series.points.size() + kMaxPoints - 1) / kMaxPoints : 1;
    bool pen_down = false;
    for (std::size_t i = 0; i < series.points.size(); ++i) {
        const auto& [px, py] = series.points[i];
        const bool last = i + 1 == series.points.size();
        if (i % stride != 0 && !last) continue;
        if (!x.takes(px) || !y.takes(py)) {
            pen_down = false;
            continue;
        }
        if (series.stairs && pen_down) path.push_back({'L', x.place(px), path.back().y});
        path.push_back({pen_down ? 'L' : 'M', x.place(px), y.place(py)});
        pen_down = true;
        if (series.dots) dots.push_back(i);
    }
    if (series.line && !path.empty())
        drawing.add_path("line", std::move(path), static_cast<int>(index));
    for (const std::size_t i : dots) draw_dot(series, index, i, x, y, drawing);
}

/// The axes over all points and bands of the series that they take.
std::pair<Axis, Axis> axes_over(const Plot& plot) {
    Axis x, y;
    x.log = plot.log_x;
    y.log = plot.log_y;
    for (const PlotSeries& series : plot.series)
        for (std::size_t i = 0; i < series.points.size(); ++i) {
            const auto& [px, py] = series.points[i];
            if (!x.takes(px) || !y.takes(py)) continue;
            x.include(px);
            y.include(py);
            if (i >= series.band.size()) continue;
            for (const double end : {series.band[i].first, series.band[i].second})
                if (y.takes(end)) y.include(end);
        }
    return {x, y};
}

}  // namespace

std::vector<double> round_ticks(double low, double high) {
    if (!(high > low)) return {low};
    const double raw = (high - low) / 5;
    const double power = std::pow(10, std::floor(std::log10(raw)));
    double step = 10 * power;
    for (const double m : {5.0, 2.0, 1.0})
        if (m * power >= raw * 0.8) step = m * power;
    std::vector<double> ticks;
    const double slack = 1e-9 * step;
    for (double i = std::ceil((low - slack) / step); i * step <= high + slack; i += 1)
        ticks.push_back(i * step);
    return ticks;
}

Drawing draw_plot(const Plot& plot, DrawnFor place) {
    auto [x, y] = axes_over(plot);
    if (x.empty()) return {};
    const bool from_zero = plot.x_from_zero && !plot.log_x;
    if (from_zero) x.include(0);
    if (plot.from_zero && !plot.log_y) y.include(0);
    x.widen();
    y.widen();
    const double margin = 0.04 * (y.high - y.low);
    if (!(plot.from_zero && y.low == 0)) y.low -= margin;
    y.high += margin;
    if (!from_zero) {
        const double beside = 0.04 * (x.high - x.low);
        x.low -= beside;
        x.high += beside;
    }
    x.from = kPlotLeft;
    x.to = kPlotWidth - kPlotRight;
    std::vector<LegendEntry> entries;
    for (const PlotSeries& series : plot.series)
        entries.push_back(
            {series.name, series.line ? LegendEntry::Swatch::line : LegendEntry::Swatch::dot});
    if (plot.legend_beside && place == DrawnFor::page) entries.clear();
    Drawing drawing = open_plot(plot.title);
    const double down = draw_legend(entries, drawing);
    drawing.height += down;
    y.to = kPlotTop + down;
    y.from = kPlotHeight + down - kPlotBottom;
    draw_axes(plot.x_label, plot.y_label, x, y, drawing);
    for (std::size_t i = 0; i < plot.series.size(); ++i)
        draw_band(plot.series[i], i, x, y, drawing);
    for (std::size_t i = 0; i < plot.series.size(); ++i)
        draw_series(plot.series[i], i, x, y, drawing);
    return drawing;
}

std::string svg_plot(const Plot& plot) {
    return svg_inline(draw_plot(plot));
}

namespace {

/// One layer on top of those before it, whose sum is in `base`, and which it is added to.
void draw_layer(const StackPlot& plot, std::size_t l, const Axis& x, const Axis& y,
                std::vector<double>& base, Drawing& drawing) {
    const std::size_t stride = (plot.x.size() + kMaxPoints - 1) / kMaxPoints;
    std::vector<PathStep> path, back;
    double sum = 0;
    for (std::size_t i = 0; i < plot.x.size(); i += stride) {
        const double above = base[i] + plot.layers[l][i];
        path.push_back({path.empty() ? 'M' : 'L', x.place(plot.x[i]), y.place(above)});
        back.push_back({'L', x.place(plot.x[i]), y.place(base[i])});
    }
    for (std::size_t i = 0; i < plot.x.size(); ++i) {
        base[i] += plot.layers[l][i];
        sum += plot.layers[l][i];
    }
    path.insert(path.end(), back.rbegin(), back.rend());
    path.push_back({'z'});
    drawing.add_path("area", std::move(path), static_cast<int>(l),
                     fmt::format("{}: {:.3g} in the mean", plot.names[l],
                                 sum / static_cast<double>(plot.x.size())));
}

}  // namespace

Drawing draw_plot(const StackPlot& plot, DrawnFor) {
    Axis x, y;
    std::vector<double> top(plot.x.size(), 0.0);
    for (const std::vector<double>& layer : plot.layers)
        for (std::size_t i = 0; i < top.size(); ++i) top[i] += layer[i];
    for (std::size_t i = 0; i < top.size(); ++i) {
        x.include(plot.x[i]);
        y.include(top[i]);
    }
    if (x.empty() || plot.layers.empty()) return {};
    x.include(0);
    y.include(0);
    x.widen();
    y.widen();
    x.from = kPlotLeft;
    x.to = kPlotWidth - kPlotRight;
    std::vector<LegendEntry> entries;
    for (const std::string& name : plot.names) entries.push_back({name, LegendEntry::Swatch::area});
    Drawing drawing = open_plot(plot.title);
    const double down = draw_legend(entries, drawing);
    drawing.height += down;
    y.to = kPlotTop + down;
    y.from = kPlotHeight + down - kPlotBottom;
    draw_axes(plot.x_label, plot.y_label, x, y, drawing);
    std::vector<double> base(plot.x.size(), 0.0);
    for (std::size_t l = 0; l < plot.layers.size(); ++l) draw_layer(plot, l, x, y, base, drawing);
    return drawing;
}

std::string svg_stack(const StackPlot& plot) {
    return svg_inline(draw_plot(plot));
}

namespace {

constexpr double kCharacterWidth = 6.3;  // in the ticks' font at 11 px, user units
constexpr double kLineHeight = 13, kBetweenTicks = 6;
constexpr double kMostDecades = 7;  // each of which has a tick

std::string tick_text(double v) {
    const double size = std::abs(v);
    if (size < 1e-12) return "0";
    if (size < 1e-2 || size >= 1e12) {  // 0.0001 would be too wide
        const int power = static_cast<int>(std::floor(std::log10(size) + 1e-9));
        return fmt::format("{:.3g}e{}", v / std::pow(10.0, power), power);
    }
    if (size >= 1e9) return fmt::format("{:g}G", v / 1e9);
    if (size >= 1e6) return fmt::format("{:g}M", v / 1e6);
    if (size >= 1e4) return fmt::format("{:g}k", v / 1e3);
    return fmt::format("{:.6g}", v);
}

// The texts in a row or column that keep clear of the one before.
std::vector<double> apart(const std::vector<double>& ticks, const Axis& axis, bool upright) {
    std::vector<double> kept;
    double end = -1e9;  // end of the last text, along the axis
    for (const double v : ticks) {
        const double at = std::abs(axis.place(v) - axis.from);
        const double half = upright ? kLineHeight / 2 : text_width(tick_text(v)) / 2;
        if (!kept.empty() && at - half < end + (upright ? 0 : kBetweenTicks)) continue;
        kept.push_back(v);
        end = at + half;
    }
    return kept;
}

}  // namespace

bool Axis::takes(double v) const {
    return std::isfinite(v) && (!log || v > 0);
}

void Axis::include(double v) {
    const double scaled = log ? std::log10(v) : v;
    low = empty() ? scaled : std::min(low, scaled);
    high = std::max(high, scaled);
}

void Axis::widen() {
    if (high - low >= 1e-9 * std::max(1.0, std::abs(low))) return;
    const double half = log || low == 0 ? 0.5 : 0.05 * std::abs(low);
    low -= half;
    high += half;
}

double Axis::place(double v) const {
    return from + ((log ? std::log10(v) : v) - low) / (high - low) * (to - from);
}

std::vector<double> ticks_of(const Axis& axis) {
    if (!axis.log) return round_ticks(axis.low, axis.high);
    std::vector<double> ticks;
    const double decades = axis.high - axis.low;
    const int stride = std::max(1, static_cast<int>(std::ceil(decades / kMostDecades)));
    for (int e = static_cast<int>(std::floor(axis.low / stride)) * stride; e <= axis.high;
         e += stride)
        for (const double m : {1.0, 2.0, 5.0}) {
            const double log = std::log10(m) + e;
            if (m > 1 && decades > 2.5) continue;
            if (log >= axis.low && log <= axis.high) ticks.push_back(m * std::pow(10, e));
        }
    if (ticks.size() >= 2) return ticks;
    return round_ticks(std::pow(10, axis.low), std::pow(10, axis.high));
}

void draw_axes(const std::string& x_label, const std::string& y_label, const Axis& x, const Axis& y,
               Drawing& drawing) {
    for (const double v : y.empty() ? std::vector<double>{} : apart(ticks_of(y), y, true)) {
        drawing.add_path("grid", {{'M', x.from, y.place(v)}, {'L', x.to, y.place(v)}});
        drawing.add_text("tick", x.from - 6, y.place(v) + 4, tick_text(v), Anchor::end);
    }
    for (const double v : apart(ticks_of(x), x, false)) {
        drawing.add_path("grid", {{'M', x.place(v), y.from}, {'L', x.place(v), y.to}});
        drawing.add_text("tick", x.place(v), y.from + 16, tick_text(v), Anchor::middle);
    }
    drawing.add_path("axis", {{'M', x.from, y.to}, {'L', x.from, y.from}, {'L', x.to, y.from}});
    drawing.add_text("label", (x.from + x.to) / 2, y.from + 36, x_label, Anchor::middle);
    if (y_label.empty()) return;
    drawing.add_text("label", 13, (y.from + y.to) / 2, y_label, Anchor::middle);
    drawing.shapes.back().upright = true;
}

Drawing open_plot(const std::string& title, double height, double width, const std::string& kind) {
    Drawing drawing{width, height, title, kind, {}};
    drawing.add_text("name", kPlotLeft, 18, title);
    return drawing;
}

double text_width(const std::string& text) {
    return kCharacterWidth * static_cast<double>(text.size());
}

std::string fit_text(const std::string& text, double width) {
    if (text_width(text) <= width) return text;
    const auto most = static_cast<std::size_t>(width / kCharacterWidth);
    return text.substr(0, most > 1 ? most - 1 : 0) + "\u2026";
}

double draw_legend(const std::vector<LegendEntry>& entries, Drawing& drawing) {
    constexpr double kLine = 15, kSwatch = 19, kBetween = 14;
    const bool named = std::any_of(entries.begin(), entries.end(),
                                   [](const LegendEntry& e) { return !e.name.empty(); });
    if (entries.size() < 2 || !named) return 0;
    double x = kPlotLeft, y = 34;
    for (std::size_t i = 0; i < entries.size(); ++i) {
        const int series = static_cast<int>(i);
        const double wide = kSwatch + text_width(entries[i].name) + kBetween;
        if (x > kPlotLeft && x + wide - kBetween > drawing.width - 6) {
            x = kPlotLeft;
            y += kLine;
        }
        switch (entries[i].swatch) {
            case LegendEntry::Swatch::line:
                drawing.add_path("line", {{'M', x, y - 4}, {'L', x + 14, y - 4}}, series);
                break;
            case LegendEntry::Swatch::dot:
                drawing.add_circle(x + 7, y - 4, 3.5, series);
                break;
            case LegendEntry::Swatch::area:
                drawing.add_path("area",
                                 {{'M', x + 4, y},
                                  {'L', x + 14, y},
                                  {'L', x + 14, y - 9},
                                  {'L', x + 4, y - 9},
                                  {'z'}},
                                 series);
                break;
        }
        drawing.add_text("tick", x + kSwatch, y, entries[i].name);
        x += wide;
    }
    return y - 34 + kLine;
}

namespace {

// User units. Bars are drawn wider than other plots, as their names are long.
constexpr double kRowHeight = 17, kBarHeight = 11, kBarsWidth = 720, kMostNames = 330, kValues = 78;
constexpr double kMostOfMedian = 4;  // longer bars end in an arrow; otherwise the others would be
                                     // dots

double total(const BarPlot::Row& row) {
    return std::accumulate(row.parts.begin(), row.parts.end(), 0.0);
}

// Where the axis ends: at the longest bar, unless that is far from all others.
double end_of_axis(const BarPlot& plot) {
    std::vector<double> totals;
    double most = 0;
    for (const BarPlot::Row& row : plot.rows) {
        totals.push_back(total(row));
        most = std::max({most, totals.back(), row.high});
    }
    std::nth_element(totals.begin(), totals.begin() + std::ptrdiff_t(totals.size() / 2),
                     totals.end());
    const double limit = kMostOfMedian * totals[totals.size() / 2];
    return limit > 0 ? std::min(most, limit) : most;
}

void draw_bar(const BarPlot& plot, const BarPlot::Row& row, double y, const Axis& x,
              Drawing& drawing) {
    drawing.add_text("tick", x.from - 6, y + 9, fit_text(row.name, x.from - 12), Anchor::end);
    drawing.shapes.back().hint = row.name;
    const auto place = [&](double v) { return x.place(std::min(v, x.high)); };
    double at = 0;
    for (std::size_t p = 0; p < row.parts.size(); ++p) {
        const double from = place(at), to = place(at + row.parts[p]), low = y + kBarHeight;
        drawing.add_path("area",
                         {{'M', from, y}, {'L', to, y}, {'L', to, low}, {'L', from, low}, {'z'}},
                         static_cast<int>(p),
                         fmt::format("{}, {}: {:.4g}", row.name,
                                     p < plot.names.size() ? plot.names[p] : "", row.parts[p]));
        at += row.parts[p];
    }
    if (row.high > row.low && row.high <= x.high)
        drawing.add_path(
            "whisker",
            {{'M', place(row.low), y + kBarHeight / 2}, {'L', place(row.high), y + kBarHeight / 2}},
            -1, fmt::format("{:.4g} to {:.4g}", row.low, row.high));
    drawing.add_text("tick", x.to + 6, y + 9,
                     fmt::format("{}{:.3g}", at > x.high ? "\u2192 " : "", at));
}

}  // namespace

Drawing draw_plot(const BarPlot& plot, DrawnFor place) {
    if (plot.rows.empty()) return {};
    const double rows = kRowHeight * static_cast<double>(plot.rows.size());
    double names = 0;
    for (const BarPlot::Row& row : plot.rows) names = std::max(names, text_width(row.name));
    Axis x, y;
    x.include(0);
    x.include(end_of_axis(plot));
    x.widen();
    x.from = std::max(kPlotLeft, std::min(names, kMostNames) + 14);
    x.to = kBarsWidth - kValues;
    Drawing drawing = open_plot(plot.title, 0, kBarsWidth, "bars");
    std::vector<LegendEntry> entries;
    if (plot.legend_beside && place == DrawnFor::file)
        for (const std::string& name : plot.names)
            entries.push_back({name, LegendEntry::Swatch::area});
    const double down = draw_legend(entries, drawing);
    y.from = kPlotTop + down + rows + 4;
    y.to = kPlotTop + down - 2;
    drawing.height = y.from + kPlotBottom;
    draw_axes(plot.x_label, "", x, y, drawing);
    double at = kPlotTop + down;
    for (const BarPlot::Row& row : plot.rows) {
        draw_bar(plot, row, at, x, drawing);
        at += kRowHeight;
    }
    return drawing;
}

std::string svg_bars(const BarPlot& plot) {
    return svg_inline(draw_plot(plot));
}

}  // namespace darb
