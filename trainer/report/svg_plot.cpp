#include "trainer/report/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "trainer/report/html.h"

namespace darb {

namespace {

// Of the view box, in user units; CSS scales the whole.
constexpr double kWidth = 480, kHeight = 260;
constexpr double kLeft = 58, kRight = 20, kTop = 30, kBottom = 44;
constexpr std::size_t kMaxPoints = 600;  // a curve; more cannot be told apart at this size

struct Axis {
    double low = std::numeric_limits<double>::infinity();
    double high = -std::numeric_limits<double>::infinity();
    double from = 0, to = 1;  // where low and high lie in the picture
    bool log = false;

    bool takes(double v) const { return std::isfinite(v) && (!log || v > 0); }
    double scaled(double v) const { return log ? std::log10(v) : v; }
    void include(double v) {
        low = std::min(low, scaled(v));
        high = std::max(high, scaled(v));
    }
    bool empty() const { return low > high; }
    void widen() {
        if (high - low < 1e-9 * std::max(1.0, std::abs(low))) {
            const double half = std::max(0.5, 0.05 * std::abs(low));
            low -= half;
            high += half;
        }
    }
    double place(double v) const { return from + (scaled(v) - low) / (high - low) * (to - from); }
};

std::vector<double> ticks_of(const Axis& axis) {
    if (!axis.log) return round_ticks(axis.low, axis.high);
    std::vector<double> ticks;
    for (int e = static_cast<int>(std::floor(axis.low)); e <= axis.high; ++e)
        for (const double m : {1.0, 2.0, 5.0}) {
            const double log = std::log10(m) + e;
            if (log >= axis.low && log <= axis.high) ticks.push_back(m * std::pow(10, e));
        }
    if (ticks.size() >= 2) return ticks;
    return round_ticks(std::pow(10, axis.low), std::pow(10, axis.high));
}

std::string tick_text(double v) {
    if (std::abs(v) >= 1e6) return fmt::format("{:g}M", v / 1e6);
    if (std::abs(v) >= 1e4) return fmt::format("{:g}k", v / 1e3);
    return fmt::format("{:.6g}", std::abs(v) < 1e-12 ? 0.0 : v);
}

std::string draw_axes(const Plot& plot, const Axis& x, const Axis& y) {
    std::string svg;
    for (const double v : ticks_of(y)) {
        svg +=
            fmt::format("<path class='grid' d='M{:.1f} {:.1f}H{:.1f}'/>", x.from, y.place(v), x.to);
        svg += fmt::format("<text class='tick' text-anchor='end' x='{:.1f}' y='{:.1f}'>{}</text>",
                           x.from - 6, y.place(v) + 4, tick_text(v));
    }
    for (const double v : ticks_of(x)) {
        svg +=
            fmt::format("<path class='grid' d='M{:.1f} {:.1f}V{:.1f}'/>", x.place(v), y.from, y.to);
        svg +=
            fmt::format("<text class='tick' text-anchor='middle' x='{:.1f}' y='{:.1f}'>{}</text>",
                        x.place(v), y.from + 16, tick_text(v));
    }
    svg += fmt::format("<path class='axis' d='M{:.1f} {:.1f}V{:.1f}H{:.1f}'/>", x.from, y.to,
                       y.from, x.to);
    svg += fmt::format("<text class='label' text-anchor='middle' x='{:.1f}' y='{:.1f}'>{}</text>",
                       (x.from + x.to) / 2, kHeight - 8, html_escape(plot.x_label));
    svg += fmt::format(
        "<text class='label' text-anchor='middle' transform='translate(13 {:.1f}) rotate(-90)'>"
        "{}</text>",
        (y.from + y.to) / 2, html_escape(plot.y_label));
    return svg;
}

std::string draw_series(const PlotSeries& series, std::size_t index, const Axis& x, const Axis& y) {
    std::string path, dots;
    const std::size_t stride = (series.points.size() + kMaxPoints - 1) / kMaxPoints;
    bool pen_down = false;
    for (std::size_t i = 0; i < series.points.size(); ++i) {
        const auto& [px, py] = series.points[i];
        const bool last = i + 1 == series.points.size();
        if (i % stride != 0 && !last) continue;
        if (!x.takes(px) || !y.takes(py)) {
            pen_down = false;
            continue;
        }
        path += fmt::format("{}{:.1f} {:.1f}", pen_down ? 'L' : 'M', x.place(px), y.place(py));
        pen_down = true;
        if (series.dots)
            dots += fmt::format(
                "<circle class='s{}' cx='{:.1f}' cy='{:.1f}' r='3.5'><title>{}: {:.6g}, {:.6g}"
                "</title></circle>",
                index, x.place(px), y.place(py), html_escape(series.name), px, py);
    }
    return path.empty() ? "" : fmt::format("<path class='line s{}' d='{}'/>{}", index, path, dots);
}

std::string draw_legend(const Plot& plot) {
    if (plot.series.size() < 2) return {};
    std::string svg;
    double right = kWidth - kRight;
    for (std::size_t i = plot.series.size(); i-- > 0;) {
        svg += fmt::format("<text class='tick' text-anchor='end' x='{:.1f}' y='18'>{}</text>",
                           right, html_escape(plot.series[i].name));
        right -= 6.2 * static_cast<double>(plot.series[i].name.size()) + 8;
        svg += fmt::format("<path class='line s{}' d='M{:.1f} 14h-14'/>", i, right);
        right -= 26;
    }
    return svg;
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
    y.log = plot.log_y;
    for (const PlotSeries& series : plot.series)
        for (const auto& [px, py] : series.points)
            if (x.takes(px) && y.takes(py)) {
                x.include(px);
                y.include(py);
            }
    if (x.empty()) return {};
    x.include(0);
    if (plot.from_zero && !plot.log_y) y.include(0);
    x.widen();
    y.widen();
    const double margin = 0.04 * (y.high - y.low);
    if (!(plot.from_zero && y.low == 0)) y.low -= margin;
    y.high += margin;
    x.from = kLeft;
    x.to = kWidth - kRight;
    y.from = kHeight - kBottom;
    y.to = kTop;
    std::string svg = fmt::format(
        "<svg viewBox='0 0 {} {}' role='img' aria-label='{}'>"
        "<text class='name' x='{}' y='18'>{}</text>",
        kWidth, kHeight, html_escape(plot.title), kLeft, html_escape(plot.title));
    svg += draw_axes(plot, x, y);
    for (std::size_t i = 0; i < plot.series.size(); ++i)
        svg += draw_series(plot.series[i], i, x, y);
    return svg + draw_legend(plot) + "</svg>\n";
}

}  // namespace darb
