// SPDX-License-Identifier: MIT
#include "tools/cost/cost_report.h"

#include <fmt/format.h>
#include <algorithm>
#include <utility>

#include "engine/report/html.h"

namespace darb {

namespace {

using Json = nlohmann::json;

Json error_json(const PictureError& e) {
    return {{"psnr_db", e.psnr_db}, {"max", e.largest}, {"percentile_99_9", e.percentile}};
}

}  // namespace

Json spread_json(const Spread& s) {
    return {{"median", s.median}, {"quartile_low", s.low}, {"quartile_high", s.high}};
}

std::string cost_table(const CostResult& result) {
    size_t width = 10;
    for (const CostRow& row : result.rows) width = std::max(width, row.name.size());
    width = std::min<size_t>(width, 60);
    const bool photos = result.rows[0].photo_psnr_db.has_value();
    std::string text =
        fmt::format("{:<{}}  {:>9} {:>15}  {:>8} {:>8} {:>8} {:>8}", "setting", width, "ms/frame",
                    "quartiles", "PSNR dB", "max", "99.9 %", "by pixel");
    if (photos) text += fmt::format("  {:>9} {:>7}", "photos dB", "SSIM");
    text += "  front\n";
    for (const CostRow& row : result.rows) {
        text += fmt::format(
            "{:<{}}  {:>9.3f} {:>15}  {:>8.2f} {:>8.5f} {:>8.5f} {:>8.2f}", row.name, width,
            row.ms.median, fmt::format("{:.3f}-{:.3f}", row.ms.low, row.ms.high), row.error.psnr_db,
            row.error.largest, row.error.percentile, row.error_by_pixel.psnr_db);
        if (photos) text += fmt::format("  {:>9.3f} {:>7.4f}", *row.photo_psnr_db, *row.photo_ssim);
        text += fmt::format(
            "  {}{}\n", row.on_front ? "*" : "",
            row.same_as_balanced && &row != result.rows.data() ? "same picture as balanced" : "");
    }
    text += "\n";
    for (const std::string& answer : cost_answers(result)) text += answer + "\n";
    return text;
}

Json cost_json(const CostResult& result) {
    Json rows = Json::array();
    for (const CostRow& row : result.rows) {
        Json choices = Json::object(), passes = Json::object();
        for (int s = 0; s < kAccuracyCount; ++s)
            choices[std::string(accuracy_settings()[s].name)] = row.accuracy.of(s).name;
        for (const auto& [name, spread] : row.passes) passes[name] = spread_json(spread);
        Json one{{"name", row.name},
                 {"accuracy", choices},
                 {"ms", spread_json(row.ms)},
                 {"passes_ms", passes},
                 {"error", error_json(row.error)},
                 {"error_by_pixel_order", error_json(row.error_by_pixel)},
                 {"same_as_balanced", row.same_as_balanced},
                 {"on_front", row.on_front}};
        if (row.setting >= 0) one["setting"] = accuracy_settings()[row.setting].name;
        if (row.photo_psnr_db)
            one["photos"] = {{"psnr_db", *row.photo_psnr_db},
                             {"ssim", *row.photo_ssim},
                             {"on_front", row.on_photo_front}};
        rows.push_back(std::move(one));
    }
    return {{"version", DARB_VERSION},
            {"device", result.device},
            {"driver", result.driver},
            {"kernel", result.kernel},
            {"footprint", result.footprint},
            {"splats", result.splats},
            {"views", result.view_names},
            {"pixels", result.pixels},
            {"repeats", result.repeats},
            {"rows_side_by_side", result.group},
            {"drift_between_rounds", result.drift},
            {"truth_seconds", result.truth_seconds},
            {"rows", rows},
            {"answers", cost_answers(result)}};
}

// The page of `darb cost`: the answers, the fronts, time per pass, and every number in a table.

namespace {

/// Alone, combinations and the front as three series over ms.
template <class Value>
Figure scatter(const CostResult& result, const std::string& title, const std::string& unit,
               const Value& value, bool CostRow::*front) {
    Plot plot{title, "ms a frame", unit, {}};
    plot.log_x = true;
    plot.series = {{"settings alone", {}, true, false, false, {}},
                   {"combinations", {}, true, false, false, {}},
                   {"front", {}, false, true, true, {}}};
    std::vector<const CostRow*> best;
    for (const CostRow& row : result.rows) {
        const bool alone = row.setting >= 0 || &row == result.rows.data();
        PlotSeries& series = plot.series[alone ? 0 : 1];
        series.points.emplace_back(row.ms.median, value(row));
        series.titles.push_back(fmt::format("{}: {:.3f} ms ({:.3f} to {:.3f}), {:.2f} dB", row.name,
                                            row.ms.median, row.ms.low, row.ms.high, value(row)));
        if (row.*front) best.push_back(&row);
    }
    std::sort(best.begin(), best.end(),
              [](const CostRow* a, const CostRow* b) { return a->ms.median < b->ms.median; });
    for (const CostRow* row : best) plot.series[2].points.emplace_back(row->ms.median, value(*row));
    return {"", plot};
}

bool is_combination(const CostResult& result, const CostRow& row) {
    return row.setting < 0 && &row != result.rows.data();
}

Figure pass_bars(const CostResult& result, bool combinations, const std::string& title,
                 std::vector<std::string>& names) {
    BarPlot plot{title, "ms a frame; whiskers: quartiles of the repeats", {}, {}, true};
    for (const CostRow& row : result.rows)
        for (const auto& [name, spread] : row.passes)
            if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    plot.names = names;
    for (const CostRow& row : result.rows) {
        if (is_combination(result, row) != combinations) continue;
        if (combinations && !row.on_front && row.accuracy != preset_accuracy(kFast) &&
            row.accuracy != preset_accuracy(kExact))
            continue;
        BarPlot::Row bar{row.name, std::vector<double>(names.size(), 0.0), row.ms.low, row.ms.high};
        for (const auto& [name, spread] : row.passes)
            bar.parts[static_cast<size_t>(std::find(names.begin(), names.end(), name) -
                                          names.begin())] = spread.median;
        plot.rows.push_back(std::move(bar));
    }
    return {"", plot};
}

Table every_row(const CostResult& result) {
    using Kind = TableColumn::Kind;
    Table table{"settings", "Every measured row", "", {}, {}};
    table.columns = {{"setting", "", Better::neither, 0, Kind::prose},
                     {"ms a frame", "", Better::neither, 3},
                     {"quartiles", "", Better::neither, 3},
                     {"PSNR", "dB"},
                     {"largest error", "", Better::neither, 5},
                     {"99.9 %", "", Better::neither, 5},
                     {"PSNR, by pixel", "dB"},
                     {"photos", "dB", Better::neither, 3},
                     {"SSIM", "", Better::neither, 4}};
    for (const CostRow& row : result.rows) {
        const bool same = row.same_as_balanced && &row != result.rows.data();
        table.rows.push_back(
            {{row.name + (same ? " (same picture as balanced)" : ""), row.ms.median,
              TableCell::between(row.ms.low, row.ms.high), row.error.psnr_db, row.error.largest,
              row.error.percentile, row.error_by_pixel.psnr_db, row.photo_psnr_db, row.photo_ssim},
             true,
             row.on_front});
    }
    return table;
}

std::string notes(const CostResult& result) {
    return fmt::format(
        "<h2>How to read it</h2>"
        "<p>Times: device timestamps, summed over the passes of a frame, mean over {} views; "
        "median and quartiles of {} or more repeats, all rows turn by turn so that drift hits them "
        "alike "
        "({} side by side). Combinations were timed in a second round and divided by what balanced "
        "had drifted by in it, {:.3f}.</p>"
        "<p>Errors: against a renderer in double precision with the true kernel profile, alpha "
        "cut-off 1/1024 and transmittance stop 1e-6, over all {} values of the views' pixels, "
        "clamped to [0, 1]. Kernel, footprint, colour and depth order of that truth are the "
        "file's: another footprint or a sort at every pixel shows another picture, not a less "
        "accurate one. The column by pixel is against the truth with the splats fully sorted at "
        "every pixel. Bold rows are on the front: nothing measured is faster and closer to the "
        "truth.</p>"
        "<p>Combinations: those that the single settings predict to be on the front (times "
        "multiply, squared errors add). Every point shown is measured.</p>\n",
        result.view_names.size(), result.repeats, result.group, result.drift,
        format_number(3.0 * static_cast<double>(result.pixels)));
}

}  // namespace

Report cost_report(const CostResult& result, const std::string& title) {
    Report report(title,
                  fmt::format("What accuracy costs in time: {} splats, {}, footprint {}; {}, {}",
                              format_number(static_cast<double>(result.splats)), result.kernel,
                              result.footprint, result.device, result.driver));
    std::string answers;
    for (const std::string& answer : cost_answers(result))
        answers += "<li>" + html_escape(answer) + "</li>\n";
    report.heading("In words");
    report.html("<ul>" + answers + "</ul>\n");
    report.heading("Accuracy against time");
    std::vector<Figure> fronts{scatter(
        result, "Time and distance from the truth", "PSNR against the truth (dB)",
        [](const CostRow& r) { return r.error.psnr_db; }, &CostRow::on_front)};
    if (result.rows[0].photo_psnr_db)
        fronts.push_back(scatter(
            result, "Time and photos", "PSNR against the photos (dB)",
            [](const CostRow& r) { return *r.photo_psnr_db; }, &CostRow::on_photo_front));
    report.plots(std::move(fronts));
    std::vector<std::string> names;
    const Figure alone = pass_bars(result, false, "Each setting alone", names);
    const Figure together = pass_bars(result, true, "Presets and the front", names);
    report.heading("Time per pass");
    report.plots({alone, together}, names);
    report.table(every_row(result), 2);
    report.html(notes(result));
    return report;
}

}  // namespace darb
