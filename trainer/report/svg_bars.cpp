#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "trainer/report/html.h"
#include "trainer/report/svg_axes.h"
#include "trainer/report/svg_plot.h"

namespace darb {

namespace {

constexpr double kRowHeight = 17, kBarHeight = 11, kNames = 170;  // user units

std::string draw_bar(const BarPlot& plot, const BarPlot::Row& row, double y, const Axis& x) {
    std::string svg =
        fmt::format("<text class='tick' text-anchor='end' x='{:.1f}' y='{:.1f}'>{}</text>",
                    x.from - 6, y + 9, html_escape(row.name));
    double at = 0;
    for (std::size_t p = 0; p < row.parts.size(); ++p) {
        svg += fmt::format(
            "<path class='area s{}' d='M{:.1f} {:.1f}H{:.1f}v{}H{:.1f}z'><title>{}, {}: {:.4g}"
            "</title></path>",
            p, x.place(at), y, x.place(at + row.parts[p]), kBarHeight, x.place(at),
            html_escape(row.name), html_escape(p < plot.names.size() ? plot.names[p] : ""),
            row.parts[p]);
        at += row.parts[p];
    }
    if (row.high > row.low)
        svg += fmt::format(
            "<path class='whisker' d='M{:.1f} {:.1f}H{:.1f}'><title>{:.4g} to {:.4g}"
            "</title></path>",
            x.place(row.low), y + kBarHeight / 2, x.place(row.high), row.low, row.high);
    return svg;
}

}  // namespace

std::string svg_bars(const BarPlot& plot) {
    if (plot.rows.empty()) return {};
    const double rows = kRowHeight * static_cast<double>(plot.rows.size());
    Axis x, y;
    x.include(0);
    for (const BarPlot::Row& row : plot.rows) {
        x.include(std::accumulate(row.parts.begin(), row.parts.end(), 0.0));
        x.include(row.high);
    }
    x.widen();
    x.from = kNames;
    x.to = kPlotWidth - kPlotRight;
    y.from = kPlotTop + rows + 4;
    y.to = kPlotTop - 2;
    std::string svg = open_plot(plot.title, y.from + kPlotBottom);
    svg += draw_axes(plot.x_label, "", x, y);
    double at = kPlotTop;
    for (const BarPlot::Row& row : plot.rows) {
        svg += draw_bar(plot, row, at, x);
        at += kRowHeight;
    }
    return svg + "</svg>\n";
}

}  // namespace darb
