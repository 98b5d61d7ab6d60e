// darb plan X: which effects a data set or a scene calls for, why, and what each costs here.

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/gpu/device_environment.h"
#include "engine/kernels/shaped_kernel.h"
#include "tools/cost/plan_subject.h"
#include "tools/darb/command_list.h"
#include "tools/darb/effect_flags.h"
#include "tools/darb/json_output.h"
#include "tools/darb/kernel_flags.h"
#include "tools/darb/outputs.h"
#include "tools/darb/plan_probe.h"
#include "tools/darb/unit_flags.h"
#include "trainer/job/job.h"
#include "trainer/job/scene_file.h"

namespace darb {

namespace {

using nlohmann::json;

struct PlanFlags {
    PlanRequest plan;  // but for its kernel, which is words at first
    std::filesystem::path json;
    bool quiet = false, no_price = false, compare = false, probe = false;
    int probe_iterations = 400;
    KernelFlags kernel;
};

// Of a data set alone; open_subject() looks at the others.
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

// Of shapes where the kernel to train with has some, of grids where exposure is on.
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

// none, auto and all as wholes.
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
    CLI::App* command =
        app.add_subcommand("plan", "Which effects a data set or a scene calls for, and their cost");
    command->add_option("what", flags->plan.what, "a data set, a scene, or an output folder")
        ->required();
    command->add_option("--cameras", flags->plan.cameras,
                        "of a scene: the cameras that it will be rendered through");
    command->add_option("-r,--resolution", flags->plan.data.resolution, "as in training");
    command->add_option("-i,--images", flags->plan.data.images_folder, "as in training")
        ->capture_default_str();
    command
        ->add_option("--sh-degree", flags->plan.sh_degree,
                     "of a data set: the highest degree (default 3)")
        ->check(CLI::Range(0, 3));
    add_kernel_flags(*command, flags->kernel,
                     "of a data set: the kernel to train with (default gaussian)");
    command->add_flag("--depth", flags->plan.depth, "of a scene: depth images are wanted too");
    add_effects_flag(*command, flags->plan.effects);
    add_lens_flag(*command, flags->plan.data);
    command->add_flag("--no-price", flags->no_price, "measure no times");
    command->add_flag("--compare", flags->compare, "time and memory of none, auto and all");
    auto* probe = command->add_flag(
        "--probe", flags->probe,
        "of a data set: decide on anti-aliasing by two short runs, measured at 1/2, 1, 2 and 4 "
        "times the size of -r; by two more each whether a --kernel that learns shapes pays, and "
        "--exposure-grid where exposure is on");
    command->add_option("--probe-iterations", flags->probe_iterations, "of each of the runs")
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

}  // namespace darb
