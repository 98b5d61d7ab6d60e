#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "engine/core/rng.h"
#include "tools/bench/cases.h"
#include "tools/bench/scenes.h"
#include "tools/bench/yardstick.h"
#include "trainer/growth/initial_model.h"
#include "trainer/options/schedule.h"
#include "trainer/step/trainer.h"

namespace darb {

namespace {

constexpr int kScheduled = 7'000;  // iterations of the run that the steps are taken from
constexpr int kYardstickViews = 2;
constexpr int kFilledSide = 1'000;
constexpr std::size_t kFilledSplats = 1'000'000;

struct TrainCase {
    const char* dataset;
    int after;  // iterations with density control before the steps that are timed
};

std::vector<Camera> some_cameras(const Dataset& dataset, std::size_t most) {
    std::vector<Camera> cameras;
    const std::size_t count = std::min(most, dataset.views.size());
    for (std::size_t i = 0; i < count; ++i)
        cameras.push_back(dataset.views[i * dataset.views.size() / count].camera);
    return cameras;
}

BenchResult measure(Device& device, const TrainCase& one, const DeviceRates& rates,
                    const BenchOptions& options) {
    Dataset dataset = load_dataset(*options.data / one.dataset);
    const std::vector<ImageU8> photos = load_photos(dataset.views);
    TrainOptions train;
    train.iterations = kScheduled;
    train.resolution_ramp = false;  // what is measured are steps of whole photos
    if (options.plan_training) options.plan_training(dataset, photos, train);
    train.densify_until = std::min(one.after, Schedule(train).rounds.end);
    Trainer trainer(device, dataset, photos, initial_model(dataset, train), train);
    const auto start = std::chrono::steady_clock::now();
    while (trainer.iteration() < one.after) {
        trainer.step();
        if (options.progress && trainer.iteration() % 500 == 0)
            options.progress(fmt::format("{}: set-up, {} of {} iterations, {} splats", one.dataset,
                                         trainer.iteration(), one.after, trainer.splat_count()));
    }
    trainer.drain();
    const std::chrono::duration<double> set_up = std::chrono::steady_clock::now() - start;
    const int views = static_cast<int>(dataset.views.size());
    BenchResult result = measure_steps(trainer, std::min(views, 10), options.sampling);
    const SplatModel model = trainer.model();
    ProjectionEffects effects = train.projection;
    effects.antialias = train.antialias;
    const BlendFigures blend = measure_blend(device, model, some_cameras(dataset, kYardstickViews),
                                             effects, options.sampling);
    // The steps' own means; evaluated splat-pixels follow the intersections.
    const double scale = result.counts.intersections / std::max(blend.counts.intersections, 1.0);
    result.counts.evaluated = scale * blend.counts.evaluated;
    result.contributing = scale * blend.contributing;
    result.counts.rest_floats = model.rest_count();
    result.counts.pixels = blend.counts.pixels;
    result.yardsticks = blend.yardsticks;
    rate_passes(rates, result);
    result.note = fmt::format("{} photos, after {} iterations ({:.1f} s of set-up)", views,
                              one.after, set_up.count());
    return result;
}

// What tools/gpu_model.py estimates. Rates so small that the scene stays as it is.
BenchResult measure_filled(Device& device, const DeviceRates& rates, const BenchOptions& options) {
    Dataset dataset;
    std::vector<ImageU8> photos;
    Pcg32 random(3, 100);
    for (const double x : {-0.01, 0.01}) {
        dataset.views.push_back(
            bench_view(bench_camera({x, 0, 4}, true, kFilledSide, kFilledSide), ""));
        photos.emplace_back(kFilledSide, kFilledSide, 4);
        for (std::uint8_t& value : photos.back().data)
            value = static_cast<std::uint8_t>(random.below(256));
    }
    TrainOptions train;
    train.iterations = kScheduled;
    train.resolution_ramp = train.probe_sh = train.alpha = false;
    train.densify_until = 0;
    train.sh_interval = 1;
    train.position_lr_init = train.position_lr_final = 1e-9f;
    train.scale_lr = train.rotation_lr = train.opacity_lr = train.sh_dc_lr = 1e-9f;
    Trainer trainer(device, dataset, photos, filled_scene(kFilledSplats), train);
    for (int i = 0; i < train.sh_degree; ++i) trainer.step();  // then all bands are in use
    BenchResult result = measure_steps(trainer, 2, options.sampling);
    result.counts.rest_floats = attribute_floats(kShRest, train.sh_degree);
    result.counts.pixels = double(kFilledSide) * kFilledSide;
    rate_passes(rates, result);
    return result;
}

}  // namespace

BenchResult measure_steps(Trainer& trainer, int steps_a_sample, const Sampling& sampling) {
    BenchResult result;
    double visible = 0, intersections = 0, finished = 0;
    trainer.on_result = [&](const IterationResult& one) {
        visible += one.visible;
        intersections += one.intersections;
        finished += 1;
    };
    take_samples(
        sampling, steps_a_sample,
        [&] {
            const std::vector<PassTotal> before = trainer.pass_totals();
            for (int step = 0; step < steps_a_sample; ++step) trainer.step();
            trainer.drain();
            std::vector<PassTime> passes;
            for (const PassTotal& pass : trainer.pass_totals()) {
                const auto known =
                    std::find_if(before.begin(), before.end(),
                                 [&](const PassTotal& p) { return p.name == pass.name; });
                passes.push_back({pass.name, pass.ms - (known == before.end() ? 0 : known->ms)});
            }
            return passes;
        },
        result);
    trainer.on_result = {};
    result.counts.splats = trainer.splat_count();
    result.counts.visible = visible / std::max(finished, 1.0);
    result.counts.intersections = intersections / std::max(finished, 1.0);
    return result;
}

std::vector<BenchCase> train_cases(bool full) {
    std::vector<BenchCase> cases;
    for (const TrainCase& one :
         {TrainCase{"sceaux_castle_200_tiny", 0}, TrainCase{"sceaux_castle_800", 0},
          TrainCase{"fox_800", full ? kScheduled : 1'000}}) {
        std::string name = fmt::format("train/{}", one.dataset);
        if (one.after > 0) name += fmt::format("/after_{}", one.after);
        cases.push_back(
            {name, one.dataset,
             [one](Device& device, const DeviceRates& rates, const BenchOptions& options) {
                 return measure(device, one, rates, options);
             }});
    }
    cases.push_back({"train/filled_1M/1000x1000", "", measure_filled});
    return cases;
}

}  // namespace darb
