// SPDX-License-Identifier: MIT
#include "engine/plan/effect_plan.h"

#include <fmt/format.h>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/on_threads.h"
#include "engine/core/quantile.h"
#include "engine/data/lens_model.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/raster/frame_view.h"
#include "engine/scene/edit_splats.h"
#include "shaders/shared/render_args.h"

namespace darb {

/// Near-plane care for pictures of a model through these cameras. O(splats times cameras), on all
/// cores. near_plane: world units; splats before it take no part.
EffectRow near_rule(const SplatModel& model, const std::vector<View>& views, float near_plane);

namespace {

constexpr std::string_view kNames[] = {EFFECT_NAMES};
static_assert(std::size(kNames) == EFFECT_COUNT);

std::string all_names() {
    std::string text;
    for (const std::string_view name : kNames) text += fmt::format(" {}", name);
    return text;
}

}  // namespace

std::string_view effect_name(int effect) {
    return kNames[effect];
}

std::optional<int> effect_from_name(std::string_view name) {
    for (int e = 0; e < EFFECT_COUNT; ++e)
        if (kNames[e] == name) return e;
    return std::nullopt;
}

EffectChoice parse_effects(std::string_view text) {
    EffectChoice choice;
    const std::string where = fmt::format("--effects {}", text);
    const std::string hint =
        "Use auto, all, none, or changes like +exposure,-sh or all,-lens; the effects are" +
        all_names() + ".";
    if (text.empty()) throw Error(where, "names no effect", hint);
    for (std::size_t at = 0; at <= text.size();) {
        const std::size_t end = std::min(text.find(',', at), text.size());
        const std::string_view word = text.substr(at, end - at);
        const bool first = at == 0;
        at = end + 1;
        if (first && (word == "auto" || word == "all" || word == "none")) {
            if (word == "all") choice.base = EffectChoice::Base::all;
            if (word == "none") choice.base = EffectChoice::Base::none;
            continue;
        }
        const bool sign = !word.empty() && (word[0] == '+' || word[0] == '-');
        const auto effect = sign ? effect_from_name(word.substr(1)) : std::nullopt;
        if (!effect)
            throw Error(where,
                        effect_from_name(word)
                            ? fmt::format("'{0}' needs a sign: +{0} or -{0}", word)
                            : fmt::format("'{}' is no effect", word),
                        hint);
        choice.changed[static_cast<std::size_t>(*effect)] = word[0] == '+';
    }
    return choice;
}

std::optional<bool> effect_in_words(std::string_view text, std::string_view effect) {
    const auto id = effect_from_name(effect);
    return id ? parse_effects(text).changed[static_cast<std::size_t>(*id)] : std::nullopt;
}

bool words_refuse_effect(std::string_view text, std::string_view effect) {
    const EffectChoice choice = parse_effects(text);
    return !effect_in_words(text, effect).value_or(choice.base != EffectChoice::Base::none);
}

EffectChoice choose_effects(const std::string& text, EffectUse use, DatasetOptions& data) {
    const EffectChoice choice = parse_effects(text);
    for (const int effect : impossible_effects(use))
        if (choice.changed[static_cast<std::size_t>(effect)].value_or(false))
            throw Error(
                "--effects " + text,
                fmt::format("'{}' is nothing that this command can do", effect_name(effect)),
                fmt::format("Leave +{} out.", effect_name(effect)));
    if (choice.changed[EFFECT_LENS].value_or(choice.base != EffectChoice::Base::none))
        return choice;
    if (data.original_lens)
        throw Error("--effects " + text, "drops the lens that --lens original keeps",
                    "Leave --lens out, or keep the effect with +lens.");
    data.original_where_wide = false;
    return choice;
}

ProjectionEffects EffectPlan::projection() const {
    ProjectionEffects effects;
    for (const ProjectionSwitch& s : kProjectionSwitches)
        effects.*s.on = s.effect != kNoEffect && on(s.effect);
    effects.off_centre |= effects.lens || on(EFFECT_CAMERAS);  // principal points move
    return effects;
}

void EffectPlan::note_frame(std::uint32_t huge_splats, std::uint32_t longest_list) {
    EffectRow& huge = row(EFFECT_HUGE);
    most_huge_ = std::max(most_huge_, huge_splats);
    longest_list_ = std::max(longest_list_, longest_list);
    const bool needed = most_huge_ > 0 || longest_list_ > LIST_SEGMENT;
    huge.measured = most_huge_;
    const std::string counters = fmt::format(
        "{} splats of a frame over more than {} tiles, longest list {} of {} intersections",
        most_huge_, HUGE_INTERSECTIONS, longest_list_, LIST_SEGMENT);
    huge.reason = huge.overridden ? "--effects; the counters: " + counters : counters;
    if (!huge.overridden) huge.on = needed;
}

void apply_plan(const EffectPlan& plan, SplatModel& model) {
    model.antialias = plan.on(EFFECT_ANTIALIAS);
    limit_sh_degree(plan.row(EFFECT_VIEW_COLOUR).degree, model);
}

void apply_plan(const EffectPlan& plan, std::vector<View>& views) {
    for (View& view : views) {
        if (!plan.on(EFFECT_LENS)) view.camera.lens = {};
        if (!plan.on(EFFECT_SHUTTER)) view.camera.shutter = {};
        // What was asked for may have to be found: training and alignment begin at a still camera.
        view.camera.shutter.active |=
            plan.on(EFFECT_SHUTTER) && plan.row(EFFECT_SHUTTER).overridden;
    }
}

std::string plan_line(const EffectPlan& plan) {
    std::string text;
    for (int e = 0; e < EFFECT_COUNT; ++e) {
        const EffectRow& row = plan.row(e);
        if (!row.on) continue;
        text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", effect_name(e), row.reason);
    }
    return text.empty() ? "none is called for" : text;
}

// The rules of the effect plan: when a scene or a data set calls for an effect, by numbers measured
// on it.

namespace {

constexpr double kColourStep = 1.0 / 512;  // half of an 8-bit step
// A shift by it moves a value of a step from 0 to 1, the steepest there is, by 1/40 of an 8-bit
// step.
constexpr double kCentreStep_px = 1e-4;
// Largest pixel footprint of a point over its smallest, for the reason alone: above it pictures of
// the trained size gain by anti-aliasing, below it those of other sizes do.
constexpr double kFootprintRatio = 2.5;
constexpr double kFootprintShare = 0.05;  // share of the points that must exceed the ratio
// Exposures are off in evaluation, and those of neighbouring photos drift together: on a plush toy
// whose gains spread by 2 % they cost 2.8 dB on held-out views.
constexpr double kGainSpread = 0.05;
constexpr std::size_t kGainViews = 3;              // photos that must see a point
constexpr std::size_t kGainPoints = 20;            // points that a photo must have
constexpr double kDarkest = 10, kBrightest = 245;  // out of 255; sensors are linear in between

/// The largest change of a colour that band l of a splat can make over all directions:
/// |sum c_m Y_m| <= |c| sqrt(sum Y_m^2), and sum Y_m^2 = (2 l + 1) / 4 pi.
double band_bound(const SplatModel& model, std::size_t splat, int band) {
    const auto stored = static_cast<std::size_t>(model.rest_count());
    const std::size_t first = static_cast<std::size_t>(band * band - 1);
    const std::size_t last = static_cast<std::size_t>((band + 1) * (band + 1) - 1);
    double most = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        double sum = 0;
        for (std::size_t k = first; k < last; ++k) {
            const double value = model.sh_rest[splat * stored + k * 3 + c];
            sum += value * value;
        }
        most = std::max(most, sum);
    }
    return std::sqrt(most * (2 * band + 1) / (4 * 3.14159265358979));
}

EffectRow colour_rule(const SplatModel& model) {
    EffectRow row;
    double dropped = 0;  // the largest change by the bands above row.degree
    for (std::size_t i = 0; i < model.size(); ++i) {
        double above = 0;
        for (int band = model.sh_degree; band > 0; --band) {
            above += band_bound(model, i, band);
            if (above < kColourStep) continue;
            row.degree = std::max(row.degree, band);
            row.measured = std::max(row.measured, above);
            break;
        }
        dropped = std::max(dropped, above < kColourStep ? above : 0.0);
    }
    row.on = row.degree > 0;
    row.reason = row.on ? fmt::format("degree {}: a colour changes by up to {:.3f} with the view",
                                      row.degree, row.measured)
                        : fmt::format(
                              "no colour changes by more than {:.4f} with the view, "
                              "limit 1/512",
                              dropped);
    if (!row.on) row.measured = dropped;
    return row;
}

EffectRow centre_rule(const std::vector<View>& views) {
    EffectRow row;
    for (const View& view : views) {
        const Camera& c = view.camera;
        row.measured = std::max(
            {row.measured, std::abs(c.cx - 0.5 * c.width), std::abs(c.cy - 0.5 * c.height)});
    }
    row.on = row.measured > kCentreStep_px;
    row.reason = views.empty()
                     ? "no cameras are named"
                     : fmt::format("the principal point is off by {:.4f} px at most", row.measured);
    return row;
}

EffectRow lens_rule(const std::vector<View>& views) {
    EffectRow row;
    std::size_t lenses = 0, distorted = 0, wide = 0, faces = 0;
    for (const View& view : views) {
        lenses += view.camera.lens.active ? 1 : 0;
        faces += view.face >= 0 ? 1 : 0;
        distorted += view.lens.distorted() && view.face < 0 ? 1 : 0;
        wide += too_wide_to_undistort(view.lens) ? 1 : 0;
    }
    std::string too_wide =
        wide > 0 ? fmt::format("; {} see more than 60 degrees to a side", wide) : "";
    if (faces > 0) too_wide += fmt::format("; {} are faces of panoramas", faces);
    row.on = lenses > 0;
    row.measured = static_cast<double>(lenses);
    row.reason = "no cameras are named";
    if (views.empty()) return row;
    row.reason =
        row.on ? fmt::format("{} of {} cameras keep their original lens{}", lenses, views.size(),
                             too_wide)
               : fmt::format("{} of {} photos are distorted and are straightened once, at load{}",
                             distorted, views.size(), too_wide);
    return row;
}

EffectRow shutter_rule(const std::vector<View>& views) {
    EffectRow row;
    std::size_t rolling = 0;
    for (const View& view : views) {
        const Camera& c = view.camera;
        if (!c.shutter.active) continue;
        ++rolling;
        row.measured = std::max(row.measured, std::max(c.fx, c.fy) * glm::length(c.shutter.turn));
    }
    row.on = rolling > 0;
    row.reason = views.empty() ? "no cameras are named"
                 : row.on      ? fmt::format(
                                     "the rows of {} of {} photos are exposed one after the other, "
                                          "while cameras turn by up to {:.1f} px",
                                     rolling, views.size(), row.measured)
                          : "no file says that rows are exposed one after the other";
    return row;
}

/// Where cameras are refined, motion that no file has can be found: a probe decides, unless the
/// command line does.
void try_shutter(const Dataset& dataset, const EffectChoice& choice, EffectPlan& plan) {
    EffectRow& row = plan.row(EFFECT_SHUTTER);
    const bool has_faces =
        std::ranges::any_of(dataset.views, [](const View& view) { return view.face >= 0; });
    row.tried = plan.on(EFFECT_CAMERAS) && !row.on && !has_faces &&
                choice.base != EffectChoice::Base::none && !choice.changed[EFFECT_SHUTTER];
    if (row.tried) row.reason += "; as cameras are refined, a probe on photos set aside decides";
}

/// Depth of a point over the focal length, where the view sees it: the world's size of a pixel.
std::optional<double> footprint(const Camera& camera, const double* point) {
    const glm::dvec3 p =
        camera.rotation * glm::dvec3(point[0], point[1], point[2]) + camera.translation;
    if (!(p.z > 0)) return std::nullopt;
    const double x = camera.fx * p.x / p.z + camera.cx, y = camera.fy * p.y / p.z + camera.cy;
    if (!(x >= 0 && y >= 0 && x <= camera.width && y <= camera.height)) return std::nullopt;
    return p.z / std::max(camera.fx, camera.fy);
}

// With points, the data sets gained by anti-aliasing in the mean over 1/2, 1, 2 and 4 times the
// trained size, and lost at most 0.5 dB at that size. Without points they lost 1 dB and more
// (docs/experiments).
EffectRow antialias_rule(const Dataset& dataset) {
    EffectRow row;
    std::size_t wide = 0;
    const PointCloud& points = dataset.points;
    for (std::size_t p = 0; p < points.size(); ++p) {
        double least = 1e300, most = 0;
        const auto see = [&](const View& view) {
            if (view.is_test) return;
            const auto size = footprint(view.camera, &points.position[3 * p]);
            if (!size) return;
            least = std::min(least, *size);
            most = std::max(most, *size);
        };
        if (points.seen_begin.empty()) {
            for (const View& view : dataset.views) see(view);
        } else {
            for (std::size_t k = points.seen_begin[p]; k < points.seen_begin[p + 1]; ++k)
                see(dataset.views[points.seen_by[k]]);
        }
        wide += most > kFootprintRatio * least ? 1 : 0;
    }
    row.measured = static_cast<double>(wide) / std::max<double>(1.0, double(points.size()));
    row.on = points.size() > 0;
    row.reason =
        !row.on ? "without points it costs too much at the trained size; darb plan --probe measures"
        : row.measured >= kFootprintShare
            ? fmt::format(
                  "{:.1f} % of the points are seen at pixel footprints that "
                  "differ by more than {}x",
                  100 * row.measured, kFootprintRatio)
            : "pictures of other sizes than the photos' gain; darb plan --probe measures";
    return row;
}

/// Mean of the colours around a point in a photo; nothing near the limits of the sensor.
std::optional<double> brightness(const View& view, const ImageU8& photo, const double* point) {
    constexpr int kReach = 2;  // px: 5 x 5
    if (!footprint(view.camera, point)) return std::nullopt;
    const Camera& c = view.camera;
    const glm::dvec3 p = c.rotation * glm::dvec3(point[0], point[1], point[2]) + c.translation;
    const int x0 = static_cast<int>(c.fx * p.x / p.z + c.cx);
    const int y0 = static_cast<int>(c.fy * p.y / p.z + c.cy);
    if (x0 < kReach || y0 < kReach || x0 + kReach >= photo.width || y0 + kReach >= photo.height)
        return std::nullopt;
    double sum = 0;
    for (int y = y0 - kReach; y <= y0 + kReach; ++y)
        for (int x = x0 - kReach; x <= x0 + kReach; ++x)
            for (int channel = 0; channel < 3; ++channel) sum += photo.at(x, y, channel);
    sum /= 75;
    if (!(sum > kDarkest && sum < kBrightest)) return std::nullopt;
    return sum;
}

/// Per photo, the median over its points of brightness here over the median brightness of the
/// point; empty where too few points say so.
std::vector<double> photo_gains(const Dataset& dataset, const std::vector<ImageU8>& photos) {
    const PointCloud& points = dataset.points;
    std::vector<std::vector<double>> ratios(dataset.views.size());
    std::vector<double> seen;
    std::vector<std::uint32_t> by;
    for (std::size_t p = 0; p < points.size(); ++p) {
        seen.clear();
        by.clear();
        for (std::size_t k = points.seen_begin[p]; k < points.seen_begin[p + 1]; ++k) {
            const std::uint32_t v = points.seen_by[k];
            const View& view = dataset.views[v];
            if (view.is_test || view.camera.lens.active) continue;
            if (const auto b = brightness(view, photos[v], &points.position[3 * p])) {
                seen.push_back(*b);
                by.push_back(v);
            }
        }
        if (seen.size() < kGainViews) continue;
        std::vector<double> sorted = seen;
        const double middle = nearest_rank(sorted, 0.5);
        for (std::size_t k = 0; k < seen.size(); ++k) ratios[by[k]].push_back(seen[k] / middle);
    }
    std::vector<double> gains;
    for (std::vector<double>& own : ratios)
        if (own.size() >= kGainPoints) gains.push_back(nearest_rank(own, 0.5));
    return gains;
}

EffectRow exposure_rule(const Dataset& dataset, const std::vector<ImageU8>& photos) {
    EffectRow row;
    if (dataset.points.seen_begin.empty() || photos.size() != dataset.views.size()) {
        row.reason = "the source does not say which photos see a point";
        return row;
    }
    std::vector<double> gains = photo_gains(dataset, photos);
    if (gains.size() < 2) {
        row.reason = "too few photos share points";
        return row;
    }
    // Robust: the middle half of the photos, scaled to the whole of a normal distribution's sigma.
    std::sort(gains.begin(), gains.end());
    const std::size_t quarter = gains.size() / 4;
    const double spread = gains[gains.size() - 1 - quarter] - gains[quarter];
    row.measured = spread / gains[gains.size() / 2] / 1.349;
    row.on = row.measured > kGainSpread;
    row.reason = fmt::format("gains of {} photos over shared points spread by {:.1f} %, limit 5 %",
                             gains.size(), 100 * row.measured);
    return row;
}

/// An alpha channel that is opaque everywhere is none. Without the pixels every one counts.
EffectRow alpha_rule(const Dataset& dataset, const std::vector<ImageU8>& photos) {
    EffectRow row;
    if (!dataset.has_alpha) {
        row.reason = "no photo has an alpha channel or a mask";
        return row;
    }
    if (photos.size() != dataset.views.size()) {
        row.on = true;
        row.reason = dataset.alpha_is_mask ? "there are masks, or gaps in straightened photos"
                                           : "photos have an alpha channel";
        return row;
    }
    std::size_t count = 0, training = 0;
    for (std::size_t v = 0; v < photos.size(); ++v) {
        if (dataset.views[v].is_test) continue;
        ++training;
        const std::vector<std::uint8_t>& data = photos[v].data;
        bool opaque = true;
        for (std::size_t i = 3; i < data.size() && opaque; i += 4) opaque = data[i] == 255;
        count += opaque ? 0 : 1;
    }
    row.on = count > 0;
    row.measured = static_cast<double>(count);
    row.reason = fmt::format("{} of {} photos have pixels that are not opaque{}", count, training,
                             count > 0 && dataset.alpha_is_mask ? ", which are left out" : "");
    return row;
}

/// What they cost in PSNR depends on the sensor, so they are compared where somebody asks for it.
EffectRow depth_rule(const std::vector<View>& views) {
    EffectRow row;
    const auto count = std::ranges::count_if(
        views, [](const View& view) { return !view.is_test && !view.depth.empty(); });
    row.measured = static_cast<double>(count);
    row.reason = count > 0 ? fmt::format(
                                 "{} training photos have measured depths, which are "
                                 "compared with --effects +depth",
                                 count)
                           : "no training photo has a measured depth";
    return row;
}

/// Frames tell, see EffectPlan::note_frame.
EffectRow huge_rule() {
    EffectRow row;
    row.reason = "the counters of each frame decide on the next; none was drawn yet";
    return row;
}

/// What the command line says, on top of the rules. fixed: rows that `all` leaves alone.
void override_rows(const EffectChoice& choice, EffectPlan& plan, int most_degree,
                   std::initializer_list<int> fixed) {
    for (int e = 0; e < EFFECT_COUNT; ++e) {
        EffectRow& row = plan.row(e);
        std::optional<bool> wanted = choice.changed[static_cast<std::size_t>(e)];
        const bool is_fixed = std::find(fixed.begin(), fixed.end(), e) != fixed.end();
        if (!wanted && choice.base == EffectChoice::Base::none) wanted = false;
        if (!wanted && choice.base == EffectChoice::Base::all && !is_fixed) wanted = true;
        if (!wanted) continue;
        if (e == EFFECT_VIEW_COLOUR) {
            if (*wanted && most_degree == 0) continue;
            row.degree = *wanted ? most_degree : 0;
        }
        if (*wanted == row.on && e != EFFECT_VIEW_COLOUR && e != EFFECT_HUGE) continue;
        row.on = *wanted;
        row.overridden = true;
        row.reason = fmt::format("--effects; the rule: {}", row.reason);
    }
}

}  // namespace

