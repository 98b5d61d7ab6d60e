// SPDX-License-Identifier: MIT
// A report: headings, tables, plots and pictures in order. It becomes one page, and also files for
// use in a paper: each table as CSV and LaTeX, each plot as SVG and PDF, each picture as PNG.
#pragma once

#include <cstddef>
#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "engine/report/drawing.h"
#include "engine/report/svg_plot.h"
#include "engine/report/table.h"

namespace darb {

using AnyPlot = std::variant<Plot, StackPlot, BarPlot, Drawing>;

struct Figure {
    std::string name;  // of its files; empty: made from the plot's title
    AnyPlot plot;
};

struct ReportFile {
    std::string name;  // in the folder
    std::string content;
};

class Report {
  public:
    Report(std::string title, std::string subtitle);

    /// Text for the page alone.
    void heading(const std::string& text, int level = 2);
    void html(const std::string& fragment) { body_ += fragment; }
    /// heading_level: the level of the table's title on the page; 0: no title.
    void table(Table table, int heading_level = 3);
    /// Plots side by side. legend: the names of the series that the plots share. The page shows
    /// them once, for plots with legend_beside.
    void plots(std::vector<Figure> figures, const std::vector<std::string>& legend = {});
    /// A picture that only files() has, not the page. png: the content of a whole PNG file.
    void picture(const std::string& name, std::vector<std::byte> png);

    /// The whole document.
    std::string page() const;
    /// Every file of the report, with names that differ also where case does not count.
    /// report.tex shows all tables, plots and pictures.
    std::vector<ReportFile> files() const;

  private:
    std::string own_name(const std::string& wanted);

    std::string title_, subtitle_, body_;
    std::set<std::string> names_;
    std::vector<Table> tables_;
    std::vector<Figure> figures_;
    std::vector<ReportFile> pictures_;
};

/// Makes the folder and writes every file of the report; returns their paths. Throws Error.
std::vector<std::filesystem::path> write_paper_files(const std::filesystem::path& folder,
                                                     const Report& report);

}  // namespace darb
