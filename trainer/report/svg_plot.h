// A line plot as an inline SVG element: axes, ticks, units, a legend. Colours come from the page's
// CSS (classes s0, s1 for the series).
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace darb {

struct PlotSeries {
    std::string name;
    std::vector<std::pair<double, double>> points;  // (x, y); not finite: a gap
    bool dots = false;                              // a dot a point beside the line
};

struct Plot {
    std::string title;
    std::string x_label, y_label;  // with unit; the x axis starts at 0
    std::vector<PlotSeries> series;
    bool log_y = false;      // values that are not positive are gaps
    bool from_zero = false;  // the y axis starts at 0
};

/// Empty where no series has a point to draw.
std::string svg_plot(const Plot& plot);

/// 3 to 8 round values (1, 2 or 5 times a power of ten apart) that lie within [low, high].
std::vector<double> round_ticks(double low, double high);

}  // namespace darb
