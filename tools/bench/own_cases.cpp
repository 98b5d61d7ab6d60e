#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"
#include "engine/scene/splat_file.h"
#include "tools/bench/cases.h"
#include "tools/cost/views.h"
#include "trainer/step/trainer.h"

namespace darb {

namespace {

constexpr std::size_t kOwnViews = 2;   // of the data set, that pictures are timed at
constexpr int kOwnIterations = 7'000;  // of the run that a step is taken from
constexpr std::size_t kStepsASample = 10;

BenchResult measure_own_steps(Device& device, const SplatModel& model, Dataset dataset,
                              const DeviceRates& rates, const BenchOptions& options) {
    const std::vector<ImageU8> photos = load_photos(dataset.views);
    TrainOptions train;
    train.iterations = kOwnIterations;
    train.resolution_ramp = false;  // steps of whole photos
    train.densify_until = 0;        // of the scene as it is
    train.probe_sh = false;
    train.sh_degree = model.sh_degree;
    train.sh_interval = 1;  // all bands are in use after a few steps
    train.kernel = model.kernel;
    train.footprint = model.footprint;
    if (options.plan_training) options.plan_training(dataset, photos, train);
    train.sh_degree = model.sh_degree;
    train.probe_sh = false;
    Trainer trainer(device, dataset, photos, model, train);
    for (int i = 0; i < model.sh_degree; ++i) trainer.step();
    const int steps = static_cast<int>(std::min(dataset.views.size(), kStepsASample));
    BenchResult result = measure_steps(trainer, steps, options.sampling);
    result.counts.rest_floats = model.rest_count();
    rate_passes(rates, result);
    result.note = fmt::format("{} photos, {} splats", dataset.views.size(), model.size());
    return result;
}

}  // namespace

std::vector<BenchCase> own_cases(const std::filesystem::path& scene,
                                 const std::filesystem::path& dataset) {
    const SplatModel model = load_splats(scene);
    if (model.size() == 0)
        throw Error(scene.string(), "holds no splats", "There is nothing to measure.");
    std::vector<BenchCase> cases;
    const auto add = [&](const std::string& what, const Camera& camera) {
        cases.push_back({fmt::format("render/{}/{}x{}", what, camera.width, camera.height), "",
                         [model, camera](Device& device, const DeviceRates& rates,
                                         const BenchOptions& options) {
                             return measure_picture(device, model, camera, rates, options);
                         }});
    };
    if (dataset.empty()) {
        for (const auto& [w, h] : {std::pair{1280, 720}, {1920, 1080}})
            add("own", orbit_views(model, 1, w, h).cameras[0]);
        return cases;
    }
    const Dataset photos = load_dataset(dataset);
    const std::size_t count = std::min(photos.views.size(), kOwnViews);
    for (std::size_t i = 0; i < count; ++i) {
        const View& view = photos.views[i * photos.views.size() / count];
        add("own/" + view.name, view.camera);
    }
    cases.push_back(
        {"train/own", "",
         [model, photos](Device& device, const DeviceRates& rates, const BenchOptions& options) {
             return measure_own_steps(device, model, photos, rates, options);
         }});
    return cases;
}

}  // namespace darb
