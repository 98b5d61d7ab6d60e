// SPDX-License-Identifier: MIT
// A table as a value: columns with unit and direction, and rows of figures. HTML, CSV, LaTeX and
// text for a terminal are written from it, with the same marks.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace darb {

/// Which figures of a column are better; those of `neither` are never marked.
enum class Better { neither, more, less };

struct TableColumn {
    std::string name;
    std::string unit = {};  // may be empty
    Better better = Better::neither;
    int decimals = 2;
    enum class Kind { number, scientific, name, prose } kind = Kind::number;
};

struct TableCell {
    std::string text;                               // shown where there is no value
    std::optional<double> value;                    // not finite counts as none
    std::optional<double> deviation;                // standard deviation over the runs
    std::optional<std::pair<double, double>> span;  // lowest and highest, or quartiles
    int runs = 1;

    TableCell() = default;
    TableCell(std::string shown) : text(std::move(shown)) {}
    TableCell(const char* shown) : text(shown) {}
    TableCell(double number) : value(number) {}
    TableCell(std::optional<double> number) : value(number) {}
    /// "1.2 to 3.4", without a value of its own.
    static TableCell between(double low, double high);

    bool empty() const { return text.empty() && !value && !span; }
};

struct TableRow {
    std::vector<TableCell> cells;  // one for each column
    bool ranked = true;            // false: takes no part in the contest, such as the paper's row
    bool strong = false;           // a row that the page emphasises
};

/// Where the best value is sought: nowhere; down each column, among the rows; across each row,
/// among the columns.
enum class Contest { none, down, across };

struct Table {
    std::string name;     // of its files; see file_name()
    std::string title;    // plain text
    std::string caption;  // sentences, plain text; may be empty
    std::vector<TableColumn> columns;
    std::vector<TableRow> rows;
    Contest contest = Contest::none;
};

enum class Mark { none, best, second };

/// [row][column]. best: no value is better. second: of three or more, exactly one is better and at
/// least one is worse. Values are compared as they are printed, so that those which look equal are
/// marked alike; if all are equal, none is marked. Where a value has a span of several
/// runs, the best is marked only if no other span overlaps its own, and nothing is second.
std::vector<std::vector<Mark>> marks_of(const Table& table);

/// The table without columns that are empty in every row.
Table without_empty_columns(const Table& table);

/// "27.31", "27.31 ± 0.05", "27.31 (27.10 to 27.44)", "27.10 to 27.44", the text, or "-".
std::string cell_text(const TableCell& cell, const TableColumn& column);

// All writers leave empty columns out.

/// A table element with its title as a heading of that level (0: none) and its caption.
std::string html_table(const Table& table, int heading_level = 3);

/// RFC 4180, UTF-8: a line of names with units, then the rows. Numbers have all their digits and no
/// separators of thousands. Deviations, the two ends of spans, and numbers of runs have columns of
/// their own.
std::string csv_table(const Table& table);

/// A table environment for the package booktabs, or a longtable where it would not fit a page. The
/// best is bold, the second best underlined, and arrows tell which direction is better. Text is
/// escaped.
std::string latex_table(const Table& table);

/// Aligned columns, with a star where a value is the best.
std::string text_table(const Table& table);

/// Text as LaTeX shows it: special characters escaped, control characters as spaces, and letters
/// beyond Latin Extended-A, which pdflatex may lack, as [U+4E2D].
std::string latex_escape(std::string_view text);

/// The text as part of a file's name, in lower-case letters, digits and -; never empty.
std::string file_name(std::string_view text);

}  // namespace darb
