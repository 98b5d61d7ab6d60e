#include "tools/darb/refine_splats.h"

#include <cmath>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/data/compare_view.h"
#include "engine/plan/effect_plan.h"
#include "engine/render/renderer.h"
#include "tools/darb/open_cameras.h"
#include "trainer/job/job.h"
#include "trainer/step/trainer.h"

namespace darb {

namespace {

// Of 3DGS where it ends: the splats are where they belong, and only settle.
constexpr float kPositionRate = 1.6e-5f, kLastPositionRate = 1.6e-6f;

TrainRequest refine_request(const SplatModel& model, int iterations) {
    TrainRequest request;
    TrainOptions& t = request.train;
    t.iterations = iterations;
    t.kernel = model.kernel;
    t.footprint = model.footprint;
    t.sh_degree = model.sh_degree;
    return request;
}

// After the plan of effects, which is that of a run from points.
void keep_splats_as_they_are(const SplatModel& model, TrainOptions& t) {
    t.antialias = model.antialias;
    t.probe_sh = false;
    t.sh_degree = model.sh_degree;
    t.sh_interval = 1;
    t.densify_until = 0;
    t.resolution_ramp = false;
    t.speed_up_short_runs = t.speed_up_sh_rest = false;
    t.position_lr_init = kPositionRate;
    t.position_lr_final = kLastPositionRate;
    t.opacity_weight = t.scale_weight = 0;
    t.exposure = false;
}

}  // namespace

Refiner::Refiner(const std::filesystem::path& dataset, const DatasetOptions& options) {
    DatasetOptions with_split = options;
    with_split.hold_out = true;
    dataset_ = load_dataset(dataset, with_split);
    say_notes(dataset_.notes);
    bool trains = false, tests = false;
    for (const View& view : dataset_.views) (view.is_test ? tests : trains) = true;
    if (!trains || !tests)
        throw Error(dataset.string(), "has no photos both to train on and to hold out",
                    "Refine with at least nine photos, or leave out --refine.");
    photos_ = load_photos(dataset_.views);
}

SplatModel Refiner::refine(Device& device, const SplatModel& model, int iterations) const {
    TrainJob job = resolve(refine_request(model, iterations), dataset_, photos_);
    keep_splats_as_they_are(model, job.options);
    Trainer trainer(device, job.dataset, photos_, model, job.options);
    while (trainer.iteration() < iterations) trainer.step();
    trainer.drain();
    return trainer.model();
}

double Refiner::psnr_db(Device& device, const SplatModel& model) const {
    std::vector<View> views = dataset_.views;
    const EffectPlan plan = plan_rendering(model, views, {});
    apply_plan(plan, views);
    Renderer renderer(device, model, {}, plan.projection(), plan.huge_splat_path());
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
        if (!views[i].is_test) continue;
        const ImageF picture = renderer.render(views[i].camera);
        const double db =
            compare_view(views[i].name, picture, photos_[i], glm::vec3(0), dataset_.alpha_is_mask)
                .psnr_db;
        if (std::isnan(db)) continue;  // all masked
        sum += db;
        ++count;
    }
    return count > 0 ? sum / count : std::nan("");
}

}  // namespace darb
