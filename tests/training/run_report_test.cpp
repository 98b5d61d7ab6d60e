// SPDX-License-Identifier: MIT
// engine/report, trainer/run_report: the page is well-formed, whole in itself, and stands strange
// input.
#include "trainer/run/run_report.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/rng.h"
#include "engine/data/image_io.h"
#include "engine/report/html.h"
#include "engine/report/svg_plot.h"
#include "tests/support/chromium.h"

namespace darb {
namespace {

std::filesystem::path scratch(const std::string& name) {
    return std::filesystem::path(testing::TempDir()) / name;
}

ReportData example() {
    ReportData data;
    data.title = "still life <1> & \"friends\"";
    data.device = "llvmpipe, Mesa 22.3.6";
    for (int i = 50; i <= 3000; i += 50) {
        const double t = 0.02 * i;
        data.samples.push_back({i,
                                t,
                                0.3 * std::exp(-i / 500.0) + 0.02 + 0.002 * std::sin(i),
                                30 - 15 * std::exp(-i / 700.0) + 0.4 * std::sin(0.3 * i),
                                static_cast<std::uint32_t>(4000 + 3 * i),
                                {1.2, 6.5 + std::sin(i), 2.0}});
    }
    for (int i = 500; i <= 3000; i += 500)
        data.evaluations.push_back({i, 0.02 * i, 28.5 - 13 * std::exp(-i / 700.0),
                                    0.95 - 0.4 * std::exp(-i / 700.0),
                                    static_cast<std::uint32_t>(4000 + 3 * i)});
    data.passes = {{"project", 1.21, {}}, {"blend", 6.5, 0.12}, {"loss", 2.0, 0.4}};
    data.settings = {{"kernel", "gaussian"}, {"--odd", "'<&>'"}};
    data.notes = {"2 iterations were done again: their intersections did not fit."};
    ImageU8 picture(60, 15, 3);
    for (int y = 0; y < 15; ++y)
        for (int x = 0; x < 60; ++x) picture.at(x, y, 1) = static_cast<std::uint8_t>(4 * x);
    write_png(scratch("report_picture.png"), picture);
    data.pictures = {{"view_03.png", scratch("report_picture.png"), 28.31, 0.93}};
    return data;
}

// Every element is closed in order; attributes are quoted. Returns the first fault, or "".
std::string first_fault(const std::string& html) {
    const std::set<std::string> void_elements = {"meta", "img", "!DOCTYPE"};
    std::vector<std::string> open;
    for (std::size_t at = html.find('<'); at != std::string::npos; at = html.find('<', at)) {
        std::size_t end = at + 1;
        for (char quote = 0; end < html.size() && (quote != 0 || html[end] != '>'); ++end) {
            if (quote != 0 && html[end] == quote)
                quote = 0;
            else if (quote == 0 && (html[end] == '\'' || html[end] == '"'))
                quote = html[end];
        }
        if (end >= html.size()) return "tag without end at " + std::to_string(at);
        const std::string tag = html.substr(at + 1, end - at - 1);
        const std::string name = tag.substr(0, tag.find_first_of(" /", 1));
        if (tag[0] == '/') {
            if (open.empty() || open.back() != tag.substr(1)) return "unexpected <" + tag + ">";
            open.pop_back();
        } else if (tag.back() != '/' && !void_elements.contains(name)) {
            open.push_back(name);
        }
        at = end;
    }
    return open.empty() ? "" : "open: " + open.back();
}

TEST(Report_wellFormedCheck, finds_planted_faults) {
    EXPECT_EQ(first_fault("<p class='a>b'>x</p><img alt=''><br/>"), "");
    EXPECT_NE(first_fault("<p><b></p></b>"), "");
    EXPECT_NE(first_fault("<p>"), "");
}

TEST(Report_example, is_well_formed_and_without_outside_resources) {
    const std::string html = report_html(example());
    EXPECT_EQ(first_fault(html), "");
    for (const char* outside : {"http:", "https:", "url(h", "<script", "<link", "@import"})
        EXPECT_EQ(html.find(outside), std::string::npos) << outside;
    for (const char* part : {"still life &lt;1&gt; &amp; &quot;friends&quot;", "PSNR (dB)",
                             "iterations", "training time (s)", "view_03.png", "28.31 dB",
                             "data:image/jpeg;base64,/9j/", "of the roofline", "type='range'",
                             "Time an iteration, by pass", "&#39;&lt;&amp;&gt;&#39;", "13,000"})
        EXPECT_NE(html.find(part), std::string::npos) << part;
    EXPECT_EQ(html.find("nan"), std::string::npos);
    EXPECT_EQ(html.find("inf"), std::string::npos);
}

TEST(Report_inChromium, draws_every_plot_and_picture) {
    if (test::chromium().empty()) GTEST_SKIP() << "no Chromium to open the page with";
    const test::OpenedPage page = test::open_page(report_html(example()), testing::TempDir());
    EXPECT_EQ(page.console, "");
    EXPECT_EQ(page.plots, 7);
    EXPECT_EQ(page.drawn, 7);
    EXPECT_EQ(page.pictures, 3);
    EXPECT_EQ(page.cut, 0) << page.touching;
    EXPECT_EQ(page.overlaps, 0) << page.touching;
}

TEST(Report_largePictures, are_shown) {
    if (test::chromium().empty()) GTEST_SKIP() << "no Chromium to open the page with";
    ImageU8 noise(2400, 800, 3);  // 3 MB as a JPEG
    Pcg32 rng(4);
    for (std::uint8_t& value : noise.data) value = static_cast<std::uint8_t>(rng.below(256));
    write_png(scratch("report_noise.png"), noise);
    ReportData data;
    data.pictures = {{"noise", scratch("report_noise.png"), 5, 0}};
    const std::string html = report_html(data);
    EXPECT_GT(html.size(), size_t{1} << 21) << "meant to be beyond what a CSS variable holds";
    EXPECT_EQ(test::open_page(html, testing::TempDir()).pictures, 3);
}

TEST(Report_emptyRun, leaves_parts_out) {
    const std::string html = report_html({});
    EXPECT_EQ(first_fault(html), "");
    EXPECT_EQ(html.find("<svg"), std::string::npos);
    EXPECT_EQ(html.find("<h2"), std::string::npos);
}

TEST(Report_valuesNotFinite, leave_gaps) {
    ReportData data = example();
    data.samples[3].loss = std::numeric_limits<double>::quiet_NaN();
    data.samples[4].psnr_db = std::numeric_limits<double>::infinity();
    data.evaluations.back().psnr_db = std::numeric_limits<double>::infinity();
    const std::string html = report_html(data);
    EXPECT_EQ(first_fault(html), "");
    EXPECT_EQ(html.find("nan"), std::string::npos);
    EXPECT_EQ(html.find("inf"), std::string::npos);
}

TEST(Report_oneSample, has_axes) {
    ReportData data;
    data.samples = {{1, 0.1, 0.2, 20, 100}};
    const std::string html = report_html(data);
    EXPECT_EQ(first_fault(html), "");
    EXPECT_NE(html.find("<svg"), std::string::npos);
    data.evaluations = {{1, 0.1, 20, 0.86, 100}};
    EXPECT_EQ(report_html(data).find(">1.2<"), std::string::npos) << "no SSIM beyond 1";
}

TEST(SvgPlot_legend, stands_below_the_title_in_lines_that_fit) {
    Plot plot{"A title that takes most of the line", "x", "y", {}};
    for (const char* name : {"settings alone", "combinations of some settings", "the front of all"})
        plot.series.push_back({name, {{1, 1}, {2, 2}}});
    const std::string svg = svg_plot(plot);
    EXPECT_NE(svg.find("y='34.0'>settings alone<"), std::string::npos);
    EXPECT_NE(svg.find("y='49.0'>the front of all<"), std::string::npos) << "the second line";
}

TEST(SvgBars_longNames, are_cut_and_whole_under_the_pointer) {
    const std::string name(90, 'n');
    BarPlot plot{"bars", "ms", {"a"}, {{name, {1.0}}, {"b", {1.2}}, {"c", {1.1}}, {"far", {50.0}}}};
    const std::string svg = svg_bars(plot);
    EXPECT_EQ(svg.find(name + "<title>"), std::string::npos);
    EXPECT_NE(svg.find("n\u2026<title>" + name + "</title>"), std::string::npos);
    EXPECT_NE(svg.find("\u2192 50<"), std::string::npos) << "the bar that the axis cuts says so";
    EXPECT_EQ(svg.find("\u2192 1"), std::string::npos);
}

// Values of machines fast and slow, near one another and far apart: a page is made of what was
// measured.
TEST(Plots_anyRange, keep_their_texts_apart_and_inside) {
    if (test::chromium().empty()) GTEST_SKIP() << "no Chromium to open the page with";
    std::mt19937 random(1);
    const auto power = [&](double low, double high) {
        return std::pow(10.0, std::uniform_real_distribution<double>(low, high)(random));
    };
    std::string body;
    for (int i = 0; i < 150; ++i) {
        const double x = power(-5, 7), x_range = power(-2, 3);
        const double y = power(-9, 9), y_range = power(-2, 12);
        PlotSeries points{"a", {}};
        BarPlot bars{"bars", "ms", {"one", "two"}, {}};
        for (int k = 0; k < 12; ++k) {
            const double at = x * (1 + x_range * power(-3, 0));
            points.points.emplace_back(at, y * (1 + y_range * power(-3, 0)));
            bars.rows.push_back({fmt::format("row {}", k), {0.7 * at, 0.3 * at}});
        }
        for (const bool log : {false, true}) {
            Plot plot{"plot", "x", "y", {points}};
            plot.log_x = plot.log_y = log;
            plot.x_from_zero = i % 2 == 0;
            body += svg_plot(plot);
        }
        body += svg_bars(bars);
    }
    const test::OpenedPage page = test::open_page(html_page("plots", "", body), testing::TempDir());
    EXPECT_EQ(page.drawn, 450);
    EXPECT_EQ(page.cut, 0) << page.touching;
    EXPECT_EQ(page.overlaps, 0) << page.touching;
}

TEST(Report_missingPicture, is_an_error_with_its_name) {
    ReportData data;
    data.pictures = {{"a", scratch("no_such_picture.png"), 1, 1}};
    try {
        report_html(data);
        FAIL();
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("no_such_picture"), std::string::npos);
    }
}

TEST(Report_written, is_what_html_says) {
    const ReportData data = example();
    write_report(scratch("report.html"), data);
    EXPECT_EQ(read_text_file(scratch("report.html")), report_html(data));
}

TEST(Base64_lengths, match_known_texts) {
    const auto encode = [](std::string_view text) {
        return base64(std::as_bytes(std::span(text.data(), text.size())));
    };
    EXPECT_EQ(encode(""), "");
    EXPECT_EQ(encode("f"), "Zg==");
    EXPECT_EQ(encode("fo"), "Zm8=");
    EXPECT_EQ(encode("foo"), "Zm9v");
    EXPECT_EQ(encode("foob\xff"), "Zm9vYv8=");
}

TEST(FormatNumber_values, are_grouped) {
    EXPECT_EQ(format_number(0), "0");
    EXPECT_EQ(format_number(-1234567.891, 2), "-1,234,567.89");
    EXPECT_EQ(format_number(999), "999");
    EXPECT_EQ(format_number(1000), "1,000");
    EXPECT_EQ(format_number(std::numeric_limits<double>::infinity()), "-");
}

TEST(RoundTicks_ranges, are_few_and_inside) {
    for (const auto& [low, high] : {std::pair{0.0, 1.0},
                                    {0.0, 30000.0},
                                    {17.3, 28.9},
                                    {-4e-5, 3e-5},
                                    {0.0, 7.0},
                                    {99.0, 101.0}}) {
        const std::vector<double> ticks = round_ticks(low, high);
        EXPECT_GE(ticks.size(), 3u) << low << " to " << high;
        EXPECT_LE(ticks.size(), 8u) << low << " to " << high;
        EXPECT_GE(ticks.front(), low - 1e-9 * (high - low));
        EXPECT_LE(ticks.back(), high + 1e-9 * (high - low));
    }
}

}  // namespace
}  // namespace darb
