// SPDX-License-Identifier: MIT
#include "engine/report/table.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>

#include "engine/report/drawing.h"
#include "engine/report/html.h"

namespace darb {

TableCell TableCell::between(double low, double high) {
    TableCell cell;
    cell.span = {low, high};
    return cell;
}

namespace {

constexpr std::size_t kLongest = 40;  // rows of a table that fits a page

bool has_value(const TableCell& cell) {
    return cell.value && std::isfinite(*cell.value);
}

std::string header_of(const TableColumn& column) {
    return column.unit.empty() ? column.name : column.name + " (" + column.unit + ")";
}

bool is_text(const TableColumn& column) {
    return column.kind == TableColumn::Kind::name || column.kind == TableColumn::Kind::prose;
}

std::string number_text(double v, const TableColumn& column) {
    if (!std::isfinite(v)) return "-";
    return column.kind == TableColumn::Kind::scientific ? fmt::format("{:.{}e}", v, column.decimals)
                                                        : format_number(v, column.decimals);
}

/// A value that takes part in a contest, as it is printed and so that more is better.
struct Contender {
    std::size_t row = 0, column = 0;
    double printed = 0;
    double low = 0, high = 0;
    bool several = false;
};

Contender contender_of(const Table& table, std::size_t row, std::size_t column) {
    const TableColumn& c = table.columns[column];
    const TableCell& cell = table.rows[row].cells[column];
    const double sign = c.better == Better::more ? 1 : -1;
    const double unit = std::pow(10, c.decimals);
    const auto [low, high] = cell.span.value_or(std::pair{*cell.value, *cell.value});
    const double printed =
        c.kind == TableColumn::Kind::scientific ? *cell.value : std::round(*cell.value * unit);
    return {row, column, sign * printed, low, high, cell.runs > 1};
}

void mark(const std::vector<Contender>& all, std::vector<std::vector<Mark>>& marks) {
    const bool several =
        std::any_of(all.begin(), all.end(), [](const Contender& c) { return c.several; });
    for (const Contender& one : all) {
        int better = 0, worse = 0;
        bool overlaps = false;
        for (const Contender& other : all) {
            if (&one == &other) continue;
            better += other.printed > one.printed ? 1 : 0;
            worse += other.printed < one.printed ? 1 : 0;
            overlaps |= one.low <= other.high && other.low <= one.high;
        }
        Mark& its = marks[one.row][one.column];
        if (better == 0 && worse > 0 && !(several && overlaps)) its = Mark::best;
        if (better == 1 && worse > 0 && !several) its = Mark::second;
    }
}

std::string marked(const std::string& text, Mark mark) {
    if (mark == Mark::best) return "<b>" + text + "</b>";
    if (mark == Mark::second) return "<u>" + text + "</u>";
    return text;
}

}  // namespace

std::vector<std::vector<Mark>> marks_of(const Table& table) {
    std::vector<std::vector<Mark>> marks(table.rows.size(),
                                         std::vector<Mark>(table.columns.size(), Mark::none));
    const bool down = table.contest == Contest::down;
    if (table.contest == Contest::none) return marks;
    const std::size_t contests = down ? table.columns.size() : table.rows.size();
    for (std::size_t i = 0; i < contests; ++i) {
        std::vector<Contender> all;
        for (std::size_t j = 0; j < (down ? table.rows.size() : table.columns.size()); ++j) {
            const std::size_t row = down ? j : i, column = down ? i : j;
            if (table.rows[row].ranked && table.columns[column].better != Better::neither &&
                has_value(table.rows[row].cells[column]))
                all.push_back(contender_of(table, row, column));
        }
        mark(all, marks);
    }
    return marks;
}

Table without_empty_columns(const Table& table) {
    Table kept = table;
    for (std::size_t c = table.columns.size(); c-- > 0;) {
        if (std::any_of(table.rows.begin(), table.rows.end(),
                        [&](const TableRow& row) { return !row.cells[c].empty(); }))
            continue;
        kept.columns.erase(kept.columns.begin() + static_cast<std::ptrdiff_t>(c));
        for (TableRow& row : kept.rows)
            row.cells.erase(row.cells.begin() + static_cast<std::ptrdiff_t>(c));
    }
    return kept;
}

std::string cell_text(const TableCell& cell, const TableColumn& column) {
    const auto span = [&] {
        return number_text(cell.span->first, column) + " to " +
               number_text(cell.span->second, column);
    };
    if (!has_value(cell)) return cell.span ? span() : cell.text.empty() ? "-" : cell.text;
    const std::string value = number_text(*cell.value, column);
    if (cell.deviation) return value + " \u00b1 " + number_text(*cell.deviation, column);
    return cell.span ? value + " (" + span() + ")" : value;
}

std::string html_table(const Table& whole, int heading_level) {
    const Table table = without_empty_columns(whole);
    const auto marks = marks_of(table);
    std::string html;
    if (heading_level > 0 && !table.title.empty())
        html += fmt::format("<h{0}>{1}</h{0}>", heading_level, html_escape(table.title));
    if (!table.caption.empty()) html += "<p class='soft'>" + html_escape(table.caption) + "</p>";
    html += "<div class='wide'><table><tr>";
    const auto name_class = [&](std::size_t c, bool head) {
        if (table.columns[c].kind == TableColumn::Kind::prose)
            return head ? " class='left'" : " class='text'";
        return c > 0 && is_text(table.columns[c]) ? " class='left'" : "";
    };
    for (std::size_t c = 0; c < table.columns.size(); ++c)
        html += fmt::format("<th{}>{}</th>", name_class(c, true),
                            html_escape(header_of(table.columns[c])));
    html += "</tr>\n";
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
        const TableRow& row = table.rows[r];
        html += row.strong ? "<tr class='mark'>" : "<tr>";
        for (std::size_t c = 0; c < row.cells.size(); ++c) {
            const bool blank = row.cells[c].empty() && is_text(table.columns[c]);
            const std::string text =
                blank ? "" : html_escape(cell_text(row.cells[c], table.columns[c]));
            html += fmt::format("<td{}>{}</td>", name_class(c, false), marked(text, marks[r][c]));
        }
        html += "</tr>\n";
    }
    return html + "</table></div>\n";
}

