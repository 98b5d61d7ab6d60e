#include "tools/darb/plan_subject.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"
#include "engine/kernels/kernel_family.h"
#include "engine/kernels/shaped_kernel.h"
#include "tools/cost/views.h"
#include "tools/darb/device_options.h"
#include "tools/darb/effect_flags.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/scene_file.h"

namespace darb {

namespace {

int kernel_of(const PlanFlags& flags) {
    return chosen_kernel(flags.kernel).value_or(TrainOptions{}.kernel);
}

bool distorted(const Dataset& dataset) {
    return std::ranges::any_of(dataset.views, [](const View& v) { return v.lens.distorted(); });
}

// As loaded, photos may have been straightened.
Dataset through_the_lens(const PlanFlags& flags) {
    DatasetOptions original = flags.data;
    original.original_lens = true;
    return load_dataset(flags.what, original);
}

}  // namespace

PlanSubject open_subject(const PlanFlags& flags) {
    kernel_of(flags);  // a bad name fails before any reading
    PlanSubject s;
    s.training = !is_scene(flags.what);
    const auto refuse = [&](bool given, const char* flag) {
        if (given)
            throw Error(fmt::format("darb plan {} {}", flags.what.string(), flag),
                        s.training ? "is for a scene, and this is a data set"
                                   : "is for a data set, and this is a scene",
                        "Leave it out.");
    };
    if (s.training) {
        refuse(flags.depth, "--depth");
        refuse(!flags.cameras.empty(), "--cameras");
        s.dataset = load_dataset(flags.what, flags.data);
        print_notes(s.dataset.notes);
        if (!s.dataset.points.seen_begin.empty() || s.dataset.has_alpha)
            s.photos = load_photos(s.dataset.views);
        return s;
    }
    refuse(flags.sh_degree.has_value(), "--sh-degree");
    refuse(!flags.kernel.kernel.empty(), "--kernel");
    refuse(!flags.kernel.files.empty(), "--kernel-file");
    refuse(flags.probe, "--probe");
    s.model = load_scene(flags.what, nullptr, flags.units);
    if (!flags.cameras.empty()) s.views = open_cameras(flags.cameras, flags.data);
    return s;
}

int degree_of(const PlanSubject& s, const PlanFlags& flags) {
    return s.training ? flags.sh_degree.value_or(TrainOptions{}.sh_degree) : s.model.sh_degree;
}

EffectPlan plan_of(const PlanSubject& s, const PlanFlags& flags, const EffectChoice& choice) {
    return s.training ? plan_training(s.dataset, s.photos, degree_of(s, flags), choice)
                      : plan_rendering(s.model, s.views, {.depth = flags.depth}, choice);
}

std::vector<int> switchable_effects(const PlanSubject& s, const PlanFlags& flags) {
    const std::vector<int> impossible =
        impossible_effects(s.training ? EffectUse::training : EffectUse::pictures);
    const auto has = [&](int effect) {
        if (effect == EFFECT_VIEW_COLOUR) return degree_of(s, flags) > 0;
        if (effect == EFFECT_DEPTH && s.training)
            return std::ranges::any_of(s.dataset.views,
                                       [](const View& view) { return !view.depth.empty(); });
        if (effect == EFFECT_LENS) return !s.training || distorted(s.dataset);
        return std::find(impossible.begin(), impossible.end(), effect) == impossible.end();
    };
    std::vector<int> effects;
    for (int e = 0; e < EFFECT_COUNT; ++e)
        if (has(e)) effects.push_back(e);
    return effects;
}

namespace {

TrainOptions probed_options(const PlanFlags& flags) {
    TrainOptions train;
    train.kernel = kernel_of(flags);
    train.iterations = flags.probe_iterations;
    return train;
}

Dataset probed_set(const PlanSubject& s, const PlanFlags& flags, const EffectPlan& plan) {
    return plan.on(EFFECT_LENS) && distorted(s.dataset) ? through_the_lens(flags) : s.dataset;
}

}  // namespace

AntialiasProbe probe_subject(const PlanSubject& s, const PlanFlags& flags, const EffectPlan& plan) {
    return probe_antialias(command_device(flags.device), probed_set(s, flags, plan),
                           probed_options(flags), plan);
}

std::vector<Trial> try_on_subject(const PlanSubject& s, const PlanFlags& flags,
                                  const EffectPlan& plan) {
    const TrainOptions options = probed_options(flags);
    TrainOptions planned = options;
    apply_plan(plan, planned);
    const bool shapes = kernel_has_shape(options.kernel), tones = planned.exposure;
    std::vector<Trial> trials;
    if (!shapes && !tones) return trials;
    const DeviceOptions device = command_device(flags.device);
    const Dataset dataset = probed_set(s, flags, plan);
    if (shapes) trials.push_back(try_shape(device, dataset, options, plan));
    if (tones) trials.push_back(try_exposure_grid(device, dataset, options, plan));
    return trials;
}

Measured measure_subject(const PlanSubject& s, const PlanFlags& flags, const EffectPlan& plan) {
    DeviceOptions device = command_device(flags.device);
    if (s.training) {
        TrainOptions train;
        train.kernel = kernel_of(flags);
        if (plan.on(EFFECT_LENS) && distorted(s.dataset))
            return measure_training(device, through_the_lens(flags), train, plan);
        return measure_training(device, s.dataset, train, plan);
    }
    std::vector<View> views = s.views;
    if (views.empty())
        for (const Camera& camera : orbit_views(s.model, 4, 640, 480).cameras)
            views.emplace_back().camera = camera;
    return measure_rendering(device, s.model, views, plan);
}

}  // namespace darb
