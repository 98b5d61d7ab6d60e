#include "tools/darb/plan_probe.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/say.h"
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

std::string gain_text(double db) {
    return fmt::format("{:+.2f} dB", db);
}

}  // namespace

AntialiasProbe probe_antialias(const DeviceOptions& device_options, const Dataset& source,
                               const TrainOptions& options, const EffectPlan& plan) {
    Dataset dataset = source;
    mark_held_out(dataset.views, {});
    apply_plan(plan, dataset.views);
    const std::vector<View> held_out = held_out_views(dataset.views);
    if (held_out.empty() || held_out.size() == dataset.views.size())
        throw Error(source.root.string(), "has no photos both to train on and to hold out",
                    "Leave out --probe.");
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
    SceneEvaluation evaluation;
    evaluation.alpha_is_mask = dataset.alpha_is_mask;
    evaluation.background = glm::vec3(run.white_background ? 1.0f : 0.0f);
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

void print_probe(std::FILE* out, const AntialiasProbe& probe) {
    tell(out, "\nanti-aliasing, a probe of {} iterations: held-out PSNR without, with\n",
         probe.iterations);
    for (const ProbedSize& size : probe.sizes)
        tell(out, "{:>4}x  {:<11}  {:>8.2f} {:>8.2f} dB  {}\n", scale_text(size.scale),
             fmt::format("{} x {}", size.width, size.height), size.without_db, size.with_db,
             gain_text(size.with_db - size.without_db));
    tell(out, "price: {:.1f} s and {} splats without, {:.1f} s and {} splats with\n",
         probe.without.seconds, probe.without.splats, probe.with.seconds, probe.with.splats);
}

nlohmann::json probe_json(const AntialiasProbe& probe) {
    nlohmann::json sizes = nlohmann::json::array();
    for (const ProbedSize& size : probe.sizes)
        sizes.push_back({{"scale", size.scale},
                         {"width", size.width},
                         {"height", size.height},
                         {"without_psnr_db", size.without_db},
                         {"with_psnr_db", size.with_db}});
    const auto arm = [](const ProbedRun& run) {
        return nlohmann::json{{"seconds", run.seconds}, {"splats", run.splats}};
    };
    return {{"iterations", probe.iterations},
            {"gain_db", probe.gain_db()},
            {"sizes", sizes},
            {"without", arm(probe.without)},
            {"with", arm(probe.with)}};
}

}  // namespace darb
