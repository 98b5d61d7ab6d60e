// darb train DATASET -o OUT: photos to a splat scene.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/data/run_colmap.h"
#include "engine/gpu/device_environment.h"
#include "engine/plan/tuner.h"
#include "engine/ranks/ranks.h"
#include "engine/scene/splat_file.h"
#include "tools/darb/command_list.h"
#include "tools/darb/live_view.h"
#include "tools/darb/page_output.h"
#include "tools/darb/rank_tuning.h"
#include "tools/darb/stop_signals.h"
#include "tools/darb/train_blocks.h"
#include "tools/darb/train_flags.h"
#include "tools/darb/train_plan.h"
#include "tools/darb/train_summary.h"
#include "trainer/job/job.h"
#include "trainer/job/scene_file.h"
#include "trainer/job/training_data.h"
#include "trainer/run/forecast.h"
#include "trainer/run/run_folder.h"

namespace darb {

namespace {

// The scene as a web page, with the photos' cameras as its bookmarks; of a run that was finished
// before, where there is none yet.
void leave_page(Device& device, const TrainJob& job, const TrainResult& result) {
    const TrainRequest& request = job.request;
    const std::filesystem::path file = request.output / "scene.html";
    const bool trained = !result.model.empty();
    if (!request.page || result.interrupted || (!trained && std::filesystem::exists(file))) return;
    PageFlags page;
    if (request.train.white_background) page.background = "white";
    const SplatModel scene = load_scene(trained ? result.model : scene_of_run(request.output));
    write_or_let_go("page     " + write_page(device, scene, page, scene_name(request.output),
                                             job.dataset.views, file));
}

void refuse_stereo(const TrainJob& job, int ranks) {
    if (ranks == 1 || !starts_from_stereo(job)) return;
    const bool asked = job.options.start == StartPoints::dense;
    throw Error(
        asked ? "--start dense" : job.dataset.root.string(),
        fmt::format("{} begun by {} ranks: each device may find other points",
                    asked ? "is not" : "has no points, and stereo in their place is not", ranks),
        fmt::format("Begin on one rank; several go on with --resume, or use --start {}.",
                    job.dataset.points.size() > 0 ? "points" : "random"));
}

// Whatever takes a folder or a window for itself.
void check_for_ranks(const Ranks& ranks, const TrainRequest& request, bool view) {
    if (ranks.count() == 1) return;
    if (view)
        throw Error("--view", fmt::format("has no place in a run of {} ranks", ranks.count()),
                    "Leave it out; darb view opens what the run saves.");
    refuse_without_cameras(request, ranks.count());
}

// `darb train --resume -o OUT` alone goes on with the request of the run. What was typed beside it
// says where and how it shows, not what it trains.
void recall_request(const std::vector<std::string>& typed, TrainRequest& request) {
    constexpr std::array<std::string_view, 12> kBeside{
        "--resume", "-o",      "-m",     "--output", "--model-path", "--device",
        "-q",       "--quiet", "--view", "--tune",   "--retune",     "--verbose"};
    for (const std::string& word : typed) {
        const std::string_view name = std::string_view(word).substr(0, word.find('='));
        if (name.starts_with('-') &&
            std::find(kBeside.begin(), kBeside.end(), name) == kBeside.end())
            throw Error(word, "is not taken beside --resume without the data set",
                        "Repeat the whole command with --resume.");
    }
    TrainRequest recalled = read_request(request.output);
    if (!std::filesystem::exists(recalled.dataset))
        throw Error(
            recalled.dataset,
            fmt::format("does not exist, and the run in {} trains on it", request.output.string()),
            "Move it back, or repeat the whole command of the run with the place where its "
            "photos are now, and --resume.");
    if (!request.device.empty()) recalled.device = request.device;
    if (!request.tune.empty()) recalled.tune = request.tune;
    request = std::move(recalled);
}

// What follows from the command line, before anything is opened.
void complete_flags(TrainRequest& request, bool quiet) {
    const bool named = !request.output.empty();
    complete_request(request);
    require_places(request);
    if (!named && !quiet) say("output: {}; -o names another\n", request.output.string());
}

int train(Ranks& ranks, TrainFlags flags, const std::vector<std::string>& typed) {
    TrainRequest& request = flags.request;
    const RunShown& shown = flags.shown;
    if (request.resume && request.dataset.empty() && !request.output.empty())
        recall_request(typed, request);
    else
        complete_flags(request, shown.quiet);
    if (!request.blocks.empty()) return train_blocks(ranks, request, shown, flags.retune);
    check_for_ranks(ranks, request, shown.view);

    DeviceOptions device_options = command_device(request.device);
    const LiveSystem live(shown.view, device_options);
    Device device(device_options);
    settle_tuning(device, request.tune, flags.retune);
    take_tuning_of_first(ranks, device, request.allow_mixed || !request.tune.empty());
    std::optional<RunLock> lock;
    Dataset dataset = load_training_data(request, lock, {shown.quiet, &stop_on_signals()});
    if (ranks.is_first()) {
        check_run_folder(request.output, dataset);
        if (!lock) lock.emplace(request.output);
    }
    TrainJob job = resolve(request, std::move(dataset));
    refuse_stereo(job, ranks.count());
    for (const std::string& note : job.notes) say_note("note: " + note);
    find_start(device, job, say_stereo_begins);
    std::atomic<bool>& stop = stop_on_signals();
    JobSinks sinks{.quiet = shown.quiet, .stop = &stop, .ranks = {&ranks, request.allow_mixed}};
    if (!ranks.is_first()) {
        run(device, job, sinks);
        return 0;
    }
    if (job.resume_from.empty())  // before the forecast, which makes them
        check_start_memory(device, job.dataset, job.options);
    print_plan(device, job, shown.quiet);
    const std::unique_ptr<LiveView> view =
        live.open(device, job.dataset, stop, request.train.white_background);
    if (view) sinks.on_step = [&](const LiveStep& step) { return view->show(step); };
    const TrainResult result = run(device, job, sinks);
    if (!write_or_let_go(summary_text(result, shown, request.output, sinks.ranks)))
        throw Error("standard output", std::string("cannot be written: ") + std::strerror(errno),
                    "The run is complete: its folder holds everything.");
    leave_page(device, job, result);
    if (view) view->finish(result.model);
    return result.interrupted ? stop_exit_code() : 0;
}

}  // namespace

void add_train(CLI::App& app, Action& action, const std::vector<std::string>& arguments) {
    auto flags = std::make_shared<TrainFlags>();
    CLI::App* command = app.add_subcommand("train", "Train a splat scene from photos");
    add_train_flags(*command, *flags);
    command->callback([flags, arguments, &action] {
        action = [flags, arguments] {
            return with_ranks([&](Ranks& ranks) {
                try {
                    return train(ranks, *flags, arguments);
                } catch (const ColmapStopped&) {
                    return stop_exit_code();
                }
            });
        };
    });
}

}  // namespace darb
