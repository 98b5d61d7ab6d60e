// SPDX-License-Identifier: MIT
#include "tools/darb/scene_evaluation.h"

#include <fmt/format.h>
#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <utility>

#include "engine/core/say.h"
#include "engine/core/text.h"
#include "engine/data/camera_list.h"
#include "engine/data/depths.h"
#include "engine/data/metrics.h"
#include "engine/raster/frame_view.h"
#include "engine/render/renderer.h"
#include "tools/paper/compare_stats.h"
#include "trainer/job/scene_file.h"
#include "trainer/run/run_report.h"
#include "trainer/step/camera_refinement.h"
#include "trainer/step/exposure.h"
#include "trainer/step/rank_group.h"

namespace darb {

namespace {
struct ViewNumbers {  // one view's numbers, on their way from another rank
    double psnr_db, ssim;
    bool has_depth, has_flip;
    DepthError depth;
    double flip;
};

// Depths need whole pixels, and 16 bits do not hold them.
bool renders_depth(const Accuracy& accuracy) {
    return accuracy.value(kStorage) == STORAGE_FLOAT32 && accuracy.value(kRenderScale) == 1;
}

// Checks that the ranks agree on which views are measured, and on the pictures.
void check_agreement(Ranks& ranks, const Device& device, const SplatModel& model,
                     const std::vector<View>& views, const SceneEvaluation& options,
                     const EffectPlan& plan) {
    if (ranks.count() == 1) return;
    RankFacts facts = rank_facts(device);
    std::string names, scene(kernel_name(model.kernel));
    for (const View& view : views)
        names += fmt::format("{} {}x{}\n", view.name, view.camera.width, view.camera.height);
    for (int a = 0; a < kAttributeCount; ++a)
        scene += fact_of(std::as_bytes(std::span(attribute_values(model, a))));
    facts.emplace_back(
        "views", fmt::format("{} ({})", views.size(), fact_of(std::as_bytes(std::span(names)))));
    facts.emplace_back("scene", fmt::format("{} splats ({})", model.size(),
                                            fact_of(std::as_bytes(std::span(scene)))));
    std::string settings = plan_line(plan);
    for (const int choice : options.accuracy.choice) settings += fmt::format(" {}", choice);
    facts.emplace_back("settings",
                       fmt::format("{}, background {}, exposure {}, aligned {}, alpha as a mask {}",
                                   settings, options.background.r, options.fit_exposure,
                                   options.align_cameras, options.alpha_is_mask));
    check_same(ranks, facts);
}
}  // namespace

Evaluation evaluate_scene(Device& device, const SplatModel& model, std::vector<View> views,
                          const SceneEvaluation& options) {
    SplatModel planned = model;
    const EffectPlan plan = plan_rendering(planned, views, {}, options.effects);
    apply_plan(plan, planned);
    apply_plan(plan, views);
    for (const View& view : views)
        check_frame(device, view.camera.width, view.camera.height, view.name);
    Renderer renderer(device, planned, options.accuracy, plan.projection(), plan.huge_splat_path());
    OneRank alone;
    Ranks& ranks = options.ranks ? *options.ranks : static_cast<Ranks&>(alone);
    check_agreement(ranks, device, planned, views, options, plan);
    std::optional<CameraAlignment> alignment;
    if (options.align_cameras) alignment.emplace(device, planned);
    std::vector<ViewNumbers> own;
    for (size_t v = 0; v < views.size(); ++v) {
        if (!has_turn(ranks, v)) continue;
        const View& view = views[v];
        const ImageU8 photo = load_photo(view);
        const Camera camera = alignment ? alignment->align(view.camera, photo, options.background,
                                                           options.alpha_is_mask)
                                        : view.camera;
        ImageF image = renderer.render(camera, options.background);
        std::optional<DepthError> depth;
        if (!view.depth.empty() && renders_depth(options.accuracy))
            depth = compare_depth(renderer.render_depth(usual_reading(planned.kernel)),
                                  load_depth(view), options.depth_scale);
        if (options.fit_exposure)
            image = apply_exposure(
                fit_exposure(image, photo, options.background, options.alpha_is_mask), image, photo,
                options.alpha_is_mask);
        const ViewMetrics metrics =
            compare_view(view.name, image, photo, options.background, options.alpha_is_mask);
        const double flip =
            options.flip ? flip_of_view(image, photo, options.background, options.alpha_is_mask)
                         : 0;
        if (options.on_picture) options.on_picture(view, image, photo);
        own.push_back({metrics.psnr_db, metrics.ssim, depth.has_value(), options.flip,
                       depth.value_or(DepthError{}), flip});
    }
    Evaluation evaluation;
    for (const ViewNumbers& m : by_turns(ranks, own)) {
        const View& view = views[evaluation.views.size()];
        evaluation.views.push_back({view.name, m.psnr_db, m.ssim, view.in_arc});
        if (m.has_depth) evaluation.views.back().depth = m.depth;
        if (m.has_flip) evaluation.views.back().flip = m.flip;
    }
    take_means(evaluation);
    return evaluation;
}

std::vector<AtScale> evaluate_scales(Device& device, const SplatModel& model,
                                     const std::vector<double>& scales,
                                     const std::vector<std::vector<View>>& sizes,
                                     const SceneEvaluation& options) {
    std::vector<AtScale> rows;
    for (size_t i = 0; i < sizes.size(); ++i) {
        const Camera& camera = sizes[i].front().camera;
        rows.push_back({scales[i], camera.width, camera.height,
                        evaluate_scene(device, model, sizes[i], options)});
    }
    return rows;
}

// Writes evaluations as JSON and as tables for people; scene_evaluation.h declares this.

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
        if (v.flip) views.back()["flip"] = *v.flip;
    }
    nlohmann::json json{{"mean", {{"psnr_db", evaluation.psnr_db}, {"ssim", evaluation.ssim}}},
                        {"views", views}};
    if (evaluation.depth) json["mean"]["depth"] = depth_json(*evaluation.depth);
    if (evaluation.flip) json["mean"]["flip"] = *evaluation.flip;
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