// CSV.

namespace {

std::string csv_field(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
    return quoted + "\"";
}

std::string csv_number(const std::optional<double>& v) {
    return v && std::isfinite(*v) ? fmt::format("{}", *v) : "";
}

/// Which columns of the file a column of the table becomes.
struct CsvColumns {
    bool value = false, deviation = false, span = false, runs = false;
};

CsvColumns csv_columns(const Table& table, std::size_t column) {
    CsvColumns has;
    for (const TableRow& row : table.rows) {
        const TableCell& cell = row.cells[column];
        has.value |= has_value(cell) || !cell.text.empty();
        has.deviation |= cell.deviation.has_value();
        has.span |= cell.span.has_value();
        has.runs |= cell.runs > 1;
    }
    return has;
}

}  // namespace

std::string csv_table(const Table& whole) {
    const Table table = without_empty_columns(whole);
    std::vector<CsvColumns> has;
    std::string head, body;
    bool first_head = true;
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
        has.push_back(csv_columns(table, c));
        const auto add = [&](bool there, const char* what) {
            if (!there) return;
            head += (first_head ? "" : ",") + csv_field(header_of(table.columns[c]) + what);
            first_head = false;
        };
        add(has[c].value, "");
        add(has[c].deviation, ", standard deviation");
        add(has[c].span, ", low");
        add(has[c].span, ", high");
        add(has[c].runs, ", runs");
    }
    for (const TableRow& row : table.rows) {
        std::string line;
        bool first = true;
        const auto add = [&](bool there, const std::string& field) {
            if (!there) return;
            line += (first ? "" : ",") + field;
            first = false;
        };
        for (std::size_t c = 0; c < row.cells.size(); ++c) {
            const TableCell& cell = row.cells[c];
            const auto end = [&](double std::pair<double, double>::*which) {
                return cell.span ? csv_number((*cell.span).*which) : std::string();
            };
            add(has[c].value, has_value(cell) ? csv_number(cell.value) : csv_field(cell.text));
            add(has[c].deviation, csv_number(cell.deviation));
            add(has[c].span, end(&std::pair<double, double>::first));
            add(has[c].span, end(&std::pair<double, double>::second));
            add(has[c].runs, has_value(cell) ? fmt::format("{}", cell.runs) : "");
        }
        body += line + "\r\n";
    }
    return head + "\r\n" + body;
}

// LaTeX.

