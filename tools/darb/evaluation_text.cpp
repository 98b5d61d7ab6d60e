// Evaluations as JSON and as tables for people: declared in scene_evaluation.h.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/core/say.h"
#include "engine/core/text.h"
#include "tools/darb/scene_evaluation.h"
#include "tools/paper/compare_stats.h"

namespace darb {

namespace {

nlohmann::json depth_json(const DepthError& error) {
    return {{"mean_error_m", error.mean_m}, {"median_error_m", error.median_m}};
}

}  // namespace

void print_depth(std::FILE* out, const Evaluation& evaluation) {
    if (!evaluation.depth) return;
    const auto count = std::ranges::count_if(
        evaluation.views, [](const ViewMetrics& v) { return v.depth.has_value(); });
    tell(out, "depth off by {:.4f} m in the mean, {:.4f} m in the median (means of {})\n",
         evaluation.depth->mean_m, evaluation.depth->median_m, count);
}

nlohmann::json evaluation_json(const Evaluation& evaluation) {
    nlohmann::json views = nlohmann::json::array();
    for (const ViewMetrics& v : evaluation.views) {
        views.push_back({{"name", v.name}, {"psnr_db", v.psnr_db}, {"ssim", v.ssim}});
        if (v.in_arc) views.back()["in_arc"] = true;
        if (v.depth) views.back()["depth"] = depth_json(*v.depth);
    }
    nlohmann::json json{{"mean", {{"psnr_db", evaluation.psnr_db}, {"ssim", evaluation.ssim}}},
                        {"views", views}};
    if (evaluation.depth) json["mean"]["depth"] = depth_json(*evaluation.depth);
    if (const auto& arc = evaluation.arc)
        json["arc"] = {{"views", arc->views}, {"psnr_db", arc->psnr_db}, {"ssim", arc->ssim}};
    return json;
}

nlohmann::json evaluation_json(const std::vector<AtScale>& scales) {
    nlohmann::json rows = nlohmann::json::array();
    for (const AtScale& at : scales) {
        nlohmann::json row = evaluation_json(at.evaluation);
        row["scale"] = at.scale;
        row["width"] = at.width;
        row["height"] = at.height;
        rows.push_back(std::move(row));
    }
    return {{"scales", rows}};
}

void print_evaluation(std::FILE* out, const Evaluation& evaluation) {
    const size_t in_arc = evaluation.arc ? evaluation.arc->views : 0;
    const std::string mean = fmt::format("mean of {}", evaluation.views.size() - in_arc);
    const std::string arc = in_arc > 0 ? fmt::format("arc, mean of {}", in_arc) : "";
    size_t width = std::max(mean.size(), arc.size());
    for (const ViewMetrics& v : evaluation.views) width = std::max(width, printable(v.name).size());
    const auto row = [&](const std::string& name, double psnr_db, double ssim) {
        tell(out, "{:<{}}  {:>8.3f}  {:>7.4f}\n", name, width, psnr_db, ssim);
    };
    tell(out, "{:<{}}  {:>8}  {:>7}\n", "view", width, "PSNR dB", "SSIM");
    for (const ViewMetrics& v : evaluation.views) row(printable(v.name), v.psnr_db, v.ssim);
    row(mean, evaluation.psnr_db, evaluation.ssim);
    if (in_arc > 0) row(arc, evaluation.arc->psnr_db, evaluation.arc->ssim);
    print_depth(out, evaluation);
}

void print_evaluation(std::FILE* out, const std::vector<AtScale>& scales) {
    const bool arcs = !scales.empty() && scales.front().evaluation.arc.has_value();
    tell(out, "{:<8}  {:<11}  {:>8}  {:>7}{}\n", "scale", "size px", "PSNR dB", "SSIM",
         arcs ? "  arc, dB     SSIM" : "");
    for (const AtScale& at : scales) {
        const auto& arc = at.evaluation.arc;
        tell(out, "{:<8}  {:<11}  {:>8.3f}  {:>7.4f}{}\n", scale_text(at.scale),
             fmt::format("{} x {}", at.width, at.height), at.evaluation.psnr_db, at.evaluation.ssim,
             arc ? fmt::format("  {:>7.3f}  {:>7.4f}", arc->psnr_db, arc->ssim) : "");
    }
}

}  // namespace darb
