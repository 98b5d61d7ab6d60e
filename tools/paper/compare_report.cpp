// A comparison as text and as JSON.
#include <fmt/format.h>

#include "engine/report/html.h"
#include "tools/paper/compare_means.h"
#include "tools/paper/compare_pulses.h"
#include "tools/paper/compare_runs.h"
#include "tools/paper/compare_shapes.h"
#include "tools/paper/compare_stats.h"
#include "tools/paper/paper_numbers.h"

namespace darb {

namespace {

using Json = nlohmann::json;

Json optional_json(const std::optional<double>& v) {
    return v ? Json(*v) : Json(nullptr);
}

Json at_json(const ComparedAt& at) {
    Json views = Json::array();
    for (const ComparedView& v : at.views)
        views.push_back({{"name", v.name},
                         {"psnr_db", v.psnr_db},
                         {"ssim", v.ssim},
                         {"lpips", optional_json(v.lpips)}});
    Json scales = Json::array();
    for (const ComparedScale& s : at.scales)
        scales.push_back({{"scale", s.scale}, {"psnr_db", s.psnr_db}, {"ssim", s.ssim}});
    return {{"iteration", at.iteration},
            {"training_s", at.seconds},
            {"psnr_db", at.psnr_db},
            {"ssim", at.ssim},
            {"lpips", optional_json(at.lpips)},
            {"splats", at.splats},
            {"model_mb", optional_json(at.model_mb)},
            {"views", views},
            {"scales", scales},
            {"arc_psnr_db", optional_json(at.arc_db)},
            {"off_path_psnr_db", optional_json(at.off_path_db)}};
}

Json run_json(const ComparedRun& run) {
    Json json{
        {"kernel", run.kernel},   {"seed", run.seed},      {"folder", run.folder.string()},
        {"failure", run.failure}, {"notes", run.notes},    {"peak_mb", optional_json(run.peak_mb)},
        {"at", Json::array()},    {"curve", Json::array()}};
    for (const ComparedAt& at : run.at) json["at"].push_back(at_json(at));
    for (const CurvePoint& p : run.curve)
        json["curve"].push_back({{"iteration", p.iteration},
                                 {"seconds", p.seconds},
                                 {"loss", p.loss},
                                 {"splats", p.splats}});
    if (const auto& b = run.blending)
        json["blending"] = {{"blended_per_pixel", b->blended_per_pixel},
                            {"pairs_per_splat", b->intersections_per_splat},
                            {"ns_per_splat_pixel", b->ns_per_splat_pixel},
                            {"blend_ms", b->blend_ms},
                            {"frame_ms", b->frame_ms}};
    if (run.shapes) json["shapes"] = shapes_json(*run.shapes);
    return json;
}

Json summary_json(const Comparison& c, const ComparedDataset& dataset) {
    Json rows = Json::array();
    for (const int iteration : c.iterations)
        for (const std::string& kernel : c.kernels) {
            Json row{{"kernel", kernel}, {"iteration", iteration}};
            for (const Column& column : every_column(c)) {
                const OverSeeds v = over_seeds(dataset, kernel, iteration, column);
                row[column.json] = v.median ? Json{{"median", *v.median},
                                                   {"low", v.low},
                                                   {"high", v.high},
                                                   {"runs", v.count}}
                                            : Json(nullptr);
            }
            rows.push_back(std::move(row));
        }
    return rows;
}

Json paper_json(const std::string& dataset) {
    Json rows = Json::array();
    for (const PaperNumbers& p : paper_numbers_of(dataset))
        rows.push_back({{"kernel", kernel_name(p.kernel)},
                        {"iteration", p.iteration},
                        {"psnr_db", p.psnr_db},
                        {"ssim", p.ssim},
                        {"lpips", p.lpips},
                        {"model_mb", p.model_mb},
                        {"training_s", p.training_s}});
    return rows;
}

}  // namespace

namespace {

// A line a kernel, with a star where it is the best; below it, over several seeds, the range.
std::string kernel_lines(const Comparison& c, const ComparedDataset& dataset, int iteration,
                         const std::vector<Column>& columns) {
    std::vector<std::vector<OverSeeds>> values(columns.size());
    std::vector<Marks> marks;
    for (std::size_t k = 0; k < columns.size(); ++k) {
        for (const std::string& kernel : c.kernels)
            values[k].push_back(over_seeds(dataset, kernel, iteration, columns[k]));
        marks.push_back(marks_over_seeds(values[k], columns[k]));
    }
    std::string text;
    for (std::size_t row = 0; row < c.kernels.size(); ++row) {
        std::string line = fmt::format("{:<26}", c.kernels[row]);
        std::string ranges = fmt::format("{:<26}", "  lowest to highest");
        bool several = false;
        for (std::size_t k = 0; k < columns.size(); ++k) {
            const OverSeeds& v = values[k][row];
            const auto number = [&](double value) {
                return format_number(value, columns[k].decimals);
            };
            line += fmt::format(
                " {:>12}",
                v.median ? number(*v.median) + (marks[k][row] == Mark::best ? "*" : "") : "-");
            const bool range = v.count > 1;
            several |= range;
            ranges += fmt::format(" {:>12}", range ? number(v.low) + "-" + number(v.high) : "");
        }
        text += line + "\n" + (several ? ranges + "\n" : "");
    }
    return text;
}

}  // namespace

std::string comparison_table(const Comparison& c) {
    std::string text;
    const std::vector<Column> columns = shown_columns(c);
    for (const ComparedDataset& dataset : c.datasets)
        for (const int iteration : c.iterations) {
            text += fmt::format("{}, {} iterations\n{:<26}", dataset.name, format_number(iteration),
                                "");
            for (const Column& column : columns)
                text += fmt::format(
                    " {:>12}", column.unit.empty() ? column.name : column.name + " " + column.unit);
            text += "\n";
            text += kernel_lines(c, dataset, iteration, columns) + "\n";
        }
    for (const ComparedDataset& dataset : c.datasets) text += pulse_lines(c, dataset);
    for (const ComparedDataset& dataset : c.datasets)
        for (const ComparedRun& run : dataset.runs)
            for (const auto& [what, why] : {std::pair{"failed", run.failure}, {"note", run.notes}})
                if (!why.empty())
                    text += fmt::format("{}: {}, {}, seed {}: {}\n", what, dataset.name, run.kernel,
                                        run.seed, why);
    return text;
}

nlohmann::json comparison_json(const Comparison& c) {
    Json datasets = Json::array();
    for (const ComparedDataset& dataset : c.datasets) {
        Json one{{"name", dataset.name},
                 {"path", dataset.path.string()},
                 {"medians", summary_json(c, dataset)},
                 {"runs", Json::array()},
                 {"pulses", pulse_json(c, dataset)},
                 {"paper", paper_json(dataset.name)}};
        for (const ComparedRun& run : dataset.runs) one["runs"].push_back(run_json(run));
        datasets.push_back(std::move(one));
    }
    return {{"version", DARB_VERSION}, {"device", c.device},    {"settings", c.settings},
            {"seeds", c.seeds},        {"lpips", c.lpips_note}, {"iterations", c.iterations},
            {"kernels", c.kernels},    {"datasets", datasets},  {"means", means_json(c)}};
}

}  // namespace darb