namespace {

// What stands for a character that LaTeX would take for markup, or that a font may lack.
constexpr std::pair<char32_t, std::string_view> kLatex[] = {
    {'\\', "\\textbackslash{}"},
    {'~', "\\textasciitilde{}"},
    {'^', "\\textasciicircum{}"},
    {'<', "\\textless{}"},
    {'>', "\\textgreater{}"},
    {'|', "\\textbar{}"},
    {'`', "\\textasciigrave{}"},
    {'"', "''"},
    {'-', "{-}"},  // two of them would become a dash
    {'[', "{[}"},  // after \\ it would begin an option
    {'*', "{*}"},  // as would this
    {'{', "\\{"},
    {'}', "\\}"},
    {'$', "\\$"},
    {'&', "\\&"},
    {'#', "\\#"},
    {'%', "\\%"},
    {'_', "\\_"},
    {0xB0, "$^\\circ$"},
    {0xB1, "$\\pm$"},
    {0xB2, "$^2$"},
    {0xB3, "$^3$"},
    {0xB5, "$\\mu$"},
    {0xB7, "$\\cdot$"},
    {0xD7, "$\\times$"}};

// Letters of Latin-1 and Latin Extended-A that every LaTeX of today sets.
bool is_latin_letter(char32_t point) {
    return point >= 0xC0 && point <= 0x17E && point != 0xF7 && point != 0x13F && point != 0x140 &&
           point != 0x149;
}

}  // namespace

std::string latex_escape(std::string_view text) {
    std::string out;
    for (const char32_t point : code_points(text)) {
        const auto known = std::find_if(std::begin(kLatex), std::end(kLatex),
                                        [&](const auto& pair) { return pair.first == point; });
        if (known != std::end(kLatex))
            out += known->second;
        else if (point < 0x20 || (point >= 0x7F && point <= 0xA0))
            out += ' ';
        else if (point < 0x80)
            out += static_cast<char>(point);
        else if (is_latin_letter(point))
            out += {static_cast<char>(0xC0 | point >> 6), static_cast<char>(0x80 | (point & 0x3F))};
        else
            out += fmt::format("{{[}}U+{:04X}]", static_cast<std::uint32_t>(point));
    }
    return out;
}

namespace {

std::string latex_number(double v, const TableColumn& column) {
    if (!std::isfinite(v)) return "--";
    if (column.kind == TableColumn::Kind::scientific) {
        const std::string text = fmt::format("{:.{}e}", v, column.decimals);
        const std::size_t e = text.find('e');
        return fmt::format("${}\\cdot 10^{{{}}}$", text.substr(0, e),
                           std::stoi(text.substr(e + 1)));
    }
    std::string text;
    for (const char c : format_number(v, column.decimals))
        text += c == ',' ? std::string("\\,") : c == '-' ? "$-$" : std::string(1, c);
    return text;
}

bool has_spread(const Table& table, std::size_t column) {
    return std::any_of(table.rows.begin(), table.rows.end(), [&](const TableRow& row) {
        return row.cells[column].deviation ||
               (row.cells[column].span && has_value(row.cells[column]));
    });
}

/// The cell; where the column has a spread, value and spread apart, so that values align.
std::string latex_cell(const TableCell& cell, const TableColumn& column, Mark mark, bool spread) {
    std::string value, beside;
    const auto span = [&] {
        return latex_number(cell.span->first, column) + " to " +
               latex_number(cell.span->second, column);
    };
    if (has_value(cell)) {
        value = latex_number(*cell.value, column);
        if (cell.deviation)
            beside = "\\,{\\scriptsize$\\pm$\\,}{\\scriptsize " +
                     latex_number(*cell.deviation, column) + "}";
        else if (cell.span)
            beside = " {\\scriptsize(" + span() + ")}";
    } else {
        value = cell.span                               ? span()
                : cell.text.empty() || cell.text == "-" ? (is_text(column) ? "" : "--")
                                                        : latex_escape(cell.text);
    }
    if (mark == Mark::best) value = "\\textbf{" + value + "}";
    if (mark == Mark::second) value = "\\underline{" + value + "}";
    return spread ? value + " & " + beside : value;
}

std::string latex_head(const Table& table, std::size_t column, bool spread) {
    const TableColumn& c = table.columns[column];
    std::string name = latex_escape(header_of(c));
    if (table.contest != Contest::none && c.better == Better::more) name += " $\\uparrow$";
    if (table.contest != Contest::none && c.better == Better::less) name += " $\\downarrow$";
    return spread ? "\\multicolumn{2}{c}{" + name + "}" : name;
}

}  // namespace

