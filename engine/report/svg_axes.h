// Axes of the plots: ranges, ticks, grid and labels. Of engine/report only.
#pragma once

#include <string>
#include <vector>

namespace darb {

// Of every plot's view box, in user units; CSS scales the whole.
constexpr double kPlotWidth = 480, kPlotHeight = 260;
constexpr double kPlotLeft = 70, kPlotRight = 28, kPlotTop = 30, kPlotBottom = 44;

struct Axis {
    double low = 0, high = -1;  // low > high: nothing included yet; logarithms where log
    double from = 0, to = 1;    // where low and high lie in the picture
    bool log = false;

    bool takes(double v) const;  // finite, and positive where log
    void include(double v);      // must be taken
    bool empty() const { return low > high; }
    void widen();  // a range of some width
    double place(double v) const;
};

std::vector<double> ticks_of(const Axis& axis);
/// Grid, ticks, both axes and their labels.
std::string draw_axes(const std::string& x_label, const std::string& y_label, const Axis& x,
                      const Axis& y);
/// The opening tag and the title. kind: a CSS class of the element.
std::string open_plot(const std::string& title, double height = kPlotHeight,
                      double width = kPlotWidth, const std::string& kind = {});

struct LegendEntry {
    std::string name;
    enum class Swatch { line, dot, area } swatch = Swatch::line;
};
/// Names with a swatch each under the title, in as many lines as they need; nothing for a single
/// one.
struct Legend {
    std::string svg;
    double height = 0;  // that the plot begins lower by
};
Legend draw_legend(const std::vector<LegendEntry>& entries, double width = kPlotWidth);
/// Of a text in the font of ticks and legends.
double text_width(const std::string& text);
/// The text, or its beginning and an ellipsis where it is wider than that.
std::string fit_text(const std::string& text, double width);

}  // namespace darb
