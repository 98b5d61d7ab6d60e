#include "tools/darb/plan_probe.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "engine/core/error.h"
#include "tools/darb/effect_flags.h"
#include "tools/darb/scene_evaluation.h"
#include "tools/darb/tune_flags.h"
#include "tools/paper/compare_stats.h"
#include "trainer/initial_model.h"
#include "trainer/trainer.h"

namespace darb {

namespace {

constexpr double kScales[] = {0.5, 1, 2, 4};

struct Arm {
    ProbedRun run;
    SplatModel model;
};

Arm train_arm(Device& device, const Dataset& dataset, const std::vector<ImageU8>& photos,
              const TrainOptions& options) {
    const auto start = std::chrono::steady_clock::now();
    Trainer trainer(device, dataset, photos, initial_model(dataset, options), options);
    while (trainer.iteration() < options.iterations) trainer.step();
    trainer.drain();
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    Arm arm{{took.count(), 0}, trainer.model()};
    arm.run.splats = arm.model.size();
    return arm;
}

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

ShapeProbe probe_shape(const DeviceOptions& device_options, const Dataset& source,
                       const TrainOptions& options, const EffectPlan& plan) {
    const Dataset dataset = probed_dataset(source, plan);
    Device device(device_options);
    settle_tuning(device);
    const std::vector<ImageU8> photos = load_photos(dataset.views);
    TrainOptions run = options;
    apply_plan(plan, run);
    const SceneEvaluation evaluation = evaluation_of(dataset, run);
    const std::vector<View> views = held_out_views(dataset.views);
    ShapeProbe probe{run.iterations, run.kernel, KERNEL_GAUSSIAN, {}, {}};
    const auto trained = [&](int kernel, ProbedRun& arm) {
        run.kernel = kernel;
        const Arm one = train_arm(device, dataset, photos, run);
        arm = one.run;
        return evaluate_scene(device, one.model, views, evaluation).psnr_db;
    };
    probe.fixed_db = trained(probe.fixed_kernel, probe.fixed);
    probe.learned_db = trained(probe.kernel, probe.learned);
    return probe;
}

AntialiasProbe probe_antialias(const DeviceOptions& device_options, const Dataset& source,
                               const TrainOptions& options, const EffectPlan& plan) {
    const Dataset dataset = probed_dataset(source, plan);
    const std::vector<View> held_out = held_out_views(dataset.views);
    Device device(device_options);
    settle_tuning(device);
    const std::vector<ImageU8> photos = load_photos(dataset.views);
    TrainOptions run = options;
    apply_plan(plan, run);
    run.antialias = false;
    const Arm without = train_arm(device, dataset, photos, run);
    run.antialias = true;
    const Arm with = train_arm(device, dataset, photos, run);
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