std::string latex_table(const Table& whole) {
    const Table table = without_empty_columns(whole);
    const auto marks = marks_of(table);
    std::string columns, head, body;
    std::vector<bool> spread;
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
        spread.push_back(has_spread(table, c));
        columns += is_text(table.columns[c]) ? "l" : spread[c] ? "r@{}l" : "r";
        head += (c == 0 ? "" : " & ") + latex_head(table, c, spread[c]);
    }
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
        if (r > 0 && table.rows[r - 1].ranked && !table.rows[r].ranked) body += "    \\midrule\n";
        std::string line;
        for (std::size_t c = 0; c < table.columns.size(); ++c)
            line += (c == 0 ? "" : " & ") +
                    latex_cell(table.rows[r].cells[c], table.columns[c], marks[r][c], spread[c]);
        body += "    " + line + " \\\\\n";
    }
    std::string caption = latex_escape(table.title);
    if (!table.caption.empty())
        caption += (caption.empty() ? "" : ". ") + latex_escape(table.caption);
    const std::string label = fmt::format("\\caption{{{}}}\\label{{tab:{}}}", caption, table.name);
    const bool is_long = table.rows.size() > kLongest;
    const std::string note =
        fmt::format("% \\usepackage{{booktabs{}}}\n", is_long ? ",longtable" : "");
    if (is_long)
        return note + fmt::format(
                          "\\begin{{longtable}}{{@{{}}{}@{{}}}}\n  {}\\\\\n    \\toprule\n    {} "
                          "\\\\\n    \\midrule\n  \\endhead\n{}    \\bottomrule\n"
                          "\\end{{longtable}}\n",
                          columns, label, head, body);
    return note + fmt::format(
                      "\\begin{{table}}[tbp]\n  \\centering\n  {}\n"
                      "  \\begin{{tabular}}{{@{{}}{}@{{}}}}\n    \\toprule\n    {} \\\\\n"
                      "    \\midrule\n{}    \\bottomrule\n  \\end{{tabular}}\n"
                      "\\end{{table}}\n",
                      label, columns, head, body);
}

// Text.

std::string text_table(const Table& whole) {
    const Table table = without_empty_columns(whole);
    const auto marks = marks_of(table);
    std::vector<std::vector<std::string>> lines(1);
    for (const TableColumn& column : table.columns)
        lines[0].push_back(column.unit.empty() ? column.name : column.name + " " + column.unit);
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
        std::vector<std::string>& line = lines.emplace_back();
        for (std::size_t c = 0; c < table.columns.size(); ++c) {
            const TableCell& cell = table.rows[r].cells[c];
            const bool blank = cell.empty() && is_text(table.columns[c]);
            std::string text = blank ? "" : cell_text(cell, table.columns[c]);
            if (const auto at = text.find("\u00b1"); at != std::string::npos && has_value(cell))
                text.replace(at, 2, "+-");
            line.push_back(text + (marks[r][c] == Mark::best ? "*" : ""));
        }
    }
    std::string text;
    for (const std::vector<std::string>& line : lines) {
        std::string shown;
        for (std::size_t c = 0; c < table.columns.size(); ++c) {
            std::size_t width = 0;
            for (const auto& other : lines) width = std::max(width, code_points(other[c]).size());
            const std::string room(width - code_points(line[c]).size(), ' ');
            const bool left = c == 0 || is_text(table.columns[c]);
            shown += (c == 0 ? "" : "  ") + (left ? line[c] + room : room + line[c]);
        }
        shown.erase(shown.find_last_not_of(' ') + 1);
        text += shown + "\n";
    }
    return text;
}

std::string file_name(std::string_view text) {
    std::string name;
    for (const char c : text) {
        const bool letter = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
        const bool capital = c >= 'A' && c <= 'Z';
        if (letter || capital)
            name += capital ? static_cast<char>(c - 'A' + 'a') : c;
        else if (c != ',' && !name.empty() && name.back() != '-')
            name += '-';
    }
    while (!name.empty() && name.back() == '-') name.pop_back();
    constexpr std::size_t kMost = 80;
    return name.empty() ? "part" : name.substr(0, kMost);
}

}  // namespace darb