std::vector<int> impossible_effects(EffectUse use) {
    switch (use) {
        case EffectUse::pictures:
            return {EFFECT_EXPOSURE, EFFECT_ALPHA, EFFECT_CAMERAS, EFFECT_SURFACE};
        case EffectUse::measuring:
            return {EFFECT_EXPOSURE, EFFECT_ALPHA, EFFECT_DEPTH, EFFECT_CAMERAS, EFFECT_SURFACE};
        default:
            return {};
    }
}

EffectPlan plan_rendering(const SplatModel& model, const std::vector<View>& views,
                          const RenderOutputs& outputs, const EffectChoice& choice) {
    EffectPlan plan;
    plan.row(EFFECT_VIEW_COLOUR) = colour_rule(model);
    plan.row(EFFECT_ANTIALIAS) = {
        model.antialias, false, 0, model.antialias ? 1.0 : 0.0,
        fmt::format("the file says SplatRenderMode {}", model.antialias ? "mip" : "default")};
    plan.row(EFFECT_EXPOSURE).reason = "of photos in training alone";
    plan.row(EFFECT_CAMERAS).reason = "of photos in training alone";
    plan.row(EFFECT_SURFACE).reason = "of training alone";
    plan.row(EFFECT_OFF_CENTRE) = centre_rule(views);
    plan.row(EFFECT_LENS) = lens_rule(views);
    plan.row(EFFECT_SHUTTER) = shutter_rule(views);
    plan.row(EFFECT_ALPHA).reason = "of photos alone; pictures are over the background";
    plan.row(EFFECT_DEPTH) = {outputs.depth, false, 0, outputs.depth ? 1.0 : 0.0,
                              outputs.depth ? "depth was asked for" : "no output asks for it"};
    plan.row(EFFECT_HUGE) = huge_rule();
    if (outputs.free_camera) {
        plan.row(EFFECT_NEAR) = {true, false, 0, 0, "the camera moves, a splat may lie beside it"};
        EffectRow& centre = plan.row(EFFECT_OFF_CENTRE);
        if (!centre.on) centre = {true, false, 0, 0, "a free camera may look past a panel"};
    } else {
        plan.row(EFFECT_NEAR) = near_rule(model, views, outputs.near_plane);
    }
    override_rows(choice, plan, model.sh_degree,
                  {EFFECT_ANTIALIAS, EFFECT_EXPOSURE, EFFECT_ALPHA, EFFECT_DEPTH, EFFECT_CAMERAS,
                   EFFECT_SURFACE, EFFECT_SHUTTER});
    return plan;
}

