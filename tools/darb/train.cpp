// darb train DATASET -o OUT: photos to a splat scene.

#include <fmt/format.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <memory>
#include <optional>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/ranks/ranks.h"
#include "tools/darb/command_list.h"
#include "tools/darb/device_options.h"
#include "tools/darb/live_view.h"
#include "tools/darb/page_output.h"
#include "tools/darb/rank_tuning.h"
#include "tools/darb/scene_file.h"
#include "tools/darb/stop_signals.h"
#include "tools/darb/train_blocks.h"
#include "tools/darb/train_data.h"
#include "tools/darb/train_flags.h"
#include "tools/darb/train_plan.h"
#include "tools/darb/train_recall.h"
#include "tools/darb/train_run.h"
#include "tools/darb/train_summary.h"
#include "tools/darb/tune_flags.h"
#include "trainer/run_folder.h"
#include "trainer/start_memory.h"

namespace darb {

namespace {

// The scene as a web page, with the photos' cameras as its bookmarks; of a run that was finished
// before, where there is none yet.
void leave_page(Device& device, const Dataset& dataset, const TrainFlags& flags,
                const RunSummary& summary) {
    const std::filesystem::path file = flags.run.output / "scene.html";
    const bool trained = !summary.model.empty();
    if (!flags.page || summary.interrupted || (!trained && std::filesystem::exists(file))) return;
    PageFlags page;
    if (flags.train.white_background) page.background = "white";
    const SplatModel scene = load_scene(trained ? summary.model : scene_of_run(flags.run.output));
    write_or_let_go("page     " + write_page(device, scene, page, title_of(flags.run.output),
                                             dataset.views, file));
}

void refuse_stereo(const Dataset& dataset, const TrainFlags& flags, int ranks) {
    if (ranks == 1 || !starts_from_stereo(dataset, flags)) return;
    const bool asked = flags.train.start == StartPoints::dense;
    throw Error(
        asked ? "--start dense" : dataset.root.string(),
        fmt::format("{} begun by {} ranks: each device may find other points",
                    asked ? "is not" : "has no points, and stereo in their place is not", ranks),
        fmt::format("Begin on one rank; several go on with --resume, or use --start {}.",
                    dataset.points.size() > 0 ? "points" : "random"));
}

// Whatever takes a folder or a window for itself.
void check_for_ranks(const Ranks& ranks, const TrainFlags& flags) {
    if (ranks.count() == 1) return;
    if (flags.view)
        throw Error("--view", fmt::format("has no place in a run of {} ranks", ranks.count()),
                    "Leave it out; darb view opens what the run saves.");
    refuse_without_cameras(flags, ranks.count());
}

int train(Ranks& ranks, TrainFlags flags, TuneFlags tune, std::vector<std::string> arguments) {
    const bool recalled = flags.resume && flags.dataset.empty() && !flags.run.output.empty();
    if (recalled) recall_arguments(arguments, flags, tune);
    if (!flags.blocks.empty()) check_for_blocks(flags);
    finish_train_flags(flags);
    if (flags.dataset.empty())
        throw Error("darb train", "no data set", "Name a folder: darb train DATASET -o OUT.");
    if (!flags.blocks.empty())
        return train_blocks(ranks, flags, tune,
                            recalled ? "" : command_text(std::move(arguments), flags));
    check_for_ranks(ranks, flags);
    flags.run.ranks = {&ranks, flags.allow_mixed};

    DeviceOptions device_options = command_device(flags.device);
    const LiveSystem live(flags.view, device_options);
    Device device(device_options);
    settle_tuning(device, tune);
    take_tuning_of_first(ranks, device, flags.allow_mixed || !tune.choice.empty());
    std::optional<RunLock> lock;
    Dataset dataset = load_training_data(flags, lock);
    refuse_stereo(dataset, flags, ranks.count());
    if (ranks.is_first()) {
        check_run_folder(flags.run.output, dataset);
        if (!lock) lock.emplace(flags.run.output);
    }
    plan_effects(dataset, flags);
    plan_start(device, dataset, flags);
    plan_strategy(dataset, flags);
    std::atomic<bool>& stop = stop_on_signals();
    if (!ranks.is_first()) {
        run_training(device, dataset, flags.train, flags.run, &stop, std::move(flags.photos));
        return 0;
    }
    if (!recalled) flags.run.command = command_text(std::move(arguments), flags);
    if (flags.run.resume_from.empty())  // before the forecast, which makes them
        check_start_memory(device, dataset, flags.train);
    print_plan(device, dataset, flags);
    const std::unique_ptr<LiveView> view =
        live.open(device, dataset, stop, flags.train.white_background);
    if (view) flags.run.on_step = [&](const LiveStep& step) { return view->show(step); };
    const RunSummary summary =
        run_training(device, dataset, flags.train, flags.run, &stop, std::move(flags.photos));
    if (!write_or_let_go(summary_text(summary, flags)))
        throw Error("standard output", std::string("cannot be written: ") + std::strerror(errno),
                    "The run is complete: its folder holds everything.");
    leave_page(device, dataset, flags, summary);
    if (view) view->finish(summary.model);
    return summary.interrupted ? stop_exit_code() : 0;
}

}  // namespace

void add_train(CLI::App& app, Action& action, const std::vector<std::string>& arguments) {
    auto flags = std::make_shared<TrainFlags>();
    auto tune = std::make_shared<TuneFlags>();
    CLI::App* command = app.add_subcommand("train", "Train a splat scene from photos");
    add_train_flags(*command, *flags);
    add_tune_flags(*command, *tune);
    command->callback([flags, tune, arguments, &action] {
        action = [flags, tune, arguments] {
            return with_ranks([&](Ranks& ranks) { return train(ranks, *flags, *tune, arguments); });
        };
    });
}

}  // namespace darb
