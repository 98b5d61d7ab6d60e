#include "tools/darb/plan_probe.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>

#include "engine/core/error.h"
#include "tools/darb/effect_flags.h"
#include "tools/darb/scene_evaluation.h"
#include "tools/darb/tune_flags.h"
#include "tools/paper/compare_stats.h"
#include "trainer/dense_start.h"
#include "trainer/initial_model.h"
#include "trainer/trainer.h"

namespace darb {

namespace {

constexpr double kScales[] = {0.5, 1, 2, 4};

constexpr int kTurn = 10;  // iterations

struct Arm {
    ProbedRun run;
    SplatModel model;
    std::vector<double> turns_s;  // all but the first, in which shaders are compiled
};

/// Runs of these options side by side, a few iterations of each in turn, the order of turns
/// changing: what the machine does meanwhile falls on all of them alike.
std::vector<Arm> train_arms(Device& device, const Dataset& dataset,
                            const std::vector<ImageU8>& photos,
                            const std::vector<TrainOptions>& options) {
    std::vector<std::unique_ptr<Trainer>> trainers;
    for (const TrainOptions& one : options)
        trainers.push_back(
            std::make_unique<Trainer>(device, dataset, photos, initial_model(dataset, one), one));
    std::vector<Arm> arms(options.size());
    for (int turn = 0; turn * kTurn < options.front().iterations; ++turn)
        for (std::size_t k = 0; k < arms.size(); ++k) {
            const std::size_t i = turn % 2 == 0 ? k : arms.size() - 1 - k;
            const int end = std::min((turn + 1) * kTurn, options[i].iterations);
            const auto start = std::chrono::steady_clock::now();
            while (trainers[i]->iteration() < end) trainers[i]->step();
            trainers[i]->drain();
            const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
            if (turn > 0 || end == options[i].iterations) arms[i].turns_s.push_back(took.count());
        }
    for (std::size_t i = 0; i < arms.size(); ++i) {
        arms[i].model = trainers[i]->model();
        for (const double s : arms[i].turns_s) arms[i].run.seconds += s;
        arms[i].run.splats = arms[i].model.size();
    }
    return arms;
}

/// By how much a turn of `other` takes longer than one of `one`: the median, which a turn that
/// compiles does not move.
double price_of(const Arm& one, const Arm& other) {
    std::vector<double> ratios;
    for (std::size_t t = 0; t < one.turns_s.size(); ++t)
        ratios.push_back(other.turns_s[t] / one.turns_s[t]);
    std::ranges::sort(ratios);
    const std::size_t n = ratios.size();
    return (ratios[(n - 1) / 2] + ratios[n / 2]) / 2 - 1;
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
    Dataset dataset = probed_dataset(source, plan);
    Device device(device_options);
    settle_tuning(device);
    const std::vector<ImageU8> photos = load_photos(dataset.views);
    TrainOptions run = options;
    apply_plan(plan, run);
    find_lacking_points(device, photos, run, dataset);
    const SceneEvaluation evaluation = evaluation_of(dataset, run);
    const std::vector<View> views = held_out_views(dataset.views);
    TrainOptions fixed = run;
    fixed.kernel = KERNEL_GAUSSIAN;
    const std::vector<Arm> arms = train_arms(device, dataset, photos, {fixed, run});
    const auto psnr_db = [&](const Arm& arm) {
        return evaluate_scene(device, arm.model, views, evaluation).psnr_db;
    };
    ShapeProbe probe{run.iterations, run.kernel, fixed.kernel, arms[0].run, arms[1].run};
    probe.price = price_of(arms[0], arms[1]);
    probe.fixed_db = psnr_db(arms[0]);
    probe.learned_db = psnr_db(arms[1]);
    return probe;
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
