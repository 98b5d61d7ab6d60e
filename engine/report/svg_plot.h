// SPDX-License-Identifier: MIT
// Plots as inline SVG elements: axes, ticks, units, legends, and values under the pointer. Colours
// come from the page's CSS (classes s0, s1, ... for the series); see html.h.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace darb {

struct PlotSeries {
    std::string name = {};
    std::vector<std::pair<double, double>> points = {};  // (x, y); not finite: a gap
    bool dots = false;                                   // one dot per point
    bool line = true;
    bool stairs = false;                   // the line keeps its value until the next point
    std::vector<std::string> titles = {};  // shown for dots under the pointer; empty: name and
                                           // values
};

struct Plot {
    std::string title;
    std::string x_label, y_label;  // with unit
    std::vector<PlotSeries> series;
    bool log_y = false;      // values that are not positive become gaps
    bool from_zero = false;  // the y axis starts at 0
    bool log_x = false;
    bool x_from_zero = true;  // unless log_x
};

/// The plot as SVG; empty where no series has a point to draw.
std::string svg_plot(const Plot& plot);

/// Areas stacked on top of one another, over a common x.
struct StackPlot {
    std::string title;
    std::string x_label, y_label;
    std::vector<double> x;
    std::vector<std::string> names;           // one per layer, lowest first
    std::vector<std::vector<double>> layers;  // [layer][x], not negative
};
std::string svg_stack(const StackPlot& plot);

/// One bar per row, divided into the same parts, with a whisker for the spread of the sum.
struct BarPlot {
    struct Row {
        std::string name;
        std::vector<double> parts;
        double low = 0, high = 0;  // range of the sum; equal: no whisker
    };
    std::string title;
    std::string x_label;
    std::vector<std::string> names;  // one per part
    std::vector<Row> rows;
};
std::string svg_bars(const BarPlot& plot);

/// 3 to 8 round values (1, 2 or 5 times a power of ten apart) that lie within [low, high].
std::vector<double> round_ticks(double low, double high);

}  // namespace darb
