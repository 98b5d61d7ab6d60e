#include "engine/report/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/report/html.h"
#include "engine/report/svg_axes.h"

namespace darb {

namespace {

constexpr std::size_t kMaxPoints = 600;  // a curve; more cannot be told apart at this size

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

}  // namespace darb
