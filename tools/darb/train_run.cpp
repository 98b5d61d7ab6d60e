#include "tools/darb/train_run.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/data/source.h"
#include "engine/data/track_adjustment.h"
#include "tools/darb/effect_flags.h"
#include "tools/darb/outputs.h"
#include "trainer/dense_start.h"
#include "trainer/forecast.h"
#include "trainer/strategy.h"

namespace darb {

namespace {

EffectChoice training_choice(const TrainFlags& flags) {
    EffectChoice choice = parse_effects(flags.effects);
    if (flags.antialiasing) choice.changed[EFFECT_ANTIALIAS] = true;
    if (flags.refine_cameras != "auto")
        choice.changed[EFFECT_CAMERAS] = flags.refine_cameras == "on";
    return choice;
}

// Before anything begins at the cameras or the points.
std::string adjusted_cameras(Dataset& dataset) {
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

}  // namespace

// The photos stay for the run where the plan had to look at them.
void plan_effects(Dataset& dataset, TrainFlags& flags, bool sees_photos) {
    if (sees_photos && (!dataset.points.seen_begin.empty() || dataset.has_alpha) &&
        flags.photos.empty())
        flags.photos = load_photos(dataset.views);
    const EffectPlan plan =
        plan_training(dataset, flags.photos, flags.train.sh_degree, training_choice(flags));
    apply_plan(plan, flags.train);
    apply_plan(plan, dataset.views);
    const TrainOptions usual;
    if (flags.train.refine_cameras)
        flags.cameras_note = adjusted_cameras(dataset);
    else if (flags.train.camera_lr || flags.train.camera_from != usual.camera_from ||
             flags.train.camera_anchor != usual.camera_anchor)
        say_note(
            "note: --camera-lr, --camera-from and --camera-anchor are not used: cameras are "
            "refined "
            "with --refine-cameras on");
    if (!flags.train.depth && flags.train.depth_weight != usual.depth_weight)
        say_note(
            "note: --depth-weight is not used: measured depths are compared with --effects +depth");
    flags.run.effects = plan_line(plan);
    flags.run.effects_json =
        plan_json(plan).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

bool starts_from_stereo(const Dataset& dataset, const TrainFlags& flags) {
    if (!flags.run.resume_from.empty()) return false;
    return flags.train.start == StartPoints::dense ||
           (flags.schedule != "3dgs" && lacks_points(dataset, flags.train));
}

namespace {

void find_start(Device& device, Dataset& dataset, TrainFlags& flags) {
    if (flags.photos.empty()) flags.photos = load_photos(dataset.views);
    say_note("start: stereo between the photos, about a second of a core for each");
    const bool opaque = !flags.train.alpha && dataset.has_alpha;
    DenseStart start = dense_start(
        device, dataset, opaque ? photos_of_run(dataset, flags.train, flags.photos) : flags.photos,
        flags.train.seed);
    if (flags.train.start == StartPoints::automatic && start.on_surfaces < kLeastOnSurfaces) {
        flags.start_note =
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
    flags.start_note = fmt::format(
        "start: dense, {} points on surfaces and {} of the data set, in {:.1f} s; "
        "photos agree on {:.0f} % of their pixels",
        start.on_surfaces, start.cloud.size() - start.on_surfaces, start.seconds,
        100 * start.agreeing);
    dataset.start = start.cloud;
    flags.run.write_start = [start =
                                 std::move(start)](const std::filesystem::path& folder) mutable {
        write_dense_start(start, folder);
        start = {};  // it holds every photo
    };
}

}  // namespace

void plan_start(Device& device, Dataset& dataset, TrainFlags& flags) {
    if (flags.train.start == StartPoints::points && dataset.points.size() == 0)
        throw Error(dataset.root.string(), "has no points for --start points",
                    "Use --start dense or --start random.");
    if (starts_from_stereo(dataset, flags)) find_start(device, dataset, flags);
}

void plan_strategy(Dataset& dataset, TrainFlags& flags) {
    TrainOptions& t = flags.train;
    if (dataset.detail.opaque == 0) dataset.detail = photo_detail(dataset.views);
    if (!strategy_row(t.strategy).grows_to_limit) return;
    const bool given = t.max_splats.has_value();
    if (!given) t.max_splats = default_budget(dataset, t);
    flags.strategy_note =
        fmt::format("strategy: {}, up to {} splats{}", strategy_name(t.strategy), *t.max_splats,
                    given ? ""
                          : fmt::format(", what {} is forecast to end with; --budget sets another "
                                        "count",
                                        strategy_name(Strategy{})));
}

}  // namespace darb
