// SPDX-License-Identifier: MIT
#include "tools/bench/cases.h"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <glm/glm.hpp>
#include <numbers>

#include "engine/core/error.h"
#include "engine/core/process.h"
#include "engine/core/rng.h"
#include "engine/core/system_files.h"
#include "engine/data/camera_list.h"
#include "engine/plan/effect_plan.h"
#include "engine/plan/tuner.h"
#include "engine/primitives/radix_sort.h"
#include "engine/primitives/scan.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/gpu_splats.h"
#include "engine/scene/splat_file.h"
#include "tools/bench/bench_step.h"
#include "tools/bench/native_blend.h"
#include "tools/bench/yardstick.h"
#include "tools/cost/plan_subject.h"
#include "trainer/growth/initial_model.h"
#include "trainer/options/schedule.h"
#include "trainer/step/trainer.h"

namespace darb {

namespace {

constexpr std::size_t kOwnViews = 2;   // views of the data set at which pictures are timed
constexpr int kOwnIterations = 7'000;  // length of the run from which a step is taken
constexpr std::size_t kStepsASample = 10;

BenchResult measure_own_steps(Device& device, const SplatModel& model, Dataset dataset,
                              const DeviceRates& rates, const BenchOptions& options) {
    const std::vector<ImageU8> photos = load_photos(dataset.views);
    TrainOptions train;
    train.iterations = kOwnIterations;
    train.resolution_ramp = false;  // steps of whole photos
    train.densify_until = 0;        // keep the scene as it is
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

namespace {

constexpr std::size_t kRandomSplats = 100'000;
const glm::dvec3 kRandomCentre(0, 0, 4), kBikerCentre(-0.06, -1.6, 4);

struct Planned {
    SplatModel model;
    Camera camera;
    EffectPlan plan;
};

// Renders as `darb render` does.
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

namespace {

std::vector<std::uint32_t> random_words(std::uint32_t count, std::uint32_t bound) {
    Pcg32 random(3, 4);
    std::vector<std::uint32_t> words(count);
    for (std::uint32_t& word : words) word = bound == 0 ? random.next() : random.below(bound);
    return words;
}

// Takes the samples of the native work, after the device's. same: whether the results agree.
Yardstick yardstick(const std::string& pass, const BenchResult& result, const Sampling& sampling,
                    bool same, const std::function<double()>& native) {
    std::vector<double> ms;
    for (int i = 0; i < std::clamp(sampling.least, 1, 10); ++i) ms.push_back(native());
    return {pass, result.passes.empty() ? result.ms : result.passes[0].ms, spread_of(ms),
            "same_result", same ? 1.0 : 0.0};
}

BenchResult measure_sort(Device& device, std::uint32_t count, const DeviceRates& rates,
                         const Sampling& sampling) {
    const std::vector<std::uint32_t> keys = random_words(count, 0);
    const std::uint64_t bytes = std::uint64_t{count} * 4;
    Buffer unsorted(device, "unsorted", bytes), size(device, "count", 4);
    const Buffer key(device, "keys", bytes), value(device, "values", bytes);
    RadixSort sort(device, count);
    Commands commands(device);
    size.upload(std::vector<std::uint32_t>{count});
    unsorted.upload(keys);
    BenchResult result;
    take_samples(
        sampling, 1,
        [&] {
            commands.begin();
            commands.pass("depth sort");  // the name by which roofline.cpp knows 32-bit keys
            sort.record(commands, key, value, size, 0, 32, true);
            commands.submit_and_wait();
            return commands.pass_times();
        },
        result,
        [&] {  // the keys of the last sample are sorted now
            commands.begin();
            commands.copy(unsorted, key, bytes);
            commands.submit_and_wait();
        });
    result.counts.visible = count;
    rate_passes(rates, result);
    for (PassFigure& pass : result.passes) pass.name = "radix sort";
    NativeSort native;
    std::vector<std::uint32_t> k = keys, v(count);
    for (std::uint32_t i = 0; i < count; ++i) v[i] = i;
    native.sort(k, v);
    const bool same =
        k == key.download<std::uint32_t>(count) && v == value.download<std::uint32_t>(count);
    result.yardsticks.push_back(yardstick("radix sort", result, sampling, same, [&] {
        k = keys;
        return milliseconds([&] { native.sort(k, v); });
    }));
    return result;
}

BenchResult measure_scan(Device& device, std::uint32_t count, const DeviceRates& rates,
                         const Sampling& sampling) {
    const std::vector<std::uint32_t> counts = random_words(count, 100);
    const std::uint64_t bytes = std::uint64_t{count} * 4;
    Buffer from(device, "counts", bytes), size(device, "count", 4);
    const Buffer to(device, "offsets", bytes), total(device, "total", 4);
    from.upload(counts);
    size.upload(std::vector<std::uint32_t>{count});
    Scan scan(device, count);
    Commands commands(device);
    BenchResult result;
    take_samples(
        sampling, 1,
        [&] {
            commands.begin();
            commands.pass("scan");
            scan.record(commands, from, to, size, 0, total);
            commands.submit_and_wait();
            return commands.pass_times();
        },
        result);
    result.counts.splats = count;
    rate_passes(rates, result);
    std::vector<std::uint32_t> offsets;
    native_scan(counts, offsets);
    const bool same = offsets == to.download<std::uint32_t>(count);
    result.yardsticks.push_back(yardstick("scan", result, sampling, same, [&] {
        return milliseconds([&] { native_scan(counts, offsets); });
    }));
    return result;
}

}  // namespace

std::vector<BenchCase> sort_cases() {
    std::vector<BenchCase> cases;
    for (const std::uint32_t millions : {1u, 10u}) {
        const std::uint32_t count = millions * 1'000'000;
        cases.push_back({fmt::format("sort/{}M", millions), "",
                         [=](Device& device, const DeviceRates& rates, const BenchOptions& o) {
                             return measure_sort(device, count, rates, o.sampling);
                         }});
        cases.push_back({fmt::format("scan/{}M", millions), "",
                         [=](Device& device, const DeviceRates& rates, const BenchOptions& o) {
                             return measure_scan(device, count, rates, o.sampling);
                         }});
    }
    return cases;
}

}  // namespace darb

// The time from starting the command to the first picture on disk: `darb render` of one view of
// biker, as a separate process with shader caches in a separate folder.

namespace darb {

namespace {

namespace fs = std::filesystem;

constexpr int kStarts = 5;

// A folder that is removed with its content at the end.
class ScratchFolder {
  public:
    ScratchFolder() : path_(make_scratch_folder("darb_bench")) {}
    ~ScratchFolder() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;
    const fs::path& path() const { return path_; }

  private:
    fs::path path_;
};

// With the caches of Mesa, of NVIDIA's driver and of darb itself in `caches`.
void draw(const std::vector<std::string>& words, const fs::path& caches) {
    ProcessOptions options{.output = ProcessOptions::Output::nowhere};
    for (const char* name :
         {"XDG_CACHE_HOME", "MESA_SHADER_CACHE_DIR", "__GL_SHADER_DISK_CACHE_PATH"})
        options.variables.emplace_back(name, caches.string());
    if (!run_process(words, options).is_good())
        throw Error(words[0] + " " + words[1], "did not draw its picture",
                    "Run the command by hand; see what it says above.");
}

BenchResult measure(const Device& device, const BenchOptions& options, const fs::path& scene,
                    bool cold) {
    const ScratchFolder scratch;
    const View view = bench_view(bench_camera({-0.06, -1.6, 4}, false, 1280, 720), "first.png");
    const fs::path cameras = scratch.path() / "cameras.json", caches = scratch.path() / "caches",
                   pictures = scratch.path() / "pictures";
    write_camera_list(cameras, {view});
    std::vector<std::string> command = {
        options.program.string(),
        "render",
        scene.string(),
        "--cameras",
        cameras.string(),
        "-o",
        pictures.string(),
        "--tune",
        names_text(tuning_names(device.tuning()))};  // nothing to measure
    if (!options.device.empty()) {
        command.push_back("--device");
        command.push_back(options.device);
    }
    Sampling sampling = options.sampling;
    sampling.least = std::min(sampling.least, kStarts);
    sampling.seconds = 0;
    sampling.warm_up = cold ? 0 : 1;
    BenchResult result;
    take_samples(
        sampling, 1,
        [&] {
            draw(command, caches);
            return std::vector<PassTime>{};
        },
        result,
        [&] {
            if (cold) fs::remove_all(caches);
            fs::create_directories(caches);
            fs::remove_all(pictures);
        });
    if (fs::is_empty(pictures)) throw Error(pictures.string(), "holds no picture");
    result.note = fmt::format("process start to PNG at 1280x720, shader cache {}",
                              cold ? "empty" : "filled by the start before");
    return result;
}

}  // namespace

std::vector<BenchCase> start_cases() {
    std::vector<BenchCase> cases;
    const fs::path scene = "splats/biker.compressed.ply";
    for (const bool cold : {false, true})
        cases.push_back({fmt::format("start/biker/{}", cold ? "cold" : "warm"), scene,
                         [=](Device& device, const DeviceRates&, const BenchOptions& options) {
                             return measure(device, options, *options.data / scene, cold);
                         }});
    return cases;
}

std::vector<BenchCase> bench_cases(bool full) {
    std::vector<BenchCase> all;
    for (const auto& some : {render_cases(), train_cases(full), step_cases(), sort_cases(),
                             tuning_cases(), start_cases()})
        all.insert(all.end(), some.begin(), some.end());
    return all;
}

namespace {

constexpr std::size_t kStepSplats = 100'000;
constexpr int kStepDegree = 3;

// A sample is one step in each way, one after the other; the case's time is their sum.
BenchResult measure(Device& device, int width, int height, const BenchOptions& options) {
    const Camera camera = bench_camera(glm::dvec3(0, 0, 4), true, width, height);
    BenchStep frame(device, random_scene(kStepSplats, kStepDegree), camera);
    BenchResult result;
    take_samples(
        options.sampling, 1,
        [&] {
            std::vector<PassTime> passes;
            for (const bool apart : {false, true}) {
                const std::string way = apart ? "apart" : "fused";
                double sum = 0;
                for (const PassTime& pass : frame.run(apart)) {
                    sum += pass.ms;
                    if (pass.name == "project backward" || pass.name == "adam")
                        passes.push_back({pass.name + ", " + way, pass.ms});
                }
                passes.push_back({"step, " + way, sum});
            }
            return passes;
        },
        result);
    result.counts.splats = kStepSplats;
    result.counts.visible = frame.status().visible;
    result.counts.intersections = frame.status().intersections;
    result.counts.pixels = double(width) * height;
    result.counts.rest_floats = attribute_floats(kShRest, kStepDegree);
    double fused = 0, apart = 0;
    for (const PassFigure& pass : result.passes) {
        if (pass.name == "step, fused") fused = pass.ms.median;
        if (pass.name == "step, apart") apart = pass.ms.median;
    }
    result.note = fmt::format("gradients and optimiser apart take {:+.1f} % of a step",
                              fused > 0 ? 100 * (apart / fused - 1) : 0.0);
    return result;
}

}  // namespace

std::vector<BenchCase> step_cases() {
    std::vector<BenchCase> cases;
    for (const glm::ivec2 size : {glm::ivec2(320, 240), glm::ivec2(800, 600)})
        cases.push_back({fmt::format("step/random_100k/{}x{}", size.x, size.y), "",
                         [size](Device& device, const DeviceRates&, const BenchOptions& options) {
                             return measure(device, size.x, size.y, options);
                         }});
    return cases;
}

namespace {

constexpr int kScheduled = 7'000;  // iterations of the run that the steps are taken from
constexpr int kYardstickViews = 2;
constexpr int kFilledSide = 1'000;
constexpr std::size_t kFilledSplats = 1'000'000, kTrainedSplats = 400'000;
constexpr int kTrainedWidth = 1'595, kTrainedHeight = 1'064;  // px, as castle_p30

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
    train.resolution_ramp = false;  // steps on whole photos are to be measured
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
    // The means over these steps; evaluated splat-pixels are proportional to intersections.
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

// Steps on a made-up scene and photos of noise, at rates so small that the scene does not change.
BenchResult measure_made(Device& device, const SplatModel& scene, const glm::ivec2& size,
                         const DeviceRates& rates, const BenchOptions& options) {
    Dataset dataset;
    std::vector<ImageU8> photos;
    Pcg32 random(3, 100);
    for (const double x : {-0.01, 0.01}) {
        dataset.views.push_back(bench_view(bench_camera({x, 0, 4}, true, size.x, size.y), ""));
        photos.emplace_back(size.x, size.y, 4);
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
    Trainer trainer(device, dataset, photos, scene, train);
    for (int i = 0; i < train.sh_degree; ++i) trainer.step();  // then all bands are in use
    BenchResult result = measure_steps(trainer, 2, options.sampling);
    result.counts.rest_floats = attribute_floats(kShRest, train.sh_degree);
    result.counts.pixels = double(size.x) * size.y;
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
          TrainCase{"fox_800", full ? kScheduled : 1'000},
          TrainCase{"castle_p30_1600", full ? kScheduled : 0}}) {
        std::string name = fmt::format("train/{}", one.dataset);
        if (one.after > 0) name += fmt::format("/after_{}", one.after);
        cases.push_back(
            {name, one.dataset,
             [one](Device& device, const DeviceRates& rates, const BenchOptions& options) {
                 return measure(device, one, rates, options);
             }});
    }
    // What tools/lab/gpu_model.py estimates.
    cases.push_back({"train/filled_1M/1000x1000", "",
                     [](Device& device, const DeviceRates& rates, const BenchOptions& options) {
                         return measure_made(device, filled_scene(kFilledSplats),
                                             {kFilledSide, kFilledSide}, rates, options);
                     }});
    cases.push_back({fmt::format("train/trained_400k/{}x{}", kTrainedWidth, kTrainedHeight), "",
                     [](Device& device, const DeviceRates& rates, const BenchOptions& options) {
                         return measure_made(device, trained_scene(kTrainedSplats),
                                             {kTrainedWidth, kTrainedHeight}, rates, options);
                     }});
    return cases;
}

namespace {

// Every choice in one group on the tuner's scene, one row each; the case's own figures are those of
// the choice that this device uses.
BenchResult measure_choices(Device& device, const std::string& name, const Sampling& sampling) {
    const std::vector<TuningGroup> groups = tuning_groups(device.info());
    const auto group = std::find_if(groups.begin(), groups.end(),
                                    [&](const TuningGroup& g) { return g.name == name; });
    const Tuning before = device.tuning();
    const TuningNames usual = tuning_names(before);
    BenchResult result;
    std::vector<PassFigure> rows;
    for (const std::string& choice : group->choices) {
        device.set_tuning(with_names(before, {{name, choice}}));
        TuningFrame frame(device);
        BenchResult one;
        take_samples(
            sampling, 1,
            [&] {
                return std::vector<PassTime>{{name + "=" + choice, frame.run({*group})[0]}};
            },
            one);
        rows.push_back(one.passes.at(0));
        if (choice == usual.at(name)) result = one;
    }
    device.set_tuning(before);
    result.passes = std::move(rows);
    result.note = fmt::format("{}={} runs on this device; rows are {}", name, usual.at(name),
                              fmt::join(group->passes, " + "));
    return result;
}

}  // namespace

std::vector<BenchCase> tuning_cases() {
    std::vector<BenchCase> cases;
    for (const char* group :
         {"scan", "scatter", "depths", "emit", "tiles", "blend", "backward", "sums"})
        cases.push_back({fmt::format("tuning/{}", group), "",
                         [group](Device& device, const DeviceRates&, const BenchOptions& o) {
                             return measure_choices(device, group, o.sampling);
                         }});
    return cases;
}

SplatModel random_scene(std::size_t splats, int sh_degree) {
    SplatModel model;
    model.sh_degree = sh_degree;
    model.resize(splats);
    Pcg32 random(1, 100);
    const auto normal = [&](double mean, double deviation) {
        return static_cast<float>(mean + deviation * random.normal());
    };
    const std::size_t rest = static_cast<std::size_t>(model.rest_count());
    for (std::size_t i = 0; i < splats; ++i) {
        glm::dvec3 p;
        do
            for (int a = 0; a < 3; ++a) p[a] = random.uniform(-1, 1);
        while (glm::dot(p, p) > 1);
        for (std::size_t a = 0; a < 3; ++a) {
            const double coordinate = p[static_cast<int>(a)];
            model.position[3 * i + a] = static_cast<float>(coordinate);
            model.log_scale[3 * i + a] = normal(std::log(0.01), 0.4);
            model.sh_dc[3 * i + a] = static_cast<float>(0.5 * coordinate / SH_C0);
        }
        for (std::size_t a = 0; a < 4; ++a) model.rotation[4 * i + a] = normal(0, 1);
        model.opacity_logit[i] = normal(0, 1.5);
        for (std::size_t a = 0; a < rest; ++a) model.sh_rest[rest * i + a] = normal(0, 0.05);
    }
    return model;
}

SplatModel filled_scene(std::size_t splats) {
    SplatModel model = random_scene(splats);
    Pcg32 random(2, 100);
    const double half = 0.99 * std::tan(0.125 * std::numbers::pi);  // half the width, at distance 1
    for (std::size_t i = 0; i < splats; ++i) {
        const double distance = random.uniform(3, 5);
        model.position[3 * i] = static_cast<float>(random.uniform(-half, half) * distance);
        model.position[3 * i + 1] = static_cast<float>(random.uniform(-half, half) * distance);
        model.position[3 * i + 2] = static_cast<float>(4 - distance);
        model.opacity_logit[i] = static_cast<float>(-3.2 + 1.2 * random.normal());
        for (std::size_t a = 0; a < 3; ++a) {
            model.log_scale[3 * i + a] += std::log(1.75f);
            model.sh_dc[3 * i + a] = static_cast<float>(random.normal());
        }
    }
    return model;
}

// Fitted to castle_p30 as the defaults had it after 1,080 iterations at 800 px, in units of photos
// 1,595 px wide: 102,536 splats, of which 24,000 to 39,000 are in a view. Their longest standard
// deviation has a median of 9.5 px and a spread of 0.73 in logarithms, but 1 % lie above 81 px and
// 0.1 % above 570. There 5 % of those in view are over more than 64 tiles, and three quarters of a
// view's intersections are theirs; of 400,000 splats it is about half.
SplatModel trained_scene(std::size_t splats) {
    constexpr double fitted = 102'536, large = 1'000, share_seen = 0.3;
    SplatModel model = random_scene(splats);
    Pcg32 random(4, 100);
    const double focal = 0.5 * kTrainedWidth / std::tan(0.125 * std::numbers::pi);
    const double median = 9.5 * std::sqrt(fitted / static_cast<double>(splats));
    const glm::dvec2 half =
        glm::dvec2(kTrainedWidth, kTrainedHeight) / (2 * focal * std::sqrt(share_seen));
    for (std::size_t i = 0; i < splats; ++i) {
        const double distance = random.uniform(4, 8.5), normal = random.normal();
        const double power = std::pow(std::max(random.uniform(0, 1), 0.008), -0.85);
        const bool is_large = static_cast<double>(i) < large;
        const double px = is_large ? 80 * power : median * std::exp(0.73 * normal);
        const double longest = std::log(px * distance / focal);
        const double second = longest - std::abs(1.22 + 0.9 * random.normal());
        const double third = second - std::abs(0.69 + 0.5 * random.normal());
        model.position[3 * i] = static_cast<float>(random.uniform(-half.x, half.x) * distance);
        model.position[3 * i + 1] = static_cast<float>(random.uniform(-half.y, half.y) * distance);
        model.position[3 * i + 2] = static_cast<float>(4 - distance);
        model.log_scale[3 * i] = static_cast<float>(longest);
        model.log_scale[3 * i + 1] = static_cast<float>(second);
        model.log_scale[3 * i + 2] = static_cast<float>(third);
        model.opacity_logit[i] =
            static_cast<float>(-1.45 + 1.9 * (0.3 * normal + 0.954 * random.normal()));
    }
    return model;
}

Camera bench_camera(const glm::dvec3& centre, bool upright, int width, int height) {
    Camera camera;
    camera.width = width;
    camera.height = height;
    camera.fx = camera.fy = 0.5 * width / std::tan(0.125 * 3.14159265358979323846);
    camera.cx = 0.5 * width;
    camera.cy = 0.5 * height;
    const double side = upright ? 1 : -1;
    const glm::dvec3 right(side, 0, 0), down(0, -side, 0), forward(0, 0, -1);
    camera.rotation = glm::transpose(glm::dmat3(right, down, forward));
    camera.translation = -(camera.rotation * centre);
    return camera;
}

View bench_view(const Camera& camera, const std::string& name) {
    View view;
    view.name = name;
    view.camera = camera;
    view.lens = {
        "PINHOLE", {camera.fx, camera.fy, camera.cx, camera.cy}, camera.width, camera.height};
    return view;
}

std::optional<std::filesystem::path> bench_data_folder(const std::filesystem::path& named,
                                                       const std::filesystem::path& usual) {
    std::error_code error;
    if (!named.empty()) {
        if (!std::filesystem::is_directory(named, error))
            throw Error("--data " + named.string(), "is no folder",
                        "Name the folder that holds fox_800, sceaux_castle_800, splats, ...");
        return named;
    }
    if (!std::filesystem::is_directory(usual, error)) return std::nullopt;
    return usual;
}

}  // namespace darb
