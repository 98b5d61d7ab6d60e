// SPDX-License-Identifier: MIT
// darb plan X: which effects a data set or a scene needs, why, and what each costs on this device.
#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/kernels/kernel_family.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/plan/effect_plan.h"
#include "engine/scene/splat_model.h"
#include "tools/cost/plan_subject.h"
#include "tools/darb/command_list.h"
#include "tools/darb/flags.h"
#include "tools/darb/outputs.h"
#include "tools/darb/scene_evaluation.h"
#include "tools/darb/tune_flags.h"
#include "tools/paper/compare_stats.h"
#include "trainer/growth/initial_model.h"
#include "trainer/job/job.h"
#include "trainer/job/scene_file.h"
#include "trainer/options/options.h"
#include "trainer/step/trainer.h"

namespace darb {

/// Trains on the views that are not held out, which are every 8th where the source names none.
/// options: kernel and iterations are used. Throws Error where there are no photos for both
/// training and measuring.
AntialiasProbe probe_antialias(const DeviceOptions& device, const Dataset& dataset,
                               const TrainOptions& options, const EffectPlan& plan);

/// Tries options.kernel, whose shape each splat learns, beside the Gaussian, both as planned.
Trial try_shape(const DeviceOptions& device, const Dataset& dataset, const TrainOptions& options,
                const EffectPlan& plan);
/// Tries --exposure-grid beside one map for each photo, where the plan has exposure. Pictures are
/// fitted to the exposure of the held-out photos before they are measured.
Trial try_exposure_grid(const DeviceOptions& device, const Dataset& dataset,
                        const TrainOptions& options, const EffectPlan& plan);

void print_probe(std::FILE* out, const AntialiasProbe& probe);
void print_trial(std::FILE* out, const Trial& trial);
nlohmann::json trial_json(const Trial& trial);
nlohmann::json probe_json(const AntialiasProbe& probe);

// Short training runs side by side, for the probes of darb plan.

struct Arm {
    ProbedRun run;
    SplatModel model;
    std::vector<double> turns_s;  // all but the first turn, which compiles shaders
};

/// Runs these options side by side, a few iterations of each in turn and in changing order, so that
/// other work of the machine affects all of them alike.
std::vector<Arm> train_arms(Device& device, const Dataset& dataset,
                            const std::vector<ImageU8>& photos,
                            const std::vector<TrainOptions>& options);

/// By how much a turn of `other` takes longer than one of `one`: the median, which a turn that
/// compiles does not change.
double price_of(const Arm& one, const Arm& other);

namespace {

using nlohmann::json;

struct PlanFlags {
    PlanRequest plan;  // all but its kernel, which is text at first
    std::filesystem::path json;
    bool quiet = false, no_price = false, compare = false, probe = false;
    int probe_iterations = 400;
    KernelFlags kernel;
};

// Refuses flags that only a data set takes; open_subject() checks the others.
void refuse_for_scenes(const PlanFlags& flags) {
    const auto refuse = [&](bool given, const char* flag) {
        if (given)
            throw Error(fmt::format("darb plan {} {}", flags.plan.what.string(), flag),
                        "is for a data set, and this is a scene", "Leave it out.");
    };
    refuse(!flags.kernel.kernel.empty(), "--kernel");
    refuse(!flags.kernel.files.empty(), "--kernel-file");
    refuse(flags.probe, "--probe");
}

TrainOptions probed_options(const PlanFlags& flags) {
    TrainOptions train;
    train.kernel = flags.plan.kernel.value_or(train.kernel);
    train.iterations = flags.probe_iterations;
    return train;
}

// Tries shapes where the kernel to train with has some, and grids where exposure is on.
std::vector<Trial> try_on_subject(const PlanSubject& s, const PlanFlags& flags,
                                  const EffectPlan& plan) {
    const TrainOptions options = probed_options(flags);
    TrainOptions planned = options;
    apply_plan(plan, planned);
    const bool shapes = kernel_has_shape(options.kernel), tones = planned.exposure;
    std::vector<Trial> trials;
    if (!shapes && !tones) return trials;
    const DeviceOptions device = command_device(flags.plan.device);
    const Dataset dataset = planned_dataset(s, flags.plan, plan);
    if (shapes) trials.push_back(try_shape(device, dataset, options, plan));
    if (tones) trials.push_back(try_exposure_grid(device, dataset, options, plan));
    return trials;
}

// Compares none, auto and all as a whole.
json compare_choices(const PlanSubject& s, const PlanFlags& flags) {
    json list = json::array();
    for (const char* name : {"none", "auto", "all"}) {
        const Measured m =
            measure_subject(s, flags.plan, plan_of(s, flags.plan, parse_effects(name)));
        list.push_back(
            {{"effects", name}, {"ms", m.ms}, {"spread_ms", m.spread_ms}, {"peak_bytes", m.bytes}});
        tell(stream_beside_json(flags.json, flags.quiet),
             "{:<5} {:>9.2f} ms (spread {:.2f})  {:>9.2f} MB at the peak\n", name, m.ms,
             m.spread_ms, static_cast<double>(m.bytes) / 1e6);
    }
    return list;
}

int run_plan(PlanFlags flags) {
    refuse_to_overwrite_inputs({flags.json}, files_of(flags.plan.what));
    const bool scene = is_scene(flags.plan.what);
    const EffectChoice choice = choose_effects(
        flags.plan.effects, scene ? EffectUse::pictures : EffectUse::training, flags.plan.data);
    if (scene) refuse_for_scenes(flags);
    flags.plan.kernel = chosen_kernel(flags.kernel);
    const PlanSubject s = open_subject(flags.plan);
    refuse_to_overwrite_inputs({flags.json}, files_of(s.training ? s.dataset.views : s.views));
    EffectPlan plan = plan_of(s, flags.plan, choice);
    std::optional<AntialiasProbe> probe;
    std::vector<Trial> trials;
    if (flags.probe) {
        probe = probe_antialias(command_device(flags.plan.device),
                                planned_dataset(s, flags.plan, plan), probed_options(flags), plan);
        take_probe(*probe, plan);
        trials = try_on_subject(s, flags, plan);
    }
    const bool empty = !s.training && s.model.size() == 0;
    EffectPrices prices;
    if (!empty && (!flags.no_price || flags.compare)) {
        const Measured base = measure_subject(s, flags.plan, plan);
        plan.note_frame(base.huge_splats, base.longest_list);
        if (!flags.no_price)
            prices = price_effects(
                plan, base, switchable_effects(s, flags.plan), degree_of(s, flags.plan),
                [&](const EffectPlan& p) { return measure_subject(s, flags.plan, p); });
    }
    std::FILE* const out = stream_beside_json(flags.json, flags.quiet);
    print_priced(out, plan, prices, s.training);
    if (probe) print_probe(out, *probe);
    for (const Trial& trial : trials) print_trial(out, trial);
    const char* kind = s.training ? "data set" : "scene";
    json result{{"path", name_in_json(flags.json, flags.plan.what)},
                {"kind", kind},
                {"effects", priced_json(plan, prices)}};
    if (probe) result["probe"] = probe_json(*probe);
    for (const Trial& trial : trials) result["trials"].push_back(trial_json(trial));
    if (flags.compare && !empty) result["compared"] = compare_choices(s, flags);
    write_json(flags.json, result);
    tell_paths(flags.quiet, {flags.json});
    return 0;
}

}  // namespace

void add_plan(CLI::App& app, Action& action) {
    auto flags = std::make_shared<PlanFlags>();
    CLI::App* command = app.add_subcommand(
        "plan", "Show which effects a data set or a scene needs, and their cost");
    command->add_option("what", flags->plan.what, "a data set, a scene, or an output folder")
        ->required();
    command->add_option("--cameras", flags->plan.cameras,
                        "for a scene: the cameras that will look at it");
    command->add_option("-r,--resolution", flags->plan.data.resolution, "the same as in training");
    command->add_option("-i,--images", flags->plan.data.images_folder, "the same as in training")
        ->capture_default_str();
    command
        ->add_option("--sh-degree", flags->plan.sh_degree,
                     "for a data set: the highest degree (default 3)")
        ->check(CLI::Range(0, 3));
    add_kernel_flags(*command, flags->kernel,
                     "for a data set: the kernel to train with (default gaussian)");
    command->add_flag("--depth", flags->plan.depth, "for a scene: depth images are wanted, too");
    add_effects_flag(*command, flags->plan.effects);
    add_lens_flag(*command, flags->plan.data);
    command->add_flag("--no-price", flags->no_price, "do not measure times");
    command->add_flag("--compare", flags->compare, "compare time and memory of none, auto and all");
    auto* probe = command->add_flag(
        "--probe", flags->probe,
        "for a data set: decide on anti-aliasing by two short runs, measured at 1/2, 1, 2 and 4 "
        "times the size of -r; two more runs each decide on a --kernel that learns shapes, and on "
        "--exposure-grid where exposure is on");
    command
        ->add_option("--probe-iterations", flags->probe_iterations,
                     "iterations of each of these runs")
        ->capture_default_str()
        ->check(CLI::Range(20, 1'000'000))
        ->needs(probe);
    add_json_option(*command, flags->json);
    command->add_option("--device", flags->plan.device,
                        "number or part of a name, see `darb devices`");
    add_quiet_flag(*command, flags->quiet);
    add_unit_options(*command, flags->plan.units);
    command->callback([flags, &action] { action = [flags] { return run_plan(*flags); }; });
}

namespace {

constexpr double kScales[] = {0.5, 1, 2, 4};

/// The data set with some photos held out.
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

/// Runs both variants, which prepare() makes from the planned options.
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

// What the probes of darb plan report.

namespace {

std::string gain_text(double db) {
    return fmt::format("{:+.2f} dB", db);
}

nlohmann::json arm_json(const ProbedRun& run) {
    return {{"seconds", run.seconds}, {"splats", run.splats}};
}

}  // namespace

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
    return {{"iterations", probe.iterations},
            {"gain_db", probe.gain_db()},
            {"sizes", sizes},
            {"without", arm_json(probe.without)},
            {"with", arm_json(probe.with)}};
}

void print_trial(std::FILE* out, const Trial& trial) {
    tell(out, "\n{}, a probe of {} iterations beside {}: {}\n", trial.tried, trial.iterations,
         trial.usual, trial.advice());
}

nlohmann::json trial_json(const Trial& trial) {
    return {{"tried", trial.tried},
            {"beside", trial.usual},
            {"iterations", trial.iterations},
            {"psnr_db", trial.tried_db},
            {"beside_psnr_db", trial.usual_db},
            {"gain_db", trial.gain_db()},
            {"price", trial.price},
            {"pays", trial.pays()},
            {"tried_run", arm_json(trial.tried_run)},
            {"beside_run", arm_json(trial.usual_run)}};
}

namespace {

constexpr int kTurn = 10;  // iterations

}  // namespace

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

double price_of(const Arm& one, const Arm& other) {
    std::vector<double> ratios;
    for (std::size_t t = 0; t < one.turns_s.size(); ++t)
        ratios.push_back(other.turns_s[t] / one.turns_s[t]);
    std::ranges::sort(ratios);
    const std::size_t n = ratios.size();
    return (ratios[(n - 1) / 2] + ratios[n / 2]) / 2 - 1;
}

}  // namespace darb
