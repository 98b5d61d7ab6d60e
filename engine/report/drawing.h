// SPDX-License-Identifier: MIT
// Drawing: the shapes that a plot is made of. Three functions write it: as an SVG element inside a
// page, as an SVG file that stands alone, and as a PDF file of vectors. The plots of svg_plot.h
// become such drawings.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace darb {

enum class Anchor { start, middle, end };

struct PathStep {
    char command = 'M';  // M: begins a line, L: continues it, z: closes it
    double x = 0, y = 0;
};

struct Shape {
    enum class Kind { path, circle, text } kind = Kind::path;
    /// The CSS class on the page: line, area, band, grid, axis or whisker for a path; name, label
    /// or tick for text; "" for a circle.
    std::string style;
    int series = -1;  // gives the colour; -1: the style does
    std::vector<PathStep> path;
    double x = 0, y = 0, radius = 0;  // centre and radius of a circle; where a text stands
    std::string text;
    Anchor anchor = Anchor::start;
    bool upright = false;  // the text runs upwards
    std::string hint;      // shown under the pointer
};

/// In user units, which are px of the page; y goes down.
struct Drawing {
    double width = 0, height = 0;
    std::string title;
    std::string kind;  // a CSS class of the element
    std::vector<Shape> shapes;

    bool empty() const { return shapes.empty(); }
    void add_path(std::string style, std::vector<PathStep> path, int series = -1,
                  std::string hint = {});
    void add_circle(double x, double y, double radius, int series, std::string hint = {});
    void add_text(std::string style, double x, double y, std::string text,
                  Anchor anchor = Anchor::start);
};

/// An element for a page of html.h, whose style colours it; empty for an empty drawing.
std::string svg_inline(const Drawing& drawing);
/// A whole file, black on white.
std::string svg_file(const Drawing& drawing);
/// A PDF file of one page of the drawing's size, 0.75 pt a unit. Text is in Helvetica, which every
/// reader has, so the file does not contain the font. Letters beyond Windows-1252 become question
/// marks.
std::string pdf_file(const Drawing& drawing);

/// The characters of UTF-8 text; bytes that are not valid UTF-8 become U+FFFD.
std::vector<char32_t> code_points(std::string_view text);

}  // namespace darb
