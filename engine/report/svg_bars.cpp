#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "engine/report/html.h"
#include "engine/report/svg_axes.h"
#include "engine/report/svg_plot.h"

namespace darb {

namespace {

// User units. Bars are drawn wider than other plots, as their names are long.
constexpr double kRowHeight = 17, kBarHeight = 11, kBarsWidth = 720, kMostNames = 330, kValues = 78;
constexpr double kMostOfMedian = 4;  // longer bars end at an arrow, or the others would be dots

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