EffectPlan plan_training(const Dataset& dataset, const std::vector<ImageU8>& photos, int sh_degree,
                         const EffectChoice& choice) {
    EffectPlan plan;
    plan.row(EFFECT_VIEW_COLOUR) = {
        sh_degree > 0, false, sh_degree, 0,
        fmt::format("up to degree {}, once a probe on photos set aside gains by the first",
                    sh_degree)};
    plan.row(EFFECT_ANTIALIAS) = antialias_rule(dataset);
    plan.row(EFFECT_EXPOSURE) = exposure_rule(dataset, photos);
    plan.row(EFFECT_OFF_CENTRE) = centre_rule(dataset.views);
    plan.row(EFFECT_LENS) = lens_rule(dataset.views);
    plan.row(EFFECT_SHUTTER) = shutter_rule(dataset.views);
    plan.row(EFFECT_ALPHA) = alpha_rule(dataset, photos);
    plan.row(EFFECT_DEPTH) = depth_rule(dataset.views);
    plan.row(EFFECT_CAMERAS).reason = "off unless it is asked for: --refine-cameras on";
    plan.row(EFFECT_SURFACE).reason =
        "off unless it is asked for, with --effects +surface, as depths may cost PSNR";
    plan.row(EFFECT_HUGE) = huge_rule();
    plan.row(EFFECT_NEAR) = {true, false, 0, 0,
                             "splats move while they train, beside the cameras too"};
    override_rows(choice, plan, sh_degree,
                  {EFFECT_DEPTH, EFFECT_CAMERAS, EFFECT_SURFACE, EFFECT_SHUTTER});
    try_shutter(dataset, choice, plan);
    if (plan.on(EFFECT_DEPTH) && plan.row(EFFECT_DEPTH).measured == 0)
        throw Error("--effects with depth", "no training photo has a measured depth",
                    "Put depths/NAME.png or .npy beside the photos, or leave +depth out.");
    return plan;
}

