#include "tools/darb/plan_probe.h"

#include <fmt/format.h>

#include <functional>

#include "engine/core/error.h"
#include "engine/kernels/kernel_family.h"
#include "tools/darb/probe_arms.h"
#include "tools/darb/scene_evaluation.h"
#include "tools/darb/tune_flags.h"
#include "tools/paper/compare_stats.h"
#include "trainer/growth/initial_model.h"
#include "trainer/job/job.h"

namespace darb {

namespace {

constexpr double kScales[] = {0.5, 1, 2, 4};

/// The data set with photos set aside.
Dataset probed_dataset(const Dataset& source, const EffectPlan& plan) {
    Dataset dataset = source;
    mark_held_out(dataset.views, {});
    apply_plan(plan, dataset.views);
    const std::size_t held_out = held_out_views(dataset.views).size();
    if (held_out == 0 || held_out == dataset.views.size())
        throw Error(source.root.string(), "has no photos both to train on and to hold out",
                    "Leave out --probe.");
    return dataset;
}

SceneEvaluation evaluation_of(const Dataset& dataset, const TrainOptions& run) {
    SceneEvaluation evaluation;
    evaluation.alpha_is_mask = dataset.alpha_is_mask;
    evaluation.background = glm::vec3(run.white_background ? 1.0f : 0.0f);
    return evaluation;
}

}  // namespace

namespace {

/// Both ways, which prepare() makes of the options that the plan leaves.
Trial run_trial(const DeviceOptions& device_options, const Dataset& source,
                const TrainOptions& options, const EffectPlan& plan, Trial trial,
                const std::function<void(TrainOptions& usual, TrainOptions& tried)>& prepare,
                bool fit_exposure) {
    Dataset dataset = probed_dataset(source, plan);
    Device device(device_options);
    settle_tuning(device);
    const std::vector<ImageU8> photos = load_photos(dataset.views);
    TrainOptions tried = options;
    apply_plan(plan, tried);
    find_lacking_points(device, photos, tried, dataset);
    TrainOptions usual = tried;
    prepare(usual, tried);
    const std::vector<View> views = held_out_views(dataset.views);
    SceneEvaluation evaluation = evaluation_of(dataset, tried);
    evaluation.fit_exposure = fit_exposure;
    const std::vector<Arm> arms = train_arms(device, dataset, photos, {usual, tried});
    const auto psnr_db = [&](const Arm& arm) {
        return evaluate_scene(device, arm.model, views, evaluation).psnr_db;
    };
    trial.iterations = tried.iterations;
    trial.usual_run = arms[0].run;
    trial.tried_run = arms[1].run;
    trial.price = price_of(arms[0], arms[1]);
    trial.usual_db = psnr_db(arms[0]);
    trial.tried_db = psnr_db(arms[1]);
    return trial;
}

}  // namespace

Trial try_shape(const DeviceOptions& device, const Dataset& dataset, const TrainOptions& options,
                const EffectPlan& plan) {
    const auto named = [](int kernel) { return fmt::format("--kernel {}", kernel_name(kernel)); };
    return run_trial(
        device, dataset, options, plan, {named(options.kernel), named(KERNEL_GAUSSIAN)},
        [](TrainOptions& usual, TrainOptions&) { usual.kernel = KERNEL_GAUSSIAN; }, false);
}

Trial try_exposure_grid(const DeviceOptions& device, const Dataset& dataset,
                        const TrainOptions& options, const EffectPlan& plan) {
    return run_trial(
        device, dataset, options, plan, {"--exposure-grid", "one map of colours a photo"},
        [](TrainOptions&, TrainOptions& tried) { tried.exposure_grid = true; }, true);
}

AntialiasProbe probe_antialias(const DeviceOptions& device_options, const Dataset& source,
                               const TrainOptions& options, const EffectPlan& plan) {
    Dataset dataset = probed_dataset(source, plan);
    const std::vector<View> held_out = held_out_views(dataset.views);
    Device device(device_options);
    settle_tuning(device);
    const std::vector<ImageU8> photos = load_photos(dataset.views);
    TrainOptions run = options;
    apply_plan(plan, run);
    find_lacking_points(device, photos, run, dataset);
    TrainOptions plain = run;
    plain.antialias = false;
    run.antialias = true;
    const std::vector<Arm> arms = train_arms(device, dataset, photos, {plain, run});
    const Arm &without = arms[0], &with = arms[1];
    AntialiasProbe probe{run.iterations, without.run, with.run, {}};
    const SceneEvaluation evaluation = evaluation_of(dataset, run);
    for (const double scale : kScales) {
        if (!photos_reach(held_out, scale)) continue;
        const std::vector<View> views = scaled_views(held_out, scale);
        const auto psnr_db = [&](const SplatModel& model) {
            return evaluate_scene(device, model, views, evaluation).psnr_db;
        };
        const Camera& camera = views.front().camera;
        probe.sizes.push_back(
            {scale, camera.width, camera.height, psnr_db(without.model), psnr_db(with.model)});
    }
    return probe;
}

}  // namespace darb
