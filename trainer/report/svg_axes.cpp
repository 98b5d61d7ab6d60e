#include "trainer/report/svg_axes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "trainer/report/html.h"
#include "trainer/report/svg_plot.h"

namespace darb {

namespace {

std::string tick_text(double v) {
    if (std::abs(v) >= 1e6) return fmt::format("{:g}M", v / 1e6);
    if (std::abs(v) >= 1e4) return fmt::format("{:g}k", v / 1e3);
    return fmt::format("{:.6g}", std::abs(v) < 1e-12 ? 0.0 : v);
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
    const double half = std::max(0.5, 0.05 * std::abs(low));
    low -= half;
    high += half;
}

double Axis::place(double v) const {
    return from + ((log ? std::log10(v) : v) - low) / (high - low) * (to - from);
}

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

std::string draw_axes(const std::string& x_label, const std::string& y_label, const Axis& x,
                      const Axis& y) {
    std::string svg;
    for (const double v : y.empty() ? std::vector<double>{} : ticks_of(y)) {
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
                       (x.from + x.to) / 2, y.from + 36, html_escape(x_label));
    if (y_label.empty()) return svg;
    return svg + fmt::format(
                     "<text class='label' text-anchor='middle' transform='translate(13 {:.1f}) "
                     "rotate(-90)'>{}</text>",
                     (y.from + y.to) / 2, html_escape(y_label));
}

std::string open_plot(const std::string& title, double height) {
    return fmt::format(
        "<svg viewBox='0 0 {} {}' role='img' aria-label='{}'>"
        "<text class='name' x='{}' y='18'>{}</text>",
        kPlotWidth, height, html_escape(title), kPlotLeft, html_escape(title));
}

std::string draw_legend(const std::vector<std::string>& names, bool filled) {
    const bool named = std::any_of(names.begin(), names.end(),
                                   [](const std::string& name) { return !name.empty(); });
    if (names.size() < 2 || !named) return {};
    std::string svg;
    double right = kPlotWidth - kPlotRight;
    for (std::size_t i = names.size(); i-- > 0;) {
        svg += fmt::format("<text class='tick' text-anchor='end' x='{:.1f}' y='18'>{}</text>",
                           right, html_escape(names[i]));
        right -= 6.2 * static_cast<double>(names[i].size()) + 8;
        const char* swatch = filled ? "9h-9v9h9z" : "14h-14";
        svg += fmt::format("<path class='{} s{}' d='M{:.1f} {}'/>", filled ? "area" : "line", i,
                           right, swatch);
        right -= filled ? 20 : 26;
    }
    return svg;
}

}  // namespace darb
