// SPDX-License-Identifier: MIT
#include "trainer/job/job.h"

#include "engine/core/count_text.h"
#include "engine/plan/tuner.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/data/camera_list.h"
#include "engine/data/source.h"
#include "engine/data/track_adjustment.h"
#include "engine/scene/clutter.h"
#include "engine/scene/region.h"
#include "trainer/growth/predicted_growth.h"
#include "trainer/job/training_data.h"
#include "trainer/options/strategy.h"
#include "trainer/run/forecast.h"

namespace darb {

namespace {

constexpr int kStandardEvaluations[] = {7'000, 30'000};

EffectChoice effects_of(const TrainRequest& request) {
    EffectChoice choice =
        parse_effects(request.train.exposure_grid ? effects_beside(request.effects, "+exposure")
                                                  : request.effects);
    if (request.antialiasing) choice.changed[EFFECT_ANTIALIAS] = true;
    if (request.refine_cameras != "auto")
        choice.changed[EFFECT_CAMERAS] = request.refine_cameras == "on";
    return choice;
}

// Before anything begins at the cameras or the points.
std::string adjust_cameras(Dataset& dataset) {
    if (std::ranges::any_of(dataset.views,
                            [](const View& view) { return view.camera.shutter.active; }))
        return "cameras: tracks do not adjust them before the run, as their rows are exposed one "
               "after the other";
    const TrackAdjustment a = adjust_to_tracks(dataset);
    if (a.adjusted)
        return fmt::format(
            "cameras: tracks moved {} by {:.2f} px in the middle; their error, {} times {} points, "
            "went from {:.2f} to {:.2f} px",
            counted(a.views, "camera"), a.median_move_px, a.observations, a.points, a.before_px,
            a.after_px);
    return a.views < 2
               ? "cameras: no tracks say where photos saw points; pictures alone refine them"
               : fmt::format("cameras: they fit the tracks, {:.2f} px in the middle", a.before_px);
}

// Large photos have detail that the mean difference hardly weighs.
void plan_loss(TrainJob& job) {
    constexpr double kLargePhoto = 4e5;  // px
    if (job.options.lambda_dssim) return;
    const double pixels = mean_photo_pixels(job.dataset);
    job.options.lambda_dssim = pixels >= kLargePhoto ? 0.3f : 0.2f;
}

void plan_effects(TrainJob& job, bool looks) {
    Dataset& dataset = job.dataset;
    const bool sees = !dataset.points.seen_begin.empty() || dataset.has_alpha;
    if (looks && sees && job.photos.empty()) job.photos = load_photos(dataset.views);
    job.effects = plan_training(dataset, sees ? job.photos : std::vector<ImageU8>{},
                                job.options.sh_degree, effects_of(job.request));
    apply_plan(job.effects, job.options);
    apply_plan(job.effects, dataset.views);
    const TrainOptions usual;
    const TrainOptions& t = job.options;
    if (job.effects.row(EFFECT_SHUTTER).overridden && t.projection.shutter && !t.refine_cameras)
        job.notes.emplace_back(
            "Warning: --effects +shutter changes nothing, as no file says how cameras move while "
            "rows are exposed; with --refine-cameras on, training finds it.");
    if (t.refine_cameras)
        job.cameras_note = adjust_cameras(dataset);
    else if (t.camera_lr || t.camera_from != usual.camera_from ||
             t.camera_anchor != usual.camera_anchor)
        job.notes.emplace_back(
            "--camera-lr, --camera-from and --camera-anchor are not used: cameras are refined with "
            "--refine-cameras on");
    if (!t.depth && t.depth_weight != usual.depth_weight)
        job.notes.emplace_back(
            "--depth-weight is not used: measured depths are compared with --effects +depth");
    if (!t.surface &&
        (t.surface_from != usual.surface_from || t.distortion_weight != usual.distortion_weight ||
         t.flatness_weight != usual.flatness_weight))
        job.notes.emplace_back(
            "--surface-from, --distortion-weight and --flatness-weight are not used: splats are "
            "laid on surfaces with --effects +surface");
}

// By the cameras and the points that the data set came with, which a run that goes on has as well.
void plan_region(TrainJob& job) {
    if (job.request.region.empty()) return;
    const SplatModel points = initial_model(job.dataset, job.options);
    job.options.region =
        region_from("--roi", job.request.region, points, cameras_of(job.dataset.views));
    job.region_note = fmt::format("region: {}", region_text(*job.options.region));
    if (starts_random(job.dataset, job.options)) return;
    const std::size_t inside =
        points.size() - count_of(splats_outside(*job.options.region, points));
    if (inside == 0)
        throw Error(
            "--roi " + job.request.region,
            fmt::format("none of the data set's {} points lies in it", count_text(points.size())),
            "Name a region around what the photos show, in the data set's coordinates; "
            "--roi subject finds one.");
    job.region_note +=
        fmt::format(", with {} of {} points", count_text(inside), count_text(points.size()));
}

CleaningRules cleaning_of(const TrainJob& job) {
    const TrainRequest& request = job.request;
    CleaningRules rules;
    rules.isolated = request.clean_isolated.value_or(0);
    rules.free_space = static_cast<std::uint32_t>(request.clean_free_space.value_or(0));
    if (!request.clean_haze.empty()) take_haze("--clean-haze", request.clean_haze, rules);
    if (request.drop_outside) rules.region = job.options.region;
    return rules;
}

void plan_strategy(TrainJob& job) {
    TrainOptions& t = job.options;
    if (job.dataset.detail.opaque == 0) job.dataset.detail = photo_detail(job.dataset.views);
    if (!strategy_row(t.strategy).grows_to_limit) return;
    const bool given = t.max_splats.has_value();
    if (!given) t.max_splats = default_budget(job.dataset, t);
    job.strategy_note = fmt::format(
        "strategy: {}, up to {} splats{}", strategy_name(t.strategy), count_text(*t.max_splats),
        given ? ""
              : fmt::format(", what {} is forecast to end with; --budget sets another "
                            "count",
                            strategy_name(Strategy{})));
}

}  // namespace

TrainJob resolve(TrainRequest request, Dataset dataset, std::vector<ImageU8> photos, bool looks) {
    check_request(request);
    TrainJob job;
    job.options = request.train;
    job.notes = request.notes;
    for (std::string& note : unused_options(request)) job.notes.push_back(std::move(note));
    job.resume_from = checkpoint_to_resume(request);
    job.request = std::move(request);
    job.dataset = std::move(dataset);
    job.photos = std::move(photos);
    plan_loss(job);
    plan_effects(job, looks);
    plan_region(job);
    plan_strategy(job);
    return job;
}

bool starts_from_stereo(const TrainJob& job) {
    if (!job.resume_from.empty()) return false;
    return job.options.start == StartPoints::dense ||
           (job.request.schedule != "3dgs" && lacks_points(job.dataset, job.options));
}

void find_start(Device& device, TrainJob& job, const std::function<void()>& begins) {
    Dataset& dataset = job.dataset;
    const TrainOptions& t = job.options;
    if (t.start == StartPoints::points && dataset.points.size() == 0)
        throw Error(dataset.root.string(), "has no points for --start points",
                    "Use --start dense or --start random.");
    if (!starts_from_stereo(job)) return;
    if (job.photos.empty()) job.photos = load_photos(dataset.views);
    if (begins) begins();
    const bool opaque = !t.alpha && dataset.has_alpha;
    DenseStart start = dense_start(
        device, dataset, opaque ? photos_of_run(dataset, t, job.photos) : job.photos, t.seed);
    if (t.start == StartPoints::automatic && start.on_surfaces < kLeastOnSurfaces) {
        job.start_note =
            start.photos.empty()
                ? "start: random points, as stereo does not compare photos with a lens"
                : fmt::format("start: random points, as stereo finds surfaces in only {} places",
                              start.on_surfaces);
        return;
    }
    if (start.on_surfaces == 0)
        throw Error(
            dataset.root.string(), "no surface is seen alike in several photos",
            fmt::format("Use --start {}random.", dataset.points.size() > 0 ? "points or " : ""));
    job.start_note = fmt::format(
        "start: dense, {} points on surfaces and {} of the data set, in {:.1f} s; "
        "photos agree on {:.0f} % of their pixels",
        count_text(start.on_surfaces), count_text(start.cloud.size() - start.on_surfaces),
        start.seconds, 100 * start.agreeing);
    dataset.start = start.cloud;
    job.start = std::move(start);
}

RunOptions run_options(const TrainJob& job, const JobSinks& sinks) {
    const TrainRequest& request = job.request;
    RunOptions run;
    run.output = request.output;
    run.test_iterations = request.test_iterations;
    run.save_iterations = request.save_iterations;
    for (std::vector<int>* list : {&run.test_iterations, &run.save_iterations})
        if (list->empty())
            list->assign(std::begin(kStandardEvaluations), std::end(kStandardEvaluations));
    run.checkpoint_iterations = request.checkpoint_iterations;
    run.checkpoint_interval = request.checkpoint_interval;
    run.resume_from = job.resume_from;
    run.report = request.report;
    run.request = request_text(request);
    run.effects = plan_line(job.effects);
    run.effects_json =
        plan_json(job.effects).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    run.pace = job.pace;
    run.cleaning = cleaning_of(job);
    run.quiet = sinks.quiet;
    run.on_step = sinks.on_step;
    run.ranks = sinks.ranks;
    return run;
}

TrainResult run(Device& device, TrainJob& job, const JobSinks& sinks) {
    RunOptions run = run_options(job, sinks);
    run.look_again = !is_known_device(device.info());
    if (job.start)
        run.write_start = [start = std::move(*job.start)](const std::filesystem::path& to) mutable {
            write_dense_start(start, to);
            start = {};  // it holds every photo
        };
    job.start.reset();
    run.changed_request = [&job](const RunChange& change) {
        apply_change(change, job.request.train);
        return request_text(job.request);
    };
    return run_training(device, job.dataset, job.options, run, sinks.stop, std::move(job.photos));
}

TrainResult train(Device& device, TrainRequest request, const JobSinks& sinks) {
    std::optional<RunLock> lock;
    Dataset dataset = load_training_data(request, lock, {sinks.quiet, sinks.stop});
    check_run_folder(request.output, dataset);
    if (!lock) lock.emplace(request.output);
    TrainJob job = resolve(std::move(request), std::move(dataset));
    find_start(device, job);
    if (job.resume_from.empty()) check_start_memory(device, job.dataset, job.options);
    return run(device, job, sinks);
}

nlohmann::json plan_json(const EffectPlan& plan) {
    nlohmann::json rows = nlohmann::json::array();
    for (int e = 0; e < EFFECT_COUNT; ++e) {
        const EffectRow& row = plan.row(e);
        rows.push_back({{"effect", effect_name(e)},
                        {"on", row.on},
                        {"overridden", row.overridden},
                        {"measured", row.measured},
                        {"reason", row.reason}});
        if (e == EFFECT_VIEW_COLOUR) rows.back()["degree"] = row.degree;
    }
    return rows;
}

void apply_plan(const EffectPlan& plan, TrainOptions& options) {
    const EffectRow& colour = plan.row(EFFECT_VIEW_COLOUR);
    options.sh_degree = colour.degree;
    options.probe_sh = colour.on && !colour.overridden;
    options.antialias = plan.on(EFFECT_ANTIALIAS);
    options.exposure = plan.on(EFFECT_EXPOSURE);
    options.depth = plan.on(EFFECT_DEPTH);
    options.refine_cameras = plan.on(EFFECT_CAMERAS);
    options.surface = plan.on(EFFECT_SURFACE);
    options.projection = plan.projection();
    options.probe_shutter = plan.row(EFFECT_SHUTTER).tried;
    options.alpha = plan.on(EFFECT_ALPHA);
    options.huge_splat_path = plan.huge_splat_path();
}

}  // namespace darb
