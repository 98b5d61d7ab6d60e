#include "tools/darb/plan_subject.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"
#include "engine/data/camera_list.h"
#include "engine/kernels/kernel_family.h"
#include "tools/cost/views.h"
#include "tools/darb/scene_file.h"

namespace darb {

namespace {

int kernel_of(const PlanFlags& flags) {
    if (!flags.kernel) return TrainOptions{}.kernel;
    const auto kernel = kernel_from_name(*flags.kernel);
    if (!kernel)
        throw Error("--kernel " + *flags.kernel, "no such kernel",
                    "See `darb train --help` for their names.");
    return *kernel;
}

bool keeps_lens(const Dataset& dataset) {
    return std::ranges::any_of(dataset.views, [](const View& v) { return v.camera.lens.active; });
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
        if (!s.dataset.points.seen_begin.empty() || s.dataset.has_alpha)
            s.photos = load_photos(s.dataset.views);
        if (std::ranges::any_of(s.dataset.views,
                                [](const View& v) { return v.lens.distorted(); })) {
            DatasetOptions other = flags.data;
            other.original_where_wide = false;
            other.original_lens = !keeps_lens(s.dataset);
            s.other_lens = load_dataset(flags.what, other);
        }
        return s;
    }
    refuse(flags.sh_degree.has_value(), "--sh-degree");
    refuse(flags.kernel.has_value(), "--kernel");
    s.model = load_scene(flags.what);
    if (!flags.cameras.empty()) s.views = load_cameras(flags.cameras, flags.data);
    return s;
}

int degree_of(const PlanSubject& s, const PlanFlags& flags) {
    return s.training ? flags.sh_degree.value_or(TrainOptions{}.sh_degree) : s.model.sh_degree;
}

EffectPlan plan_of(const PlanSubject& s, const PlanFlags& flags, const EffectChoice& choice) {
    return s.training
               ? plan_training(s.dataset, s.photos, degree_of(s, flags), choice, kernel_of(flags))
               : plan_rendering(s.model, s.views, {.depth = flags.depth}, choice);
}

std::vector<int> switchable_effects(const PlanSubject& s, const PlanFlags& flags) {
    std::vector<int> effects;
    for (int e = 0; e < EFFECT_COUNT; ++e) {
        const bool has = e == EFFECT_VIEW_COLOUR ? degree_of(s, flags) > 0
                         : e == EFFECT_LENS      ? !s.training || s.other_lens.has_value()
                         : e == EFFECT_DEPTH
                             ? !s.training
                             : s.training || (e != EFFECT_EXPOSURE && e != EFFECT_ALPHA);
        if (has) effects.push_back(e);
    }
    return effects;
}

Measured measure_subject(const PlanSubject& s, const PlanFlags& flags, const EffectPlan& plan) {
    DeviceOptions device;
    device.select = flags.device;
    if (s.training) {
        TrainOptions train;
        train.kernel = kernel_of(flags);
        const bool other = s.other_lens && plan.on(EFFECT_LENS) != keeps_lens(s.dataset);
        return measure_training(device, other ? *s.other_lens : s.dataset, train, plan);
    }
    std::vector<View> views = s.views;
    if (views.empty())
        for (const Camera& camera : orbit_views(s.model, 4, 640, 480).cameras)
            views.emplace_back().camera = camera;
    return measure_rendering(device, s.model, views, plan);
}

}  // namespace darb