// Near-plane care: the rule that says when the Jacobian must be clamped. Near the plane of a camera
// the projection's Jacobian grows without bound to the side, and the affine picture of a splat
// beside the view fans out over it; so x/z and y/z are clamped to the picture and a margin. Where
// no splat beyond the margin can touch a picture by its own reach, the clamp changes no bit.

namespace {

constexpr double kSmallestCutoff = 1.0 / 1024;  // least cut-off of any accuracy: the longest reach
constexpr double kSlack = 1.02, kSlack_px = 1;  // allows for the rounding of float32
// Beyond so many splats times cameras the rule would take seconds; then the clamp stays.
constexpr std::uint64_t kMostProjections = 100'000'000;

struct Ball {
    glm::dvec3 centre;     // world
    double reach2;         // Mahalanobis
    double deviation = 0;  // the largest, world
};

Ball ball_of(const SplatModel& model, std::size_t i) {
    const float* p = &model.position[3 * i];
    const float* s = &model.log_scale[3 * i];
    Ball ball;
    ball.centre = glm::dvec3(p[0], p[1], p[2]) + model.origin;
    const double logit =
        std::clamp(double{model.opacity_logit[i]}, -OPACITY_LOGIT_LIMIT, OPACITY_LOGIT_LIMIT);
    const double opacity = sigmoid(logit), support = kernel_support(model.kernel);
    const double exponent =
        kernel_has_shape(model.kernel)
            ? splat_exponent(model.kernel, model.footprint, double{model.shape[i]})
            : 0;
    const double unbounded =
        kernel_has_shape(model.kernel)
            ? shaped_kernel(model.kernel).reach(model.footprint, exponent, opacity, kSmallestCutoff)
            : 2 * std::log(opacity / kSmallestCutoff);
    ball.reach2 = opacity > kSmallestCutoff ? (std::isfinite(support) ? support : unbounded) : 0;
    const double largest =
        std::clamp(double{std::max({s[0], s[1], s[2]})}, -LOG_SCALE_LIMIT, LOG_SCALE_LIMIT);
    const double psi = kernel_has_shape(model.kernel)
                           ? shaped_kernel(model.kernel).covariance_scale(model.footprint, exponent)
                           : covariance_scale(model.kernel, model.footprint);
    ball.deviation = std::exp(largest) * std::sqrt(psi);
    return ball;
}

// x or y of a camera: focal length and centre in px, the clamp's limits of the ratio, the size.
struct Axis {
    double focal, centre, low, high;
    int pixels;
};

// One axis: whether [-extent, extent] around the projected centre meets the picture. The row of the
// Jacobian is f/z (1, 0, -ratio), its length bounds what the covariance becomes. The clamped ratio
// is the larger one where the picture lies far off the axis, so that it counts too.
bool meets(const Axis& axis, double z, double ratio, const Ball& ball) {
    const double along = ball.deviation * axis.focal / z;
    const double steepest =
        std::max(std::abs(ratio), std::abs(std::clamp(ratio, axis.low, axis.high)));
    const double variance = along * along * (1 + steepest * steepest) + LOW_PASS_DEFAULT;
    const double extent = kSlack * std::sqrt(ball.reach2 * variance) + kSlack_px;
    const double at = axis.focal * ratio + axis.centre;
    return at + extent >= 0 && at - extent <= axis.pixels + TILE_SIZE;
}

bool needs_care(const Camera& camera, const gpu::CameraData& data, const Ball& ball, double near) {
    const glm::dvec3 p = camera.rotation * ball.centre + camera.translation;
    if (!(p.z > near * (1 - 1e-5))) return false;  // takes no part in the frame
    const double x = p.x / p.z, y = p.y / p.z;
    constexpr double kEdge = 1e-4;  // for rounding, and for principal points that count as centred
    const auto inside = [&](double ratio, double low, double high) {
        const double edge = kEdge * std::max(1.0, std::abs(ratio));
        return ratio > low + edge && ratio < high - edge;
    };
    if (inside(x, data.ratio_min.x, data.ratio_max.x) &&
        inside(y, data.ratio_min.y, data.ratio_max.y))
        return false;
    if (camera.lens.active) return true;  // its Jacobian has no such bound
    const glm::vec2 low = data.ratio_min, high = data.ratio_max;
    return meets({camera.fx, camera.cx, low.x, high.x, camera.width}, p.z, x, ball) &&
           meets({camera.fy, camera.cy, low.y, high.y, camera.height}, p.z, y, ball);
}

}  // namespace

