// The results of `darb cost --train` as a table, as JSON and as a page.
#include <fmt/format.h>

#include <algorithm>

#include "engine/report/html.h"
#include "engine/report/page.h"
#include "engine/report/svg_plot.h"
#include "tools/cost/cost_report.h"
#include "tools/cost/train_cost.h"

namespace darb {

namespace {

using Json = nlohmann::json;

std::string error_text(const TrainCostRow& row) {
    return row.gradient_error ? fmt::format("{:.2e}", row.gradient_error->median) : "-";
}

std::string seconds_text(const TrainCostRow& row, size_t target, int seeds) {
    if (row.reached[target] == 0) return "-";
    std::string text = fmt::format("{:.2f}", row.seconds_to[target].median);
    if (row.reached[target] < seeds) text += fmt::format(" ({}/{})", row.reached[target], seeds);
    return text;
}

std::string numbers(const TrainCostResult& result) {
    std::string html =
        "<h2>Every setting</h2><div class='wide'><table><tr><th>setting</th><th>gradient error</th>"
        "<th>ms an iteration</th><th>quartiles</th><th>PSNR (dB)</th><th>quartiles</th>";
    for (const double target : result.targets)
        html += fmt::format("<th>s to {:.2f} dB</th>", target);
    html += "</tr>\n";
    for (const TrainCostRow& row : result.rows) {
        html += fmt::format(
            "<tr><td class='text'>{}</td><td>{}</td><td>{:.3f}</td><td>{:.3f} to {:.3f}</td>"
            "<td>{:.3f}</td><td>{:.3f} to {:.3f}</td>",
            html_escape(row.name), error_text(row), row.ms.median, row.ms.low, row.ms.high,
            row.psnr_db.median, row.psnr_db.low, row.psnr_db.high);
        for (size_t t = 0; t < result.targets.size(); ++t)
            html += "<td>" + seconds_text(row, t, result.seeds) + "</td>";
        html += "</tr>\n";
    }
    return html + "</table></div>\n";
}

}  // namespace

std::string train_cost_table(const TrainCostResult& result) {
    size_t width = 10;
    for (const TrainCostRow& row : result.rows) width = std::max(width, row.name.size());
    std::string text = fmt::format("{:<{}}  {:>9} {:>9} {:>15} {:>9} {:>15}", "setting", width,
                                   "gradient", "ms/iter", "quartiles", "PSNR dB", "quartiles");
    for (const double target : result.targets) text += fmt::format("  s to {:.2f} dB", target);
    text += "\n";
    for (const TrainCostRow& row : result.rows) {
        text += fmt::format(
            "{:<{}}  {:>9} {:>9.3f} {:>15} {:>9.3f} {:>15}", row.name, width, error_text(row),
            row.ms.median, fmt::format("{:.3f}-{:.3f}", row.ms.low, row.ms.high),
            row.psnr_db.median, fmt::format("{:.2f}-{:.2f}", row.psnr_db.low, row.psnr_db.high));
        for (size_t t = 0; t < result.targets.size(); ++t)
            text += fmt::format("  {:>13}", seconds_text(row, t, result.seeds));
        text += "\n";
    }
    return text;
}

Json train_cost_json(const TrainCostResult& result) {
    Json rows = Json::array();
    for (const TrainCostRow& row : result.rows) {
        Json choices = Json::object(), seconds = Json::array();
        for (int s = 0; s < kAccuracyCount && !row.change; ++s)
            choices[std::string(accuracy_settings()[s].name)] = row.accuracy.of(s).name;
        for (size_t t = 0; t < result.targets.size(); ++t)
            seconds.push_back({{"psnr_db", result.targets[t]},
                               {"seeds_that_reached_it", row.reached[t]},
                               {"seconds", spread_json(row.seconds_to[t])}});
        rows.push_back(
            {{"name", row.name},
             {"accuracy", choices},
             {"gradient_error", row.gradient_error ? spread_json(*row.gradient_error) : Json()},
             {"ms_per_iteration", spread_json(row.ms)},
             {"psnr_db", spread_json(row.psnr_db)},
             {"seconds_to", seconds}});
    }
    return {{"version", DARB_VERSION},
            {"device", result.device},
            {"driver", result.driver},
            {"dataset", result.dataset},
            {"seeds", result.seeds},
            {"iterations", result.iterations},
            {"rows", rows}};
}

std::string train_cost_html(const TrainCostResult& result) {
    Plot ends{"Time and quality", "ms an iteration", "PSNR, held out (dB)", {}};
    ends.log_x = true;
    ends.series = {{"settings", {}, true, false, false, {}}};
    Plot gradients{"Gradients", "ms an iteration", "gradient error", {}};
    gradients.log_x = gradients.log_y = true;
    gradients.series = {{"settings", {}, true, false, false, {}}};
    Plot curves{"Held-out PSNR, first seed", "training time (s)", "PSNR (dB)", {}};
    for (const TrainCostRow& row : result.rows) {
        ends.series[0].points.emplace_back(row.ms.median, row.psnr_db.median);
        ends.series[0].titles.push_back(
            fmt::format("{}: {:.3f} ms, {:.3f} dB", row.name, row.ms.median, row.psnr_db.median));
        if (row.gradient_error) {
            gradients.series[0].points.emplace_back(row.ms.median, row.gradient_error->median);
            gradients.series[0].titles.push_back(
                fmt::format("{}: {:.3f} ms, {}", row.name, row.ms.median, error_text(row)));
        }
        const bool shown = row.accuracy == Accuracy{} ||
                           row.accuracy == preset_accuracy(kFast, true) ||
                           row.accuracy == preset_accuracy(kExact, true);
        if (shown && !row.change)
            curves.series.push_back({row.name, row.curve, true, true, false, {}});
    }
    return html_page(
        result.dataset,
        fmt::format("What accuracy costs in training: seeds {}, iterations {}; {}, {}",
                    result.seeds, result.iterations, result.device, result.driver),
        "<div class='plots'>" + svg_plot(ends) + svg_plot(gradients) + svg_plot(curves) +
            "</div>\n" + numbers(result) +
            "<h2>How to read it</h2><p>Each setting alone, the presets, and what training does "
            "beside "
            "the settings, each turned the other way; row after row within a "
            "seed, so that drift hits all alike. Quartiles over the seeds. Gradient error: "
            "|g - g*| / |g*|, mean over the kinds of parameters, median over three photos, of the "
            "scene that balanced trained, g* in double precision with the true kernel profile, "
            "cut-off 1/1024 "
            "and stop 1e-6. Seconds count training alone.</p>\n");
}

}  // namespace darb
