// SPDX-License-Identifier: MIT
// Plots: axes, ticks, units, legends, and values under the pointer. A plot becomes a drawing, which
// drawing.h writes as an element of a page, or as a file.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "engine/report/drawing.h"

namespace darb {

struct PlotSeries {
    std::string name = {};
    std::vector<std::pair<double, double>> points = {};  // (x, y); not finite: a gap
    bool dots = false;                                   // one dot for each point
    bool line = true;
    bool stairs = false;                   // the line keeps its value until the next point
    std::vector<std::string> titles = {};  // shown for dots under the pointer; empty: name and
                                           // values
    /// The spread around each point: its lowest and highest y. Empty: none is drawn.
    std::vector<std::pair<double, double>> band = {};
};

struct Plot {
    std::string title;
    std::string x_label, y_label;  // with unit
    std::vector<PlotSeries> series;
    bool log_y = false;      // values that are not positive become gaps
    bool from_zero = false;  // the y axis starts at 0
    bool log_x = false;
    bool x_from_zero = true;     // unless log_x
    bool legend_beside = false;  // on a page, a legend of several plots names the series
};

/// Where a drawing is shown: a page may have a legend beside it, a file stands alone.
enum class DrawnFor { page, file };

/// Empty where no series has a point to draw.
Drawing draw_plot(const Plot& plot, DrawnFor place = DrawnFor::page);
/// The plot as an element of a page.
std::string svg_plot(const Plot& plot);

/// Areas stacked on top of one another, over a common x.
struct StackPlot {
    std::string title;
    std::string x_label, y_label;
    std::vector<double> x;
    std::vector<std::string> names;           // one per layer, lowest first
    std::vector<std::vector<double>> layers;  // [layer][x], not negative
};
Drawing draw_plot(const StackPlot& plot, DrawnFor place = DrawnFor::page);
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
    bool legend_beside = false;  // as in Plot
};
Drawing draw_plot(const BarPlot& plot, DrawnFor place = DrawnFor::page);
std::string svg_bars(const BarPlot& plot);

/// 3 to 8 round values (1, 2 or 5 times a power of ten apart) that lie within [low, high].
std::vector<double> round_ticks(double low, double high);

}  // namespace darb