EffectRow near_rule(const SplatModel& model, const std::vector<View>& views, float near_plane) {
    EffectRow row;
    if (model.size() == 0) {
        row.reason = "there are no splats";
        return row;
    }
    if (views.empty() || model.size() * views.size() > kMostProjections) {
        row.on = true;
        row.reason = views.empty() ? "no cameras are named: a splat may lie beside any"
                                   : "too many splats and cameras to look at each";
        return row;
    }
    std::vector<gpu::CameraData> data;
    for (const View& view : views) data.push_back(camera_data(view.camera, model.origin));
    const std::size_t threads = std::max(1u, std::thread::hardware_concurrency());
    std::vector<std::size_t> found(threads, 0);
    std::atomic<std::size_t> next{0};
    const auto look = [&] {
        std::size_t t = next++;
        for (; t < threads; t = next++)
            for (std::size_t i = t; i < model.size(); i += threads) {
                const Ball ball = ball_of(model, i);
                if (!(ball.reach2 > 0)) continue;
                bool needs = false;
                for (std::size_t v = 0; v < views.size() && !needs; ++v)
                    needs = needs_care(views[v].camera, data[v], ball, near_plane);
                found[t] += needs ? 1 : 0;
            }
    };
    on_threads(threads, look);
    std::size_t count = 0;
    for (const std::size_t n : found) count += n;
    row.measured = static_cast<double>(count);
    row.on = count > 0;
    row.reason = fmt::format("{} of {} splats beside a camera may reach into its picture", count,
                             model.size());
    return row;
}

