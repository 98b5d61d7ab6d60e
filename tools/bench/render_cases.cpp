#include <fmt/format.h>

#include "engine/plan/effect_plan.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/gpu_splats.h"
#include "engine/scene/splat_file.h"
#include "tools/bench/cases.h"
#include "tools/bench/scenes.h"
#include "tools/bench/yardstick.h"
#include "tools/cost/views.h"

namespace darb {

namespace {

constexpr std::size_t kRandomSplats = 100'000;
const glm::dvec3 kRandomCentre(0, 0, 4), kBikerCentre(-0.06, -1.6, 4);

struct Planned {
    SplatModel model;
    Camera camera;
    EffectPlan plan;
};

// As darb render draws it.
Planned planned(const SplatModel& model, const Camera& camera) {
    Planned p{model, camera, plan_rendering(model, {bench_view(camera, "view")}, {})};
    apply_plan(p.plan, p.model);
    return p;
}

}  // namespace

BenchResult measure_picture(Device& device, const SplatModel& model, const Camera& camera,
                            const DeviceRates& rates, const BenchOptions& options) {
    BenchResult result = measure_frames(device, model, camera, rates, options.sampling);
    const Planned p = planned(model, camera);
    const BlendFigures blend =
        measure_blend(device, p.model, {camera}, p.plan.projection(), options.sampling);
    result.counts = blend.counts;
    result.contributing = blend.contributing;
    result.yardsticks = blend.yardsticks;
    rate_passes(rates, result);
    return result;
}

BenchResult measure_frames(Device& device, const SplatModel& model, const Camera& camera,
                           const DeviceRates& rates, const Sampling& sampling) {
    const Planned p = planned(model, camera);
    ForwardOptions options = frame_accuracy({}, p.model).options;
    options.effects = p.plan.projection();
    options.effects.antialias = p.model.antialias;
    options.huge_splat_path = p.plan.huge_splat_path();
    const GpuSplats splats(device, p.model, false);
    FrameBuffers buffers(device, options);
    Forward forward(device, options);
    Commands commands(device);
    FrameView view{camera_data(camera, splats.origin()), nullptr, 0, p.model.sh_degree};
    const Buffer cameras = upload_cameras(device, {view.camera});
    view.cameras = &cameras;
    buffers.reserve(splats.count(), splats.count() * 4, camera.width, camera.height);
    gpu::FrameStatus status{};
    BenchResult result;
    take_samples(
        sampling, 1,
        [&] {
            do {
                commands.begin();
                forward.record(commands, splats, view, buffers.frame());
                commands.submit_and_wait();
                status = buffers.frame().read_status();
            } while (buffers.make_room(status));
            return commands.pass_times();
        },
        result);
    result.counts = {static_cast<double>(splats.count()),
                     static_cast<double>(status.visible),
                     static_cast<double>(status.intersections),
                     static_cast<double>(camera.width) * camera.height,
                     static_cast<double>(p.model.rest_count()),
                     0};
    rate_passes(rates, result);
    return result;
}

std::vector<BenchCase> render_cases() {
    std::vector<BenchCase> cases;
    constexpr int sizes[][2] = {{1280, 720}, {1920, 1080}};
    const auto add = [&](const std::string& scene, const std::filesystem::path& file, int width,
                         int height, auto camera_of) {
        cases.push_back(
            {fmt::format("render/{}/{}x{}", scene, width, height), file,
             [=](Device& device, const DeviceRates& rates, const BenchOptions& options) {
                 const SplatModel model =
                     file.empty() ? random_scene(kRandomSplats) : load_splats(*options.data / file);
                 return measure_picture(device, model, camera_of(model, width, height), rates,
                                        options);
             }});
    };
    const auto random = [](const SplatModel&, int width, int height) {
        return bench_camera(kRandomCentre, true, width, height);
    };
    const auto biker = [](const SplatModel&, int width, int height) {
        return bench_camera(kBikerCentre, false, width, height);
    };
    const auto framed = [](const SplatModel& model, int width, int height) {
        return orbit_views(model, 1, width, height).cameras[0];
    };
    for (const auto& [w, h] : sizes) add("random_100k", "", w, h, random);
    for (const auto& [w, h] : sizes) add("biker", "splats/biker.compressed.ply", w, h, biker);
    for (const auto& [w, h] : sizes) add("toy_cat", "splats/toy-cat.compressed.ply", w, h, framed);
    return cases;
}

}  // namespace darb
