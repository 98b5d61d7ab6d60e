// SPDX-License-Identifier: MIT
#include "engine/report/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "engine/report/html.h"

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
std::string draw_axes(const std::string& x_label, const std::string& y_label, const Axis& x,
                      const Axis& y);
/// The opening tag and the title. kind: a CSS class of the element.
std::string open_plot(const std::string& title, double height = kPlotHeight,
                      double width = kPlotWidth, const std::string& kind = {});

struct LegendEntry {
    std::string name;
    enum class Swatch { line, dot, area } swatch = Swatch::line;
};
/// Draws names, each with a colour swatch, below the title, in as many lines as they need; nothing
/// for a single name.
struct Legend {
    std::string svg;
    double height = 0;  // by which the plot moves down
};
Legend draw_legend(const std::vector<LegendEntry>& entries, double width = kPlotWidth);
/// The width of a text in the font of ticks and legends, user units.
double text_width(const std::string& text);
/// The text, or where it is wider than that, its beginning and an ellipsis.
std::string fit_text(const std::string& text, double width);

namespace {

constexpr std::size_t kMaxPoints = 600;  // per curve; more cannot be distinguished at this size

std::string draw_dot(const PlotSeries& series, std::size_t index, std::size_t point, const Axis& x,
                     const Axis& y) {
    const auto& [px, py] = series.points[point];
    const std::string title = point < series.titles.size()
                                  ? series.titles[point]
                                  : fmt::format("{}: {:.6g}, {:.6g}", series.name, px, py);
    return fmt::format(
        "<circle class='s{}' cx='{:.1f}' cy='{:.1f}' r='3.5'><title>{}</title></circle>", index,
        x.place(px), y.place(py), html_escape(title));
}

std::string draw_series(const PlotSeries& series, std::size_t index, const Axis& x, const Axis& y) {
    std::string path, dots;
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
        if (series.stairs && pen_down) path += fmt::format("H{:.1f}", x.place(px));
        path += fmt::format("{}{:.1f} {:.1f}", pen_down ? 'L' : 'M', x.place(px), y.place(py));
        pen_down = true;
        if (series.dots) dots += draw_dot(series, index, i, x, y);
    }
    if (!series.line || path.empty()) return dots;
    return fmt::format("<path class='line s{}' d='{}'/>{}", index, path, dots);
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

std::string svg_plot(const Plot& plot) {
    Axis x, y;
    x.log = plot.log_x;
    y.log = plot.log_y;
    for (const PlotSeries& series : plot.series)
        for (const auto& [px, py] : series.points)
            if (x.takes(px) && y.takes(py)) {
                x.include(px);
                y.include(py);
            }
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
    const Legend legend = draw_legend(entries);
    y.to = kPlotTop + legend.height;
    y.from = kPlotHeight + legend.height - kPlotBottom;
    std::string svg = open_plot(plot.title, kPlotHeight + legend.height) + legend.svg +
                      draw_axes(plot.x_label, plot.y_label, x, y);
    for (std::size_t i = 0; i < plot.series.size(); ++i)
        svg += draw_series(plot.series[i], i, x, y);
    return svg + "</svg>\n";
}

std::string svg_stack(const StackPlot& plot) {
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
    const Legend legend = draw_legend(entries);
    y.to = kPlotTop + legend.height;
    y.from = kPlotHeight + legend.height - kPlotBottom;
    std::string svg = open_plot(plot.title, kPlotHeight + legend.height) + legend.svg +
                      draw_axes(plot.x_label, plot.y_label, x, y);
    std::vector<double> base(plot.x.size(), 0.0);
    const std::size_t stride = (plot.x.size() + kMaxPoints - 1) / kMaxPoints;
    for (std::size_t l = 0; l < plot.layers.size(); ++l) {
        std::string there, back;
        double sum = 0;
        for (std::size_t i = 0; i < plot.x.size(); i += stride) {
            const double above = base[i] + plot.layers[l][i];
            there += fmt::format("{}{:.1f} {:.1f}", there.empty() ? 'M' : 'L', x.place(plot.x[i]),
                                 y.place(above));
            back.insert(0, fmt::format("L{:.1f} {:.1f}", x.place(plot.x[i]), y.place(base[i])));
        }
        for (std::size_t i = 0; i < plot.x.size(); ++i) {
            base[i] += plot.layers[l][i];
            sum += plot.layers[l][i];
        }
        svg += fmt::format(
            "<path class='area s{}' d='{}{}z'><title>{}: {:.3g} in the mean</title>"
            "</path>",
            l, there, back, html_escape(plot.names[l]), sum / static_cast<double>(plot.x.size()));
    }
    return svg + "</svg>\n";
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

std::string draw_axes(const std::string& x_label, const std::string& y_label, const Axis& x,
                      const Axis& y) {
    std::string svg;
    for (const double v : y.empty() ? std::vector<double>{} : apart(ticks_of(y), y, true)) {
        svg +=
            fmt::format("<path class='grid' d='M{:.1f} {:.1f}H{:.1f}'/>", x.from, y.place(v), x.to);
        svg += fmt::format("<text class='tick' text-anchor='end' x='{:.1f}' y='{:.1f}'>{}</text>",
                           x.from - 6, y.place(v) + 4, tick_text(v));
    }
    for (const double v : apart(ticks_of(x), x, false)) {
        svg +=
            fmt::format("<path class='grid' d='M{:.1f} {:.1f}V{:.1f}'/>", x.place(v), y.from, y.to);
        svg +=
            fmt::format("<text class='tick' text-anchor='middle' x='{:.1f}' y='{:.1f}'>{}</text>",
                        x.place(v), y.from + 16, tick_text(v));
    }
    svg += fmt::format("<path class='axis' d='M{:.1f} {:.1f}V{:.1f}H{:.1f}'/>", x.from, y.to,
                       y.from, x.to);
    svg += fmt::format("<text class='label' text-anchor='middle' x='{:.1f}' y='{:.1f}'>{}</text>",
                       (x.from + x.to) / 2, y.from + 36, html_escape(x_label));
    if (y_label.empty()) return svg;
    return svg + fmt::format(
                     "<text class='label' text-anchor='middle' transform='translate(13 {:.1f}) "
                     "rotate(-90)'>{}</text>",
                     (y.from + y.to) / 2, html_escape(y_label));
}

std::string open_plot(const std::string& title, double height, double width,
                      const std::string& kind) {
    return fmt::format(
        "<svg{} viewBox='0 0 {} {}' role='img' aria-label='{}'>"
        "<text class='name' x='{}' y='18'>{}</text>",
        kind.empty() ? "" : fmt::format(" class='{}'", kind), width, height, html_escape(title),
        kPlotLeft, html_escape(title));
}

double text_width(const std::string& text) {
    return kCharacterWidth * static_cast<double>(text.size());
}

std::string fit_text(const std::string& text, double width) {
    if (text_width(text) <= width) return text;
    const auto most = static_cast<std::size_t>(width / kCharacterWidth);
    return text.substr(0, most > 1 ? most - 1 : 0) + "\u2026";
}

Legend draw_legend(const std::vector<LegendEntry>& entries, double width) {
    constexpr double kLine = 15, kSwatch = 19, kBetween = 14;
    Legend legend;
    const bool named = std::any_of(entries.begin(), entries.end(),
                                   [](const LegendEntry& e) { return !e.name.empty(); });
    if (entries.size() < 2 || !named) return legend;
    double x = kPlotLeft, y = 34;
    for (std::size_t i = 0; i < entries.size(); ++i) {
        const double wide = kSwatch + text_width(entries[i].name) + kBetween;
        if (x > kPlotLeft && x + wide - kBetween > width - 6) {
            x = kPlotLeft;
            y += kLine;
        }
        switch (entries[i].swatch) {
            case LegendEntry::Swatch::line:
                legend.svg +=
                    fmt::format("<path class='line s{}' d='M{:.1f} {:.1f}h14'/>", i, x, y - 4);
                break;
            case LegendEntry::Swatch::dot:
                legend.svg += fmt::format("<circle class='s{}' cx='{:.1f}' cy='{:.1f}' r='3.5'/>",
                                          i, x + 7, y - 4);
                break;
            case LegendEntry::Swatch::area:
                legend.svg += fmt::format("<path class='area s{}' d='M{:.1f} {:.1f}h10v-9h-10z'/>",
                                          i, x + 4, y);
                break;
        }
        legend.svg += fmt::format("<text class='tick' x='{:.1f}' y='{:.1f}'>{}</text>", x + kSwatch,
                                  y, html_escape(entries[i].name));
        x += wide;
    }
    legend.height = y - 34 + kLine;
    return legend;
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

std::string draw_bar(const BarPlot& plot, const BarPlot::Row& row, double y, const Axis& x) {
    std::string svg = fmt::format(
        "<text class='tick' text-anchor='end' x='{:.1f}' y='{:.1f}'>{}<title>{}</title></text>",
        x.from - 6, y + 9, html_escape(fit_text(row.name, x.from - 12)), html_escape(row.name));
    const auto place = [&](double v) { return x.place(std::min(v, x.high)); };
    double at = 0;
    for (std::size_t p = 0; p < row.parts.size(); ++p) {
        svg += fmt::format(
            "<path class='area s{}' d='M{:.1f} {:.1f}H{:.1f}v{}H{:.1f}z'><title>{}, {}: {:.4g}"
            "</title></path>",
            p, place(at), y, place(at + row.parts[p]), kBarHeight, place(at), html_escape(row.name),
            html_escape(p < plot.names.size() ? plot.names[p] : ""), row.parts[p]);
        at += row.parts[p];
    }
    if (row.high > row.low && row.high <= x.high)
        svg += fmt::format(
            "<path class='whisker' d='M{:.1f} {:.1f}H{:.1f}'><title>{:.4g} to {:.4g}"
            "</title></path>",
            place(row.low), y + kBarHeight / 2, place(row.high), row.low, row.high);
    return svg + fmt::format("<text class='tick' x='{:.1f}' y='{:.1f}'>{}{:.3g}</text>", x.to + 6,
                             y + 9, at > x.high ? "\u2192 " : "", at);
}

}  // namespace

std::string svg_bars(const BarPlot& plot) {
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
    y.from = kPlotTop + rows + 4;
    y.to = kPlotTop - 2;
    std::string svg = open_plot(plot.title, y.from + kPlotBottom, kBarsWidth, "bars");
    svg += draw_axes(plot.x_label, "", x, y);
    double at = kPlotTop;
    for (const BarPlot::Row& row : plot.rows) {
        svg += draw_bar(plot, row, at, x);
        at += kRowHeight;
    }
    return svg + "</svg>\n";
}

}  // namespace darb
