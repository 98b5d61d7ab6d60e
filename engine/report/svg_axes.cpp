#include "engine/report/svg_axes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/report/html.h"
#include "engine/report/svg_plot.h"

namespace darb {

namespace {

constexpr double kCharacterWidth = 6.3;  // of the ticks' font at 11 px, user units
constexpr double kLineHeight = 13, kBetweenTicks = 6;
constexpr double kMostDecades = 7;  // with a tick each

std::string tick_text(double v) {
    const double size = std::abs(v);
    if (size < 1e-12) return "0";
    if (size < 1e-2 || size >= 1e12) {  // 0.0001 is too wide
        const int power = static_cast<int>(std::floor(std::log10(size) + 1e-9));
        return fmt::format("{:.3g}e{}", v / std::pow(10.0, power), power);
    }
    if (size >= 1e9) return fmt::format("{:g}G", v / 1e9);
    if (size >= 1e6) return fmt::format("{:g}M", v / 1e6);
    if (size >= 1e4) return fmt::format("{:g}k", v / 1e3);
    return fmt::format("{:.6g}", v);
}

// Those of a row or column of texts that keep clear of the one before.
std::vector<double> apart(const std::vector<double>& ticks, const Axis& axis, bool upright) {
    std::vector<double> kept;
    double end = -1e9;  // of the last text, along the axis
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

}  // namespace darb
