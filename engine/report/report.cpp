// SPDX-License-Identifier: MIT
#include "engine/report/report.h"

#include <fmt/format.h>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/report/html.h"

namespace darb {

namespace {

Drawing drawn(const AnyPlot& plot, DrawnFor place) {
    if (const Drawing* drawing = std::get_if<Drawing>(&plot)) return *drawing;
    if (const Plot* lines = std::get_if<Plot>(&plot)) return draw_plot(*lines, place);
    if (const StackPlot* stack = std::get_if<StackPlot>(&plot)) return draw_plot(*stack, place);
    return draw_plot(std::get<BarPlot>(plot), place);
}

std::string title_of(const AnyPlot& plot) {
    return std::visit([](const auto& one) { return one.title; }, plot);
}

constexpr const char* kDocument = R"(% pdflatex report.tex
\documentclass{{article}}
\usepackage[a4paper,landscape,margin=15mm]{{geometry}}
\usepackage{{booktabs,longtable,graphicx}}
\begin{{document}}
\noindent\textbf{{{}}}. {}
\scriptsize\raggedright
{}\end{{document}}
)";

}  // namespace

Report::Report(std::string title, std::string subtitle)
    : title_(std::move(title)), subtitle_(std::move(subtitle)), names_{"report"} {}

std::string Report::own_name(const std::string& wanted) {
    const std::string base = file_name(wanted);
    std::string name = base;
    for (int i = 2; !names_.insert(name).second; ++i) name = fmt::format("{}-{}", base, i);
    return name;
}

void Report::heading(const std::string& text, int level) {
    body_ += fmt::format("<h{0}>{1}</h{0}>\n", level, html_escape(text));
}

void Report::table(Table table, int heading_level) {
    if (table.rows.empty()) return;
    table.name = own_name(table.name.empty() ? table.title : table.name);
    body_ += html_table(table, heading_level);
    tables_.push_back(std::move(table));
}

void Report::plots(std::vector<Figure> figures, const std::vector<std::string>& legend) {
    std::string html;
    for (Figure& figure : figures) {
        const Drawing drawing = drawn(figure.plot, DrawnFor::page);
        if (drawing.empty()) continue;
        html += svg_inline(drawing);
        figure.name = own_name(figure.name.empty() ? title_of(figure.plot) : figure.name);
        figures_.push_back(std::move(figure));
    }
    if (html.empty()) return;
    if (!legend.empty()) body_ += html_legend(legend);
    body_ += "<div class='plots'>" + html + "</div>\n";
}

void Report::picture(const std::string& name, std::vector<std::byte> png) {
    pictures_.push_back({own_name(name) + ".png",
                         std::string(reinterpret_cast<const char*>(png.data()), png.size())});
}

std::string Report::page() const {
    return html_page(title_, subtitle_, body_);
}

std::vector<ReportFile> Report::files() const {
    std::vector<ReportFile> files;
    std::string shown;
    for (const Table& table : tables_) {
        files.push_back({table.name + ".csv", csv_table(table)});
        files.push_back({table.name + ".tex", latex_table(table)});
        shown += "\\input{" + table.name + "}\n";
    }
    if (!tables_.empty()) shown += "\\clearpage\n";
    for (const Figure& figure : figures_) {
        const Drawing drawing = drawn(figure.plot, DrawnFor::file);
        files.push_back({figure.name + ".svg", svg_file(drawing)});
        files.push_back({figure.name + ".pdf", pdf_file(drawing)});
        shown += "\\includegraphics[width=0.45\\linewidth]{" + figure.name + "}\n";
    }
    for (const ReportFile& picture : pictures_) {
        files.push_back(picture);
        shown += "\\includegraphics[width=0.3\\linewidth]{" + picture.name + "}\n";
    }
    files.push_back({"report.tex",
                     fmt::format(kDocument, latex_escape(title_), latex_escape(subtitle_), shown)});
    return files;
}

std::vector<std::filesystem::path> write_paper_files(const std::filesystem::path& folder,
                                                     const Report& report) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error || !std::filesystem::is_directory(folder))
        throw Error(folder.string(), "is no folder, and cannot be made one",
                    "Name another one with --paper.");
    std::vector<std::filesystem::path> paths;
    for (const ReportFile& file : report.files()) {
        paths.push_back(folder / file.name);
        write_file_atomic(paths.back(), std::string_view(file.content));
    }
    return paths;
}

}  // namespace darb
