// Command line to options: what the parser leaves as words.
#include <fmt/format.h>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/kernels/shaped_kernel.h"
#include "tools/darb/effect_flags.h"
#include "tools/darb/outputs.h"
#include "tools/darb/train_flags.h"
#include "trainer/strategy.h"

namespace darb {

namespace {

constexpr int kStandardEvaluations[] = {7'000, 30'000};

}  // namespace

TrainFlags parse_train_flags(std::vector<std::string> words, const std::string& options,
                             const std::string& command) {
    words.insert(words.begin(), "train");
    for (const std::string& word : CLI::detail::split_up(options)) words.push_back(word);
    TrainFlags f;
    CLI::App app;
    add_train_flags(*app.add_subcommand("train"), f);
    try {
        app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
    } catch (const CLI::ParseError& e) {
        throw Error(command, e.what(), "`darb train --help` lists what --train-options takes.");
    }
    if (!f.blocks.empty())
        throw Error(command + " --blocks " + f.blocks, "is an option of darb train alone",
                    "Leave it out.");
    finish_train_flags(f);
    return f;
}

namespace {

// The schedule's changes before those that are given beside it, of which the last word counts; all
// and none say everything.
std::string effects_beside(const std::string& schedule, std::string given) {
    if (schedule.empty() || given.empty() || given.starts_with("all") || given.starts_with("none"))
        return given;
    if (given.starts_with("auto")) given.erase(0, std::string("auto,").size());
    return given.empty() ? schedule : schedule + "," + given;
}

// --strategy, and whether it knows what was given beside it.
void finish_strategy(TrainFlags& f) {
    const auto strategy = strategy_from_name(f.strategy);
    if (!strategy)
        throw Error("--strategy " + f.strategy, "no such strategy",
                    fmt::format("Use {}.", strategy_names()));
    if (f.schedule == "3dgs" && !strategy_row(*strategy).follows_3dgs)
        throw Error("--schedule 3dgs", fmt::format("means nothing with --strategy {}", f.strategy),
                    "Leave one of the two out.");
    f.train.strategy = *strategy;
    for (const auto& [name, strategies] : f.of_strategies)
        if (strategies.find(f.strategy) == std::string::npos)
            throw Error(name, fmt::format("means nothing with --strategy {}", f.strategy),
                        fmt::format("Leave it out; it goes with --strategy {}.", strategies));
}

// Where no -o is given: output/NAME, of the folder or the video, or of a .json file's folder.
std::filesystem::path usual_output(const std::string& dataset) {
    std::filesystem::path path = std::filesystem::absolute(dataset).lexically_normal();
    if (path.filename().empty() || path.extension() == ".json") path = path.parent_path();
    return std::filesystem::path("output") / path.stem();
}

// Scripts give those of long runs to short ones, too.
void note_iterations_beyond(const TrainFlags& f) {
    const std::pair<const char*, const std::vector<int>&> lists[] = {
        {"--test-iterations", f.run.test_iterations},
        {"--save-iterations", f.run.save_iterations},
        {"--checkpoint-iterations", f.run.checkpoint_iterations}};
    for (const auto& [name, list] : lists)
        for (const int iteration : list)
            if (iteration > f.train.iterations)
                say_note(fmt::format("note: {} {} is beyond the end at {}: it never comes", name,
                                     iteration, f.train.iterations));
}

}  // namespace

void finish_train_flags(TrainFlags& f) {
    f.effects = effects_beside(f.schedule_effects, f.effects);
    const int kernel = chosen_kernel(f.kernel).value_or(KERNEL_GAUSSIAN);
    const auto row = kernel_with_pulses(kernel, f.pulses);
    if (!row)
        throw Error(fmt::format("--kernel {} --pulses {}", kernel_name(kernel), f.pulses),
                    "there is no such kernel",
                    "Only raised_cosine and sinc have --pulses 2 or 3; others have one.");
    choose_effects(f.effects, EffectUse::training, f.data);
    if (f.train.exposure_grid && refuses_exposure(f.effects))
        throw Error("--exposure-grid", fmt::format("means nothing with --effects {}", f.effects),
                    "Leave one of the two out.");
    if (f.train.exposure_grid) f.effects = with_exposure(f.effects);
    finish_strategy(f);
    f.train.kernel = *row;
    f.train.accuracy = chosen_accuracy(f.accuracy, true);
    note_unused_choices(f.accuracy, f.train.kernel);
    f.train.footprint =
        f.train.accuracy.value(kFootprint) == FOOTPRINT_EXACT ? Footprint::exact : Footprint::psi;
    if (f.train.footprint == Footprint::exact && !has_exact_footprint(f.train.kernel))
        throw Error(fmt::format("--kernel {} --pulses {}", kernel_name(kernel), f.pulses),
                    "goes with the footprint psi only",
                    "Leave --footprint out, or use another kernel or one pulse.");
    if (f.train.shape_lr && !kernel_has_shape(f.train.kernel))
        say_note("note: --shape-lr is not used: splats have shapes of their own with --kernel " +
                 shaped_kernel_names());
    if (f.page && kernel_has_shape(f.train.kernel))
        throw Error("--html", "web pages cannot draw shapes of splats yet",
                    "Leave it out; darb convert --kernel gaussian OUT page.html writes a page of "
                    "nearest Gaussians.");
    note_iterations_beyond(f);
    for (std::vector<int>* list : {&f.run.test_iterations, &f.run.save_iterations})
        if (list->empty())
            list->assign(std::begin(kStandardEvaluations), std::end(kStandardEvaluations));
    if (f.run.output.empty() && f.dataset.empty() && !f.resume)
        throw Error("darb train", "no data set", "Name a folder: darb train DATASET -o OUT.");
    if (f.run.output.empty() && !f.resume) {
        f.run.output = usual_output(f.dataset);
        if (!f.run.quiet) say("output: {}; -o names another\n", f.run.output.string());
    }
    if (f.run.output.empty())
        throw Error("darb train", "no output folder", "Name one with -o OUT.");
    // The run's own checkpoint, once there is one, is further than the one that it began with.
    const std::filesystem::path own = f.run.output / "checkpoint.darb";
    if (f.resume && (f.start_checkpoint.empty() || std::filesystem::exists(own)))
        f.start_checkpoint = own;
    f.run.resume_from = f.start_checkpoint;
}

}  // namespace darb
