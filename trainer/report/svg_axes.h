// Axes of the plots: ranges, ticks, grid and labels. Of trainer/report only.
#pragma once

#include <string>
#include <vector>

namespace darb {

// Of every plot's view box, in user units; CSS scales the whole.
constexpr double kPlotWidth = 480, kPlotHeight = 260;
constexpr double kPlotLeft = 58, kPlotRight = 20, kPlotTop = 30, kPlotBottom = 44;

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
/// The opening tag and the title.
std::string open_plot(const std::string& title, double height = kPlotHeight);
/// Names with a swatch each, right-aligned beside the title; empty for a single one, and
/// where none has a name.
std::string draw_legend(const std::vector<std::string>& names, bool filled = false);

}  // namespace darb
