#include "tools/cost/cost_report.h"

#include <fmt/format.h>

#include <algorithm>

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

}  // namespace darb
