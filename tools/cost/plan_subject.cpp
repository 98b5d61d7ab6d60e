// SPDX-License-Identifier: MIT
#include "tools/cost/plan_subject.h"

#include <fmt/format.h>
#include <algorithm>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/data/camera_list.h"
#include "engine/gpu/device.h"
#include "engine/scene/camera.h"
#include "engine/scene/subject.h"
#include "trainer/job/scene_file.h"

namespace darb {

namespace {

bool distorted(const Dataset& dataset) {
    return std::ranges::any_of(
        dataset.views, [](const View& v) { return v.lens.distorted() && !v.lens.panorama(); });
}

// A data set as loaded may have straightened photos.
Dataset through_the_lens(const PlanRequest& request) {
    DatasetOptions original = request.data;
    original.original_lens = true;
    return load_dataset(request.what, original);
}

}  // namespace

PlanSubject open_subject(const PlanRequest& request) {
    PlanSubject s;
    s.training = !is_scene(request.what);
    const auto refuse = [&](bool given, const char* flag) {
        if (given)
            throw Error(fmt::format("darb plan {} {}", request.what.string(), flag),
                        s.training ? "is for a scene, and this is a data set"
                                   : "is for a data set, and this is a scene",
                        "Leave it out.");
    };
    if (s.training) {
        refuse(request.depth, "--depth");
        refuse(!request.cameras.empty(), "--cameras");
        s.dataset = load_dataset(request.what, request.data);
        say_notes(s.dataset.notes);
        if (!s.dataset.points.seen_begin.empty() || s.dataset.has_alpha)
            s.photos = load_photos(s.dataset.views);
        return s;
    }
    refuse(request.sh_degree.has_value(), "--sh-degree");
    refuse(request.kernel.has_value(), "--kernel");
    s.model = load_scene(request.what, nullptr, request.units);
    if (request.cameras.empty()) return s;
    std::vector<std::string> notes;
    s.views = load_cameras(request.cameras, request.data, &notes);
    say_notes(notes);
    return s;
}

int degree_of(const PlanSubject& s, const PlanRequest& request) {
    return s.training ? request.sh_degree.value_or(TrainOptions{}.sh_degree) : s.model.sh_degree;
}

EffectPlan plan_of(const PlanSubject& s, const PlanRequest& request, const EffectChoice& choice) {
    return s.training ? plan_training(s.dataset, s.photos, degree_of(s, request), choice)
                      : plan_rendering(s.model, s.views, {.depth = request.depth}, choice);
}

std::vector<int> switchable_effects(const PlanSubject& s, const PlanRequest& request) {
    const std::vector<int> impossible =
        impossible_effects(s.training ? EffectUse::training : EffectUse::pictures);
    const auto has = [&](int effect) {
        if (effect == EFFECT_VIEW_COLOUR) return degree_of(s, request) > 0;
        if (effect == EFFECT_DEPTH && s.training)
            return std::ranges::any_of(s.dataset.views,
                                       [](const View& view) { return !view.depth.empty(); });
        if (effect == EFFECT_SHUTTER)
            return std::ranges::any_of(s.training ? s.dataset.views : s.views,
                                       [](const View& view) { return view.camera.shutter.active; });
        if (effect == EFFECT_LENS) return !s.training || distorted(s.dataset);
        return std::find(impossible.begin(), impossible.end(), effect) == impossible.end();
    };
    std::vector<int> effects;
    for (int e = 0; e < EFFECT_COUNT; ++e)
        if (has(e)) effects.push_back(e);
    return effects;
}

Dataset planned_dataset(const PlanSubject& s, const PlanRequest& request, const EffectPlan& plan) {
    return plan.on(EFFECT_LENS) && distorted(s.dataset) ? through_the_lens(request) : s.dataset;
}

Measured measure_subject(const PlanSubject& s, const PlanRequest& request, const EffectPlan& plan) {
    DeviceOptions device = command_device(request.device);
    if (s.training) {
        TrainOptions train;
        train.kernel = request.kernel.value_or(train.kernel);
        return measure_training(device, planned_dataset(s, request, plan), train, plan);
    }
    std::vector<View> views = s.views;
    if (views.empty())
        for (const Camera& camera : orbit_views(s.model, 4, 640, 480).cameras)
            views.emplace_back().camera = camera;
    return measure_rendering(device, s.model, views, plan);
}

CostViews dataset_views(const Dataset& dataset, size_t most) {
    std::vector<View> all = held_out_views(dataset.views);
    if (all.empty()) all = dataset.views;
    const auto in_arc = [](const View& view) { return view.in_arc; };
    if (!std::all_of(all.begin(), all.end(), in_arc)) std::erase_if(all, in_arc);
    CostViews views;
    views.alpha_is_mask = dataset.alpha_is_mask;
    const size_t count = std::min(most, all.size());
    for (size_t i = 0; i < count; ++i) {
        const View& view = all[i * all.size() / count];
        views.cameras.push_back(view.camera);
        views.names.push_back(view.name);
        views.photos.push_back(load_photo(view));
    }
    return views;
}

CostViews orbit_views(const SplatModel& model, int count, int width, int height) {
    CostViews views;
    views.cameras = orbit_cameras(model, count, width, height);
    for (int v = 0; v < count; ++v) views.names.push_back(fmt::format("orbit {}", v + 1));
    return views;
}

}  // namespace darb
