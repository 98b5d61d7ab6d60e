// SPDX-License-Identifier: MIT
// The writers of drawings. The PDF follows ISO 32000-1: one page, one content stream, and two of
// the fonts that every reader has.
#include "engine/report/drawing.h"

#include <fmt/format.h>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "engine/report/html.h"
#include "engine/report/palette.h"

namespace darb {

void Drawing::add_path(std::string style, std::vector<PathStep> path, int series,
                       std::string hint) {
    Shape shape;
    shape.style = std::move(style);
    shape.series = series;
    shape.path = std::move(path);
    shape.hint = std::move(hint);
    shapes.push_back(std::move(shape));
}

void Drawing::add_circle(double x, double y, double radius, int series, std::string hint) {
    Shape shape;
    shape.kind = Shape::Kind::circle;
    shape.series = series;
    shape.x = x;
    shape.y = y;
    shape.radius = radius;
    shape.hint = std::move(hint);
    shapes.push_back(std::move(shape));
}

void Drawing::add_text(std::string style, double x, double y, std::string text, Anchor anchor) {
    Shape shape;
    shape.kind = Shape::Kind::text;
    shape.style = std::move(style);
    shape.x = x;
    shape.y = y;
    shape.text = std::move(text);
    shape.anchor = anchor;
    shapes.push_back(std::move(shape));
}

std::vector<char32_t> code_points(std::string_view text) {
    constexpr char32_t kNone = 0xFFFD;
    constexpr std::array<char32_t, 5> kLeast = {0, 0, 0x80, 0x800, 0x10000};
    std::vector<char32_t> points;
    for (std::size_t i = 0; i < text.size();) {
        const auto byte = static_cast<unsigned char>(text[i]);
        const std::size_t count = byte < 0x80             ? 1
                                  : (byte & 0xE0) == 0xC0 ? 2
                                  : (byte & 0xF0) == 0xE0 ? 3
                                  : (byte & 0xF8) == 0xF0 ? 4
                                                          : 0;
        char32_t point = count < 2 ? byte : byte & (0x7Fu >> count);
        std::size_t used = 1;
        while (used < count && i + used < text.size() &&
               (static_cast<unsigned char>(text[i + used]) & 0xC0) == 0x80)
            point = point << 6 | (static_cast<unsigned char>(text[i + used++]) & 0x3Fu);
        const bool valid = count > 0 && used == count && point >= kLeast[count] &&
                           point <= 0x10FFFF && (point < 0xD800 || point > 0xDFFF);
        points.push_back(valid ? point : kNone);
        i += valid ? count : 1;
    }
    return points;
}

// SVG.

namespace {

std::string path_data(const std::vector<PathStep>& path) {
    std::string data;
    for (const PathStep& step : path)
        data += step.command == 'z' ? std::string("z")
                                    : fmt::format("{}{:.1f} {:.1f}", step.command, step.x, step.y);
    return data;
}

std::string classes_of(const Shape& shape) {
    if (shape.series < 0) return shape.style;
    return fmt::format("{}{}s{}", shape.style, shape.style.empty() ? "" : " ", shape.series);
}

std::string svg_shape(const Shape& shape) {
    const std::string hint =
        shape.hint.empty() ? "" : "<title>" + html_escape(shape.hint) + "</title>";
    switch (shape.kind) {
        case Shape::Kind::path: {
            const std::string open =
                fmt::format("<path class='{}' d='{}'", classes_of(shape), path_data(shape.path));
            return open + (hint.empty() ? "/>" : ">" + hint + "</path>");
        }
        case Shape::Kind::circle: {
            const std::string open =
                fmt::format("<circle class='{}' cx='{:.1f}' cy='{:.1f}' r='{:g}'",
                            classes_of(shape), shape.x, shape.y, shape.radius);
            return open + (hint.empty() ? "/>" : ">" + hint + "</circle>");
        }
        case Shape::Kind::text:
            break;
    }
    const char* anchor = shape.anchor == Anchor::middle ? " text-anchor='middle'"
                         : shape.anchor == Anchor::end  ? " text-anchor='end'"
                                                        : "";
    const std::string place =
        shape.upright
            ? fmt::format("transform='translate({:.1f} {:.1f}) rotate(-90)'", shape.x, shape.y)
            : fmt::format("x='{:.1f}' y='{:.1f}'", shape.x, shape.y);
    return fmt::format("<text class='{}'{} {}>{}{}</text>", shape.style, anchor, place,
                       html_escape(shape.text), hint);
}

std::string svg_shapes(const Drawing& drawing) {
    std::string svg;
    for (const Shape& shape : drawing.shapes) svg += svg_shape(shape);
    return svg + "</svg>\n";
}

/// How a shape looks on white paper.
struct Look {
    std::string fill, stroke;  // #rrggbb; empty: none
    double width = 1;          // of the stroke, user units
    double opacity = 1;        // of the fill
    double size = 0;           // of the font, user units
    bool bold = false;
};

Look look_of(const std::string& style, int series) {
    const std::string ink = css_colour(palette::kLight.ink),
                      soft = css_colour(palette::kLight.soft),
                      line = css_colour(palette::kLight.line);
    const auto& colours = palette::kLight.series;
    const std::string colour =
        series < 0 ? ink : css_colour(colours[static_cast<std::size_t>(series) % colours.size()]);
    if (style == "line") return {"", colour, 1.8};
    if (style == "area") return {colour, "#ffffff", 0.6};
    if (style == "band") return {colour, "", 1, 0.18};
    if (style == "grid") return {"", line};
    if (style == "axis") return {"", soft};
    if (style == "whisker") return {"", ink, 1.6};
    if (style == "name") return {ink, "", 1, 1, 13, true};
    if (style == "label" || style == "tick") return {soft, "", 1, 1, 11};
    return {colour, ""};
}

std::string rule(const std::string& selector, const Look& look) {
    std::string css = fmt::format("{}{{fill:{}", selector, look.fill.empty() ? "none" : look.fill);
    if (look.opacity < 1) css += fmt::format(";fill-opacity:{}", look.opacity);
    if (!look.stroke.empty())
        css += fmt::format(";stroke:{};stroke-width:{}", look.stroke, look.width);
    if (look.size > 0)
        css += fmt::format(";font-size:{}px;font-weight:{}", look.size, look.bold ? 600 : 400);
    return css + "}\n";
}

}  // namespace

std::string svg_inline(const Drawing& drawing) {
    if (drawing.empty()) return {};
    const std::string kind = drawing.kind.empty() ? "" : fmt::format(" class='{}'", drawing.kind);
    return fmt::format("<svg{} viewBox='0 0 {} {}' role='img' aria-label='{}'>", kind,
                       drawing.width, drawing.height, html_escape(drawing.title)) +
           svg_shapes(drawing);
}

std::string svg_file(const Drawing& drawing) {
    std::string css = "text{font-family:Helvetica,Arial,sans-serif}\n";
    for (const char* style : {"grid", "axis", "whisker", "name", "label", "tick"})
        css += rule(std::string(".") + style, look_of(style, -1));
    for (int s = 0; s < static_cast<int>(palette::kLight.series.size()); ++s) {
        for (const char* style : {"line", "area", "band"})
            css += rule(fmt::format(".{}.s{}", style, s), look_of(style, s));
        css += rule(fmt::format("circle.s{}", s), look_of("", s));
    }
    return fmt::format(
               "<?xml version='1.0' encoding='UTF-8'?>\n<svg xmlns='http://www.w3.org/2000/svg' "
               "width='{0}' height='{1}' viewBox='0 0 {0} {1}'>\n<title>{2}</title>\n"
               "<style>\n{3}</style>\n",
               drawing.width, drawing.height, html_escape(drawing.title), css) +
           svg_shapes(drawing);
}

// PDF.

namespace {

constexpr double kPoints = 0.75;       // of a user unit
constexpr double kCircleArm = 0.5523;  // of four Bezier curves that make a circle

// Widths of Helvetica's characters from the space to the tilde, in thousandths of its size.
constexpr std::array<std::uint16_t, 95> kWidths = {
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333,  278, 278, 556, 556, 556,
    556, 556, 556, 556, 556, 556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667,
    611, 778, 722, 278, 500, 667, 556, 833, 722, 778, 667, 778, 722, 667,  611, 722, 667, 944, 667,
    667, 611, 278, 278, 278, 469, 556, 333, 556, 556, 500, 556, 556, 278,  556, 556, 222, 222, 500,
    222, 833, 556, 556, 556, 556, 333, 500, 278, 556, 500, 722, 500, 500,  500, 334, 260, 334, 584};

constexpr std::pair<char32_t, unsigned char> kBeyondLatin1[] = {
    {0x2026, 0x85}, {0x2018, 0x91}, {0x2019, 0x92}, {0x201C, 0x93}, {0x201D, 0x94},
    {0x2022, 0x95}, {0x2013, 0x96}, {0x2014, 0x97}, {0x2192, '>'}};

/// The text in Windows-1252.
std::string windows_1252(const std::string& text) {
    std::string bytes;
    for (const char32_t point : code_points(text)) {
        unsigned char byte = '?';
        if ((point >= 0x20 && point < 0x7F) || (point >= 0xA0 && point <= 0xFF))
            byte = static_cast<unsigned char>(point);
        else if (point < 0x20)
            byte = ' ';
        for (const auto& [known, code] : kBeyondLatin1)
            if (point == known) byte = code;
        bytes += static_cast<char>(byte);
    }
    return bytes;
}

double helvetica_width(const std::string& bytes, const Look& look) {
    double thousandths = 0;
    for (const char c : bytes) {
        const auto code = static_cast<unsigned char>(c);
        thousandths += code >= 0x20 && code < 0x7F ? kWidths[code - 0x20] : 556;
    }
    return thousandths / 1000 * look.size * (look.bold ? 1.06 : 1);  // bold letters are wider
}

std::string pdf_string(const std::string& bytes) {
    std::string text = "(";
    for (const char c : bytes) {
        const auto code = static_cast<unsigned char>(c);
        if (c == '(' || c == ')' || c == '\\')
            text += std::string("\\") + c;
        else if (code < 0x20 || code > 0x7E)
            text += fmt::format("\\{:03o}", code);
        else
            text += c;
    }
    return text + ")";
}

std::string pdf_colour(const std::string& hex, const char* operation) {
    const auto part = [&](std::size_t at) {
        return std::stoi(hex.substr(at, 2), nullptr, 16) / 255.0;
    };
    return fmt::format("{:.3f} {:.3f} {:.3f} {}\n", part(1), part(3), part(5), operation);
}

std::string pdf_path(const Shape& shape) {
    std::string path;
    for (const PathStep& step : shape.path)
        path += step.command == 'z' ? std::string("h\n")
                                    : fmt::format("{:.2f} {:.2f} {}\n", step.x, step.y,
                                                  step.command == 'M' ? 'm' : 'l');
    return path;
}

std::string pdf_circle(const Shape& shape) {
    const double x = shape.x, y = shape.y, r = shape.radius, a = kCircleArm * r;
    std::string path = fmt::format("{:.2f} {:.2f} m\n", x + r, y);
    const double to[4][6] = {{x + r, y + a, x + a, y + r, x, y + r},
                             {x - a, y + r, x - r, y + a, x - r, y},
                             {x - r, y - a, x - a, y - r, x, y - r},
                             {x + a, y - r, x + r, y - a, x + r, y}};
    for (const auto& c : to)
        path += fmt::format("{:.2f} {:.2f} {:.2f} {:.2f} {:.2f} {:.2f} c\n", c[0], c[1], c[2], c[3],
                            c[4], c[5]);
    return path + "h\n";
}

std::string pdf_text(const Shape& shape, const Look& look) {
    const std::string bytes = windows_1252(shape.text);
    const double share = shape.anchor == Anchor::middle ? 0.5
                         : shape.anchor == Anchor::end  ? 1.0
                                                        : 0.0;
    const double back = share * helvetica_width(bytes, look);
    const std::string matrix = shape.upright
                                   ? fmt::format("0 -1 -1 0 {:.2f} {:.2f}", shape.x, shape.y + back)
                                   : fmt::format("1 0 0 -1 {:.2f} {:.2f}", shape.x - back, shape.y);
    return fmt::format("{}BT /{} {} Tf {} Tm {} Tj ET\n", pdf_colour(look.fill, "rg"),
                       look.bold ? "F2" : "F1", look.size, matrix, pdf_string(bytes));
}

std::string pdf_shape(const Shape& shape) {
    const Look look = look_of(shape.style, shape.series);
    if (shape.kind == Shape::Kind::text) return pdf_text(shape, look);
    const bool fill = !look.fill.empty(), stroke = !look.stroke.empty();
    std::string text = fmt::format("/{} gs\n", look.opacity < 1 ? "G1" : "G0");
    if (fill) text += pdf_colour(look.fill, "rg");
    if (stroke) text += pdf_colour(look.stroke, "RG") + fmt::format("{} w\n", look.width);
    text += shape.kind == Shape::Kind::circle ? pdf_circle(shape) : pdf_path(shape);
    return text + (fill && stroke ? "B\n" : fill ? "f\n" : "S\n");
}

}  // namespace

std::string pdf_file(const Drawing& drawing) {
    const double width = kPoints * drawing.width, height = kPoints * drawing.height;
    std::string content = fmt::format("{0} 0 0 -{0} 0 {1:.3f} cm\n1 j\n", kPoints, height);
    for (const Shape& shape : drawing.shapes) content += pdf_shape(shape);
    const auto font = [](const char* name) {
        return fmt::format("<</Type/Font/Subtype/Type1/BaseFont/{}/Encoding/WinAnsiEncoding>>",
                           name);
    };
    const std::vector<std::string> objects{
        "<</Type/Catalog/Pages 2 0 R>>",
        "<</Type/Pages/Kids[3 0 R]/Count 1>>",
        fmt::format("<</Type/Page/Parent 2 0 R/MediaBox[0 0 {:.3f} {:.3f}]/Contents 4 0 R"
                    "/Resources<</Font<</F1 5 0 R/F2 6 0 R>>/ExtGState<</G0<</ca 1>>/G1<</ca {}>>"
                    ">>>>>>",
                    width, height, look_of("band", 0).opacity),
        fmt::format("<</Length {}>>\nstream\n{}endstream", content.size(), content),
        font("Helvetica"),
        font("Helvetica-Bold"),
        fmt::format("<</Title{}/Producer(darb)>>", pdf_string(windows_1252(drawing.title)))};
    std::string file = "%PDF-1.4\n%\xE2\xE3\xCF\xD3\n";
    std::string table = fmt::format("xref\n0 {}\n0000000000 65535 f \n", objects.size() + 1);
    for (std::size_t i = 0; i < objects.size(); ++i) {
        table += fmt::format("{:010} 00000 n \n", file.size());
        file += fmt::format("{} 0 obj\n{}\nendobj\n", i + 1, objects[i]);
    }
    const std::size_t at = file.size();
    return file + table +
           fmt::format("trailer\n<</Size {}/Root 1 0 R/Info 7 0 R>>\nstartxref\n{}\n%%EOF\n",
                       objects.size() + 1, at);
}

}  // namespace darb