Table evaluation_table(const Evaluation& evaluation) {
    Table table{"views", "Views", "", {}, {}};
    table.columns = {{"view", "", Better::neither, 0, TableColumn::Kind::name},
                     {"PSNR", "dB", Better::more, 3},
                     {"SSIM", "", Better::more, 4},
                     {"FLIP", "", Better::less, 4}};
    for (const ViewMetrics& v : evaluation.views)
        table.rows.push_back({{printable(v.name), v.psnr_db, v.ssim, v.flip}});
    const size_t in_arc = evaluation.arc ? evaluation.arc->views : 0;
    table.rows.push_back({{fmt::format("mean of {}", evaluation.views.size() - in_arc),
                           evaluation.psnr_db, evaluation.ssim, evaluation.flip},
                          false});
    if (in_arc > 0)
        table.rows.push_back({{fmt::format("arc, mean of {}", in_arc), evaluation.arc->psnr_db,
                               evaluation.arc->ssim, TableCell()},
                              false});
    return table;
}

Table evaluation_table(const std::vector<AtScale>& scales) {
    Table table{"scales", "Sizes", "", {}, {}};
    table.columns = {{"scale", "", Better::neither, 0, TableColumn::Kind::name},
                     {"size", "px", Better::neither, 0, TableColumn::Kind::name},
                     {"PSNR", "dB", Better::more, 3},
                     {"SSIM", "", Better::more, 4},
                     {"FLIP", "", Better::less, 4},
                     {"arc,", "dB", Better::more, 3},
                     {"SSIM", "", Better::more, 4}};
    for (const AtScale& at : scales) {
        const auto& arc = at.evaluation.arc;
        table.rows.push_back({{scale_text(at.scale), fmt::format("{} x {}", at.width, at.height),
                               at.evaluation.psnr_db, at.evaluation.ssim, at.evaluation.flip,
                               arc ? TableCell(arc->psnr_db) : TableCell(),
                               arc ? TableCell(arc->ssim) : TableCell()}});
    }
    return table;
}

void print_evaluation(std::FILE* out, const Evaluation& evaluation) {
    tell(out, "{}", text_table(evaluation_table(evaluation)));
    print_depth(out, evaluation);
}

void print_evaluation(std::FILE* out, const std::vector<AtScale>& scales) {
    tell(out, "{}", text_table(evaluation_table(scales)));
}

void take_trained_cameras(const std::filesystem::path& scene, std::vector<View>& views) {
    const std::filesystem::path log = log_of_run(scene);
    if (log.empty()) return;
    const nlohmann::json start = start_of_run(log);
    const nlohmann::json::json_pointer refined("/settings/effects/cameras");
    if (!start.is_object() || !start.contains(refined) || start[refined] != true) return;
    const std::filesystem::path file = log.parent_path() / "cameras.json";
    std::map<std::string, Camera> trained;
    for (const View& view : load_cameras(file)) trained[view.name] = view.camera;
    std::size_t taken = 0;
    for (View& view : views) {
        const auto at = trained.find(view.name);
        if (at == trained.end()) continue;
        const Camera& from = at->second;
        Camera& to = view.camera;
        const double x = double(to.width) / from.width, y = double(to.height) / from.height;
        to.rotation = from.rotation;
        to.translation = from.translation;
        to.fx = from.fx * x, to.cx = from.cx * x;
        to.fy = from.fy * y, to.cy = from.cy * y;
        ++taken;
    }
    say_note(fmt::format("cameras: {} of {} as {} has them, refined", taken, views.size(),
                         file.string()));
}

}  // namespace darb
