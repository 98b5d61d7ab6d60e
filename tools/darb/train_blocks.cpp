#include "tools/darb/train_blocks.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/core/text.h"
#include "tools/darb/device_options.h"
#include "tools/darb/effect_flags.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/rank_tuning.h"
#include "tools/darb/scene_evaluation.h"
#include "tools/darb/stop_signals.h"
#include "trainer/blocks/run_blocks.h"
#include "trainer/job/job.h"
#include "trainer/job/training_data.h"
#include "trainer/run_folder.h"

namespace darb {

namespace {

constexpr int kMostASide = 64;

// What follows the number; nullptr: there is none from 1 to kMostASide.
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
        dataset.source, dataset.views.size() - held_out, held_out, dataset.points.size());
    print_notes(dataset.notes);
    say("device: {}\neffects: {}\n", device.description(), plan_line(job.effects));
    if (!job.strategy_note.empty()) say("{}\n", job.strategy_note);
}

std::string summary_of(const BlocksSummary& summary, const TrainFlags& flags) {
    const BlocksManifest& m = summary.manifest;
    std::string text;
    if (!flags.quiet && !summary.interrupted) text = blocks_table(m);
    if (!flags.quiet && m.held_out > 0)
        text += fmt::format("held-out PSNR {:.2f} dB, SSIM {:.4f} over {} views\n", m.psnr_db,
                            m.ssim, m.held_out);
    const char* what = flags.quiet ? "" : "scene    ";
    if (!summary.scene.empty()) text += what + summary.scene.string() + "\n";
    if (summary.interrupted)
        text += fmt::format("interrupted{}{}; go on with: darb train --resume -o '{}'\n",
                            stop_exit_code() == 0 ? "" : " by ", stop_name(),
                            flags.request.output.string());
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

void check_for_blocks(const TrainFlags& flags) {
    const TrainRequest& r = flags.request;
    const auto refuse = [](bool given, const char* option, const char* hint) {
        if (given) throw Error(option, "has no place beside --blocks", hint);
    };
    constexpr const char* kAfter = "Leave it out: darb eval and darb convert take the scene.";
    refuse(flags.view, "--view", "Leave it out; darb view opens the scene.");
    refuse(r.page, "--html", "Leave it out; darb convert OUT page.html writes the page.");
    refuse(!r.start_checkpoint.empty(), "--start-checkpoint",
           "Leave it out; --resume goes on with a run in blocks.");
    refuse(!r.test_iterations.empty(), "--test-iterations", kAfter);
    refuse(!r.save_iterations.empty(), "--save-iterations", kAfter);
    refuse(!r.checkpoint_iterations.empty(), "--checkpoint-iterations",
           "Leave it out; --checkpoint-interval is for each block.");
    refuse(r.train.end_without_gain > 0, "--end-without-gain",
           "Leave it out: blocks are joined when each has done its iterations.");
    refuse(flags.verbose, "--verbose", "Leave it out: each block's metrics.json has its passes.");
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
}

}  // namespace

int train_blocks(Ranks& ranks, const TrainFlags& flags, const TuneFlags& tune) {
    TrainRequest request = flags.request;
    const Grid asked = parse_blocks(request.blocks);
    check_for_blocks(flags);
    refuse_without_cameras(request, ranks.count());
    std::optional<RunLock> lock;
    Dataset dataset = load_training_data(request, lock, {flags.quiet, &stop_on_signals()});
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
        tuning ? made->set_tuning(*tuning) : settle_tuning(*made, tune);
        return made;
    };
    auto first = device();
    take_tuning_of_first(ranks, *first, !tune.choice.empty());
    tuning = first->tuning();
    if (ranks.is_first() && !flags.quiet) print_blocks_plan(*first, job);
    first.reset();  // each part has one of its own
    const BlocksJob blocks{
        job.dataset,
        job.options,
        run_options(job, {.quiet = flags.quiet}),
        asked,
        request.resume,
        ranks,
        device,
        [&](const SplatModel& scene) { return evaluate_joined(*device(), job, scene); }};
    const BlocksSummary summary = run_blocks(blocks, stop);
    if (ranks.is_first()) write_or_let_go(printable(summary_of(summary, flags), true));
    return summary.interrupted ? stop_exit_code() : 0;
}

}  // namespace darb
