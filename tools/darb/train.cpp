// SPDX-License-Identifier: MIT
// darb train DATASET -o OUT: turns photos into a splat scene.
#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/count_text.h"
#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/core/system.h"
#include "engine/core/text.h"
#include "engine/data/run_colmap.h"
#include "engine/gpu/device.h"
#include "engine/plan/tuner.h"
#include "engine/ranks/ranks.h"
#include "engine/scene/splat_file.h"
#include "tools/darb/command_list.h"
#include "tools/darb/live_view.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/page_output.h"
#include "tools/darb/scene_evaluation.h"
#include "tools/darb/train_flags.h"
#include "tools/darb/train_plan.h"
#include "tools/darb/train_summary.h"
#include "trainer/blocks/partition.h"
#include "trainer/blocks/run_blocks.h"
#include "trainer/job/job.h"
#include "trainer/job/request.h"
#include "trainer/job/scene_file.h"
#include "trainer/job/training_data.h"
#include "trainer/run/forecast.h"
#include "trainer/run/run_folder.h"

namespace darb {

/// Reads "auto" as 0 x 0, otherwise columns x rows. Throws Error for anything else.
Grid parse_blocks(const std::string& text);

/// Runs a complete request in blocks. Throws Error where an option was given that cannot be
/// combined with --blocks. Returns the exit code.
int train_blocks(Ranks& ranks, const TrainRequest& request, const RunShown& shown, bool retune);

// How ranks tune their devices.

/// Each rank would measure its own device, and equal devices might get different choices. So the
/// device takes the choices of rank 0, except for keeps_own. All ranks must call this, whatever
/// their options are.
void take_tuning_of_first(Ranks& ranks, Device& device, bool keeps_own);

bool leave_page(Device& device, const TrainJob& job, const TrainResult& result, bool publishes) {
    const TrainRequest& request = job.request;
    const std::filesystem::path file = request.output / "scene.html";
    const bool trained = !result.model.empty();
    const bool due =
        request.page && !result.interrupted && (trained || !std::filesystem::exists(file));
    if (!due && !(publishes && trained)) return false;
    PageFlags page;
    if (request.train.white_background) page.background = "white";
    const SplatModel scene = load_scene(trained ? result.model : scene_of_run(request.output));
    write_or_let_go("page     " + write_page(device, scene, page, scene_name(request.output),
                                             job.dataset.views, file));
    return true;
}

namespace {

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

// Refuses what needs a folder or a window to itself.
void check_for_ranks(const Ranks& ranks, const TrainRequest& request, bool view) {
    if (ranks.count() == 1) return;
    if (view)
        throw Error("--view", fmt::format("has no place in a run of {} ranks", ranks.count()),
                    "Leave it out; darb view opens what the run saves.");
    refuse_without_cameras(request, ranks.count());
}

// `darb train --resume -o OUT` alone goes on with the saved request. Options typed beside it say
// where it runs and how it is shown, but not what it trains.
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

// Completes the request by what follows from the command line, before anything is opened.
void complete_flags(TrainRequest& request, bool quiet) {
    const bool named = !request.output.empty();
    complete_request(request);
    require_places(request);
    if (!named && !quiet) say("output: {}; -o chooses another\n", request.output.string());
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
    const bool page = leave_page(device, job, result, view && view->publishes());
    if (view)
        view->finish(result.model,
                     page ? "web page in " + (request.output / "scene.html").string() : "");
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

namespace {

constexpr int kMostASide = 64;

// Reads a side of the grid and returns what follows it; nullptr: not a number from 1 to kMostASide.
const char* read_side(const char* at, const char* end, int& side) {
    const auto [behind, failed] = std::from_chars(at, end, side);
    return failed == std::errc() && side >= 1 && side <= kMostASide ? behind : nullptr;
}

Evaluation evaluate_joined(Device& device, const TrainJob& job, const SplatModel& scene) {
    const std::vector<View> views = held_out_views(job.dataset.views);
    if (views.empty()) return {};
    SceneEvaluation options;
    options.effects = parse_effects(job.request.effects);
    options.background = glm::vec3(job.options.white_background ? 1.0f : 0.0f);
    options.alpha_is_mask = job.dataset.alpha_is_mask;
    return evaluate_scene(device, scene, views, options);
}

void print_blocks_plan(const Device& device, const TrainJob& job) {
    const Dataset& dataset = job.dataset;
    const std::size_t held_out = held_out_views(dataset.views).size();
    say("{}: {}, {} photos to train on, {} held out, {} points\n", dataset.root.string(),
        dataset.source, count_text(dataset.views.size() - held_out), count_text(held_out),
        count_text(dataset.points.size()));
    say_notes(dataset.notes);
    say("device: {}\neffects: {}\n", device.description(), plan_line(job.effects));
    if (!job.strategy_note.empty()) say("{}\n", job.strategy_note);
    if (!job.region_note.empty()) say("{}\n", job.region_note);
}

std::string summary_of(const BlocksSummary& summary, bool quiet,
                       const std::filesystem::path& output) {
    const BlocksManifest& m = summary.manifest;
    std::string text;
    if (!quiet && !summary.interrupted) text = blocks_table(m);
    if (!quiet && m.held_out > 0)
        text += fmt::format("held-out PSNR {:.2f} dB, SSIM {:.4f} over {} views\n", m.psnr_db,
                            m.ssim, m.held_out);
    const char* what = quiet ? "" : "scene    ";
    if (!summary.scene.empty()) text += what + summary.scene.string() + "\n";
    if (summary.interrupted)
        text += fmt::format("interrupted{}{}; go on with: darb train --resume -o '{}'\n",
                            stop_exit_code() == 0 ? "" : " by ", stop_name(), output.string());
    return text;
}

}  // namespace

Grid parse_blocks(const std::string& text) {
    if (text == "auto") return {0, 0};
    Grid grid;
    const char* const end = text.data() + text.size();
    const char* at = read_side(text.data(), end, grid.columns);
    if (at != nullptr && at != end && *at == 'x') at = read_side(at + 1, end, grid.rows);
    if (at != end || text.find('x') == std::string::npos)
        throw Error(
            "--blocks " + text,
            fmt::format("is no grid of 1 to {} columns by 1 to {} rows", kMostASide, kMostASide),
            "Use auto, or columns and rows as 3x2.");
    return grid;
}

namespace {

void check_for_blocks(const TrainRequest& r, const RunShown& shown) {
    const auto refuse = [](bool given, const char* option, const char* hint) {
        if (given) throw Error(option, "has no place beside --blocks", hint);
    };
    constexpr const char* kAfter = "Leave it out: darb eval and darb convert take the scene.";
    refuse(shown.view, "--view", "Leave it out; darb view opens the scene.");
    refuse(r.page, "--html", "Leave it out; darb convert OUT page.html writes the page.");
    refuse(!r.start_checkpoint.empty(), "--start-checkpoint",
           "Leave it out; --resume goes on with a run in blocks.");
    refuse(!r.test_iterations.empty(), "--test-iterations", kAfter);
    refuse(!r.save_iterations.empty(), "--save-iterations", kAfter);
    refuse(!r.checkpoint_iterations.empty(), "--checkpoint-iterations",
           "Leave it out; --checkpoint-interval is for each block.");
    refuse(r.train.end_without_gain > 0, "--end-without-gain",
           "Leave it out: blocks are joined when each has done its iterations.");
    refuse(shown.verbose, "--verbose", "Leave it out: each block's metrics.json has its passes.");
    refuse(r.allow_mixed, "--allow-mixed", "Leave it out: each block is trained on one rank.");
    refuse(r.train.start == StartPoints::dense || r.train.start == StartPoints::random,
           "--start dense or random", "Use --start auto or points.");
    refuse(effect_in_words(r.effects, "exposure").value_or(r.effects.starts_with("all")) ||
               r.train.exposure_grid,
           "exposure",
           "Leave exposure out: each block would find other colours for the same photo.");
    refuse(r.refine_cameras == "on" || effect_in_words(r.effects, "cameras").value_or(false),
           "--refine-cameras",
           "Leave it out: each block would find another pose for the same photo.");
    refuse(r.drop_outside || r.clean_isolated || r.clean_free_space || !r.clean_haze.empty(),
           "cleaning", "Leave it out; darb clean cleans the scene when its blocks are joined.");
    refuse(r.train.learn_kernel > 0, "--learn-kernel",
           "Leave it out: each block would find another kernel, and one scene has one.");
}

}  // namespace

int train_blocks(Ranks& ranks, const TrainRequest& asked_run, const RunShown& shown, bool retune) {
    TrainRequest request = asked_run;
    const Grid asked = parse_blocks(request.blocks);
    check_for_blocks(request, shown);
    refuse_without_cameras(request, ranks.count());
    std::optional<RunLock> lock;
    Dataset dataset = load_training_data(request, lock, {shown.quiet, &stop_on_signals()});
    if (ranks.is_first()) {
        check_run_folder(request.output, dataset);
        if (!lock) lock.emplace(request.output);
    }
    const TrainJob job = resolve(request, std::move(dataset), {}, false);
    for (const std::string& note : job.notes) say_note("note: " + note);
    const std::atomic<bool>& stop = stop_on_signals();
    std::optional<Tuning> tuning;  // the same for every part, on every rank
    const auto device = [&] {
        auto made = std::make_unique<Device>(command_device(request.device));
        tuning ? made->set_tuning(*tuning) : settle_tuning(*made, request.tune, retune);
        return made;
    };
    auto first = device();
    take_tuning_of_first(ranks, *first, !request.tune.empty());
    tuning = first->tuning();
    if (ranks.is_first() && !shown.quiet) print_blocks_plan(*first, job);
    first.reset();  // each part has a device of its own
    const BlocksJob blocks{
        job.dataset,
        job.options,
        run_options(job, {.quiet = shown.quiet}),
        asked,
        request.resume,
        ranks,
        device,
        [&](const SplatModel& scene) { return evaluate_joined(*device(), job, scene); }};
    const BlocksSummary summary = run_blocks(blocks, stop);
    if (ranks.is_first())
        write_or_let_go(printable(summary_of(summary, shown.quiet, request.output), true));
    return summary.interrupted ? stop_exit_code() : 0;
}

void take_tuning_of_first(Ranks& ranks, Device& device, bool keeps_own) {
    if (ranks.count() == 1) return;
    const std::string own = names_text(tuning_names(device.tuning()));
    const Bytes first = from_first(ranks, std::as_bytes(std::span(own)));
    if (keeps_own) return;
    const std::string_view names(reinterpret_cast<const char*>(first.data()), first.size());
    device.set_tuning(resumed_tuning(device.info(), device.tuning(), names, "tuning of rank 0"));
}

}  // namespace darb
