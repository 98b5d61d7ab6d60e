// SPDX-License-Identifier: MIT
// Tables and what is written from them: marks, and text from files that is never markup.
#include "engine/report/table.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/report/report.h"

namespace darb {
namespace {

constexpr Mark none = Mark::none, best = Mark::best, second = Mark::second;
using Marks = std::vector<Mark>;

Table one_column(const std::vector<TableCell>& cells, Better better, int decimals = 2) {
    Table table{"t",
                "Title",
                "",
                {{"method", "", Better::neither, 0, TableColumn::Kind::name},
                 {"PSNR", "dB", better, decimals}},
                {},
                Contest::down};
    for (const TableCell& cell : cells) table.rows.push_back({{"m", cell}});
    return table;
}

Marks marks_down(const Table& table) {
    Marks column;
    for (const auto& row : marks_of(table)) column.push_back(row[1]);
    return column;
}

TableCell over_runs(double mean, double low, double high) {
    TableCell cell(mean);
    cell.span = {low, high};
    cell.deviation = (high - low) / 2;
    cell.runs = 3;
    return cell;
}

TEST(TableMarks, Best_followsTheDirectionOfTheColumn) {
    const std::vector<TableCell> cells{1.0, 4.0, TableCell(), 3.0, 2.0};
    EXPECT_EQ(marks_down(one_column(cells, Better::more)), (Marks{none, best, none, second, none}));
    EXPECT_EQ(marks_down(one_column(cells, Better::less)), (Marks{best, none, none, none, second}));
    EXPECT_EQ(marks_down(one_column(cells, Better::neither)), Marks(5, none));
}

TEST(TableMarks, Second_isNeverTheWorst) {
    EXPECT_EQ(marks_down(one_column({2.0, 1.0}, Better::more)), (Marks{best, none}));
    EXPECT_EQ(marks_down(one_column({3.0, 1.0, 1.0}, Better::more)), (Marks{best, none, none}));
    EXPECT_EQ(marks_down(one_column({3.0, 2.0, 1.0}, Better::more)), (Marks{best, second, none}));
    EXPECT_EQ(marks_down(one_column({1.0}, Better::more)), Marks{none});
    EXPECT_EQ(marks_down(one_column({1.0, 1.0}, Better::more)), (Marks{none, none}));
}

TEST(TableMarks, ValuesThatPrintAlike_areAlike) {
    EXPECT_EQ(marks_down(one_column({27.112, 27.114, 20.0, 20.001, 19.0}, Better::more)),
              (Marks{best, best, none, none, none}));
    EXPECT_EQ(marks_down(one_column({27.112, 27.0, 26.999, 19.0}, Better::more)),
              (Marks{best, second, second, none}));
}

TEST(TableMarks, OverSeveralRuns_areOfWhatNoOtherOverlaps) {
    const TableCell far = over_runs(29.0, 28.8, 29.2), near = over_runs(28.9, 28.7, 29.1),
                    low = over_runs(27.0, 26.5, 27.5);
    EXPECT_EQ(marks_down(one_column({far, low, low}, Better::more)), (Marks{best, none, none}));
    EXPECT_EQ(marks_down(one_column({far, near, low}, Better::more)), (Marks{none, none, none}));
}

TEST(TableMarks, Across_areSoughtInEachRowWithoutTheUnranked) {
    Table table{"t",
                "",
                "",
                {{"set", "", Better::neither, 0, TableColumn::Kind::name},
                 {"a", "", Better::less, 1},
                 {"b", "", Better::less, 1}},
                {},
                Contest::across};
    table.rows = {{{"x", 1.0, 2.0}}, {{"y", 4.0, 3.0}}, {{"z", 9.0, 1.0}, false}};
    EXPECT_EQ(marks_of(table),
              (std::vector<Marks>{{none, best, none}, {none, none, best}, {none, none, none}}));
}

TEST(TableText, Cells_showValueSpreadAndSpan) {
    const TableColumn column{"PSNR", "dB"};
    EXPECT_EQ(cell_text(27.314, column), "27.31");
    EXPECT_EQ(cell_text(over_runs(21, 20, 22), column), "21.00 \u00b1 1.00");
    EXPECT_EQ(cell_text(TableCell::between(1, 1234.5), column), "1.00 to 1,234.50");
    EXPECT_EQ(cell_text(std::nan(""), column), "-");
    TableCell two(21.0);
    two.span = {20.0, 22.0};
    two.runs = 2;
    EXPECT_EQ(cell_text(two, column), "21.00 (20.00 to 22.00)");
    EXPECT_EQ(text_table(one_column({27.0, 28.0}, Better::more)),
              "method  PSNR dB\nm         27.00\nm        28.00*\n");
}

TEST(TableEmptyColumns, are_leftOutEverywhere) {
    Table table = one_column({TableCell(), TableCell()}, Better::more);
    for (const std::string& text :
         {html_table(table), csv_table(table), latex_table(table), text_table(table)})
        EXPECT_EQ(text.find("PSNR"), std::string::npos) << text;
    table.rows[1].cells[1] = TableCell(0.0);
    for (const std::string& text :
         {html_table(table), csv_table(table), latex_table(table), text_table(table)})
        EXPECT_NE(text.find("PSNR"), std::string::npos) << text;
}

TEST(TableHtml, TextOfFiles_isNoMarkup) {
    Table table = one_column({1.0, 2.0}, Better::more);
    table.rows[0].cells[0] = "<b>a & b</b>";
    const std::string html = html_table(table);
    EXPECT_NE(html.find("<td>&lt;b&gt;a &amp; b&lt;/b&gt;</td><td>1.00</td>"), std::string::npos)
        << html;
    EXPECT_NE(html.find("<h3>Title</h3>"), std::string::npos);
    EXPECT_NE(html.find("<b>2.00</b>"), std::string::npos);
}

TEST(TableCsv, Fields_areQuotedAndNumbersWhole) {
    Table table = one_column({1234567.25, over_runs(2, 1, 3)}, Better::more);
    table.rows[0].cells[0] = "a, \"b\"\nc";
    EXPECT_EQ(csv_table(table),
              "method,PSNR (dB),\"PSNR (dB), standard deviation\",\"PSNR (dB), low\",\"PSNR (dB), "
              "high\",\"PSNR (dB), runs\"\r\n\"a, \"\"b\"\"\nc\",1234567.25,,,,1\r\n"
              "m,2,1,1,3,3\r\n");
}

TEST(TableCsv, ColumnWithoutAName_keepsItsPlace) {
    Table table = one_column({1.0}, Better::more);
    table.columns[0].name.clear();
    EXPECT_EQ(csv_table(table), ",PSNR (dB)\r\nm,1\r\n");
}

TEST(TableLatex, Best_isBoldAndSecondUnderlined) {
    const std::string tex = latex_table(one_column({3.0, 2.0, -1.0}, Better::more));
    EXPECT_NE(tex.find("PSNR (dB) $\\uparrow$"), std::string::npos) << tex;
    EXPECT_NE(tex.find("m & \\textbf{3.00} \\\\"), std::string::npos) << tex;
    EXPECT_NE(tex.find("m & \\underline{2.00} \\\\"), std::string::npos) << tex;
    EXPECT_NE(tex.find("m & $-$1.00 \\\\"), std::string::npos) << tex;
    EXPECT_NE(tex.find("\\begin{tabular}{@{}lr@{}}"), std::string::npos) << tex;
    EXPECT_NE(latex_table(one_column({over_runs(2, 1, 3)}, Better::more)).find("{@{}lr@{}l@{}}"),
              std::string::npos)
        << "value and spread are columns of their own, so that both align";
}

TEST(TableLatex, ManyRows_makeALongtable) {
    EXPECT_EQ(latex_table(one_column(std::vector<TableCell>(40, 1.0), Better::more)).find("long"),
              std::string::npos);
    EXPECT_NE(latex_table(one_column(std::vector<TableCell>(41, 1.0), Better::more))
                  .find("\\begin{longtable}"),
              std::string::npos);
}

TEST(LatexEscape, EverySpecialCharacter_isText) {
    EXPECT_EQ(latex_escape("a_b 100% $5 #1 {x} A&B"), "a\\_b 100\\% \\$5 \\#1 \\{x\\} A\\&B");
    EXPECT_EQ(latex_escape("\\input{x}~^"),
              "\\textbackslash{}input\\{x\\}\\textasciitilde{}\\textasciicircum{}");
    EXPECT_EQ(latex_escape("[1] *"), "{[}1] {*}") << "after \\\\ they would be its arguments";
    EXPECT_EQ(latex_escape("caf\u00e9 \u00b1 \u4e2d\n\x01"), "caf\u00e9 $\\pm$ {[}U+4E2D]  ");
    EXPECT_EQ(latex_escape("\xff\xc3"), "{[}U+FFFD]{[}U+FFFD]") << "no UTF-8";
}

TEST(FileNames, are_plainAndNeverEmpty) {
    EXPECT_EQ(file_name("PSNR by data set, 7,000 (dB)"), "psnr-by-data-set-7000-db");
    EXPECT_EQ(file_name("../\u4e2d"), "part");
    EXPECT_EQ(file_name(""), "part");
}

TEST(ReportFiles, have_namesOfTheirOwnAndOneDocument) {
    Report report("A & B", "device");
    for (int i = 0; i < 2; ++i) report.table(one_column({1.0, 2.0}, Better::more));
    report.table({"empty", "Empty", "", {{"x"}}, {}});
    Plot plot{"T", "x", "y", {{"a", {{0, 1}, {1, 2}}}, {"b", {{0, 2}, {1, 1}}}}};
    plot.legend_beside = true;
    report.plots({{"", plot}, {"none", Plot{"none", "x", "y", {}}}}, {"a", "b"});
    std::set<std::string> names;
    for (const ReportFile& file : report.files()) {
        names.insert(file.name);
        if (file.name == "report.tex") {
            EXPECT_NE(file.content.find("A \\& B"), std::string::npos);
            EXPECT_NE(file.content.find("\\input{t-2}"), std::string::npos);
        }
        if (file.name == "t.svg") {
            ADD_FAILURE() << "the name is taken";
        }
        if (file.name == "t-3.svg") {
            EXPECT_NE(file.content.find(">b</text>"), std::string::npos)
                << "a file has its own legend";
        }
    }
    EXPECT_EQ(names, (std::set<std::string>{"t.csv", "t.tex", "t-2.csv", "t-2.tex", "t-3.svg",
                                            "t-3.pdf", "report.tex"}));
    EXPECT_EQ(report.page().find(">b</text>"), std::string::npos) << "the page has one beside it";
}

TEST(Drawings, Band_isDrawnBetweenItsEnds) {
    Plot plot{"T", "x", "y", {{"a", {{0, 1}, {1, 2}}}}};
    plot.series[0].band = {{0.5, 1.5}, {1.0, 3.0}};
    const std::string svg = svg_plot(plot);
    EXPECT_NE(svg.find("class='band s0'"), std::string::npos) << svg;
    plot.series[0].band.clear();
    EXPECT_EQ(svg_plot(plot).find("band"), std::string::npos);
}

TEST(Pdf, Offsets_areThoseOfTheObjectsAndTextIsEscaped) {
    Plot plot{"a (b) \\ \u00e9 \u4e2d", "x", "y", {{"", {{0, 1}, {1, 2}}}}};
    const std::string pdf = pdf_file(draw_plot(plot));
    EXPECT_NE(pdf.find("(a \\(b\\) \\\\ \\351 ?) Tj"), std::string::npos) << pdf;
    const std::size_t start = std::stoul(pdf.substr(pdf.find("startxref\n") + 10));
    EXPECT_EQ(pdf.substr(start, 7), "xref\n0 ");
    std::size_t at = pdf.find("0000000000 65535 f \n", start) + 20;
    for (int object = 1; object <= 7; ++object, at += 20)
        EXPECT_EQ(pdf.substr(std::stoul(pdf.substr(at, 10)), 6), std::to_string(object) + " 0 ob");
    const std::size_t begin = pdf.find("stream\n") + 7, end = pdf.find("endstream");
    EXPECT_NE(pdf.find("/Length " + std::to_string(end - begin) + ">>"), std::string::npos);
}

}  // namespace
}  // namespace darb