namespace {

// Largest loss at the trained size. Short runs lose more there than long ones:
// docs/experiments/antialiasing.md.
constexpr double kMostLoss_db = 1;

}  // namespace

double AntialiasProbe::gain_db() const {
    double sum = 0;
    for (const ProbedSize& size : sizes) sum += size.with_db - size.without_db;
    return sum / double(sizes.size());
}

bool AntialiasProbe::pays() const {
    for (const ProbedSize& size : sizes)
        if (size.scale == 1 && size.without_db - size.with_db > kMostLoss_db) return false;
    return gain_db() > 0;
}

void take_probe(const AntialiasProbe& probe, EffectPlan& plan) {
    EffectRow& row = plan.row(EFFECT_ANTIALIAS);
    std::string gains;
    for (const ProbedSize& size : probe.sizes)
        gains += fmt::format("{}{:+.2f} dB at {:g}x", gains.empty() ? "" : ", ",
                             size.with_db - size.without_db, size.scale);
    std::string reason = fmt::format("a probe: {}", gains);
    if (!probe.pays() && probe.gain_db() > 0)
        reason += fmt::format("; more than {} dB are lost at the trained size", kMostLoss_db);
    if (probe.sizes.back().scale <= 1)
        reason += "; the photos are no larger, a smaller -r would show more";
    if (row.overridden) {
        row.reason = fmt::format("--effects; {}", reason);
        return;
    }
    row = {probe.pays(), false, 0, probe.gain_db(), reason};
}

std::string Trial::advice() const {
    const std::string measured =
        fmt::format("{:+.2f} dB on held-out photos for {:+.0f} % of time", gain_db(), 100 * price);
    return pays() ? fmt::format("{}: train with {}", measured, tried)
                  : fmt::format("{}: stay with {}; less than {} dB may be chance", measured, usual,
                                kLeastGain_db);
}

}  // namespace darb
