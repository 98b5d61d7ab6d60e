#include "tools/darb/train_flags.h"

#include <fmt/format.h>

#include <map>

#include "tools/darb/effect_flags.h"
#include "tools/darb/help.h"
#include "tools/darb/kernel_flags.h"
#include "tools/darb/numbers.h"
#include "tools/darb/outputs.h"
#include "trainer/options/strategy.h"

namespace darb {

namespace {

const std::map<std::string, StartPoints> kStarts = {{"auto", StartPoints::automatic},
                                                    {"points", StartPoints::points},
                                                    {"dense", StartPoints::dense},
                                                    {"random", StartPoints::random}};

// Before every option that it changes: values are taken over in this order.
void add_schedule_flag(CLI::App& command, TrainFlags& f) {
    command
        .add_option_function<std::string>(
            "--schedule", [&f](const std::string& schedule) { use_schedule(f.request, schedule); },
            "3dgs: its rates, limits, resets and background, no regularisers, harmonics by the "
            "iteration, whole photos, in runs of any length; options that are given beside it "
            "count")
        ->check(CLI::IsMember({"darb", "3dgs"}))
        ->default_str("darb")
        ->group(option_group::kRates);
}

void add_scene_flags(CLI::App& command, TrainFlags& f) {
    add_kernel_flags(command, f.kernel,
                     kernel_names() +
                         " (each splat learns its shape), or one of your own: \"expr: (1 - "
                         "q/9)^3, support 9\"",
                     option_group::kScene);
    command.get_option("--kernel")->default_str("gaussian");
    std::string strategies;
    for (const Strategy strategy : all_strategies())
        strategies += fmt::format("{}{} ({})", strategies.empty() ? "" : "; ",
                                  strategy_name(strategy), strategy_row(strategy).summary);
    command.add_option("--strategy", f.strategy, "how the splats grow: " + strategies)
        ->capture_default_str()
        ->group(option_group::kScene);
    command
        .add_option("--start", f.request.train.start,
                    "what splats start from; dense: surfaces that stereo between the photos finds; "
                    "auto: points of the data set, else dense, else random")
        ->transform(CLI::CheckedTransformer(kStarts, CLI::ignore_case).description(""))
        ->type_name("TEXT:{auto,points,dense,random}")
        ->default_str("auto")
        ->group(option_group::kStart);
    add_effects_flag(command, f.effects);
    command.get_option("--effects")->group(option_group::kScene);
    command.add_flag("--antialiasing", f.request.antialiasing, "as --effects +antialias")
        ->group(option_group::kEffects);
    command
        .add_option("-d,--depths", f.depths,
                    "as --effects +depth; FOLDER: of the measured depths, depths or depth in the "
                    "data set")
        ->type_name("FOLDER")
        ->group(option_group::kEffects);
    command
        .add_option("--refine-cameras", f.request.refine_cameras,
                    "train poses and intrinsics beside the splats, as --effects +cameras; auto: as "
                    "the plan says, off")
        ->check(CLI::IsMember({"auto", "on", "off"}))
        ->capture_default_str()
        ->group(option_group::kEffects);
    command
        .add_option("--pulses", f.pulses,
                    "of raised_cosine and sinc: 2 or 3 keep rings that the paper's limit removes")
        ->capture_default_str()
        ->check(CLI::Range(1, KERNEL_MAX_PULSES))
        ->group(help_group::kAccuracy);
    add_accuracy_flags(command, f.accuracy, true);
    command
        .add_option("--blocks", f.request.blocks, "train a scene too large for the memory in parts")
        ->type_name("TEXT:{auto,NxM}")
        ->group(option_group::kScene);
}

void add_run_flags(CLI::App& command, TrainFlags& f) {
    command
        .add_flag("--resume", f.request.resume,
                  "go on from OUT/checkpoint.darb; `darb train --resume -o OUT` is enough")
        ->group(option_group::kRun);
    command.add_flag("--view", f.view, "follow the run in a window; closing it goes on training")
        ->group(option_group::kRun);
    command
        .add_flag("--allow-mixed", f.request.allow_mixed,
                  "ranks of mpirun may have other devices and drivers; the result then depends on "
                  "which")
        ->group(help_group::kDevice);
    add_quiet_flag(command, f.quiet)->group(option_group::kRun);
    command.add_flag("--verbose", f.verbose, "print the time of each pass at the end")
        ->group(help_group::kDevice);
    command
        .add_option("--device", f.request.device, "number or part of a name, see `darb devices`")
        ->group(option_group::kRun);
    command.add_flag("--deterministic", f.deterministic)->group("");
}

void add_saving_flags(CLI::App& command, TrainFlags& f) {
    const auto at_least_one = CLI::Range(1, 1'000'000'000);
    for (const auto& [name, list, help] :
         {std::tuple{"--test-iterations", &f.request.test_iterations,
                     "evaluate after these (default 7000 30000 and the last)"},
          {"--save-iterations", &f.request.save_iterations,
           "write a PLY after these (default 7000 30000 and the last)"},
          {"--checkpoint-iterations", &f.request.checkpoint_iterations,
           "keep a checkpoint of its own after these"}})
        command.add_option(name, *list, help)->check(at_least_one)->group(help_group::kSaving);
    command
        .add_option("--checkpoint-interval", f.request.checkpoint_interval,
                    "refresh checkpoint.darb every so many iterations; 0: at the end only")
        ->capture_default_str()
        ->check(zero_or_more())
        ->group(help_group::kSaving);
    command
        .add_option("--start-checkpoint", f.request.start_checkpoint, "go on from this checkpoint")
        ->group(help_group::kSaving);
    command
        .add_flag("--report,!--no-report", f.request.report,
                  "write OUT/report.html at the end (default): curves, time by pass, pictures")
        ->group(help_group::kSaving);
    command
        .add_flag("--html", f.request.page,
                  "write OUT/scene.html at the end: a web page that shows the scene")
        ->group(help_group::kSaving);
}

}  // namespace

void add_train_flags(CLI::App& command, TrainFlags& f) {
    add_schedule_flag(command, f);
    add_data_flags(command, f);
    add_run_flags(command, f);
    add_scene_flags(command, f);
    add_option_rows(command, f.request.train, f.of_strategies);
    add_saving_flags(command, f);
    add_removed_options(command);
    command.parse_complete_callback([&command, &f] {
        f.length_given = command.count("--iterations") > 0;
        f.width_given = command.count("--resolution") > 0;
    });
}

}  // namespace darb
