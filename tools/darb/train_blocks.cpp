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
#include "tools/darb/rank_tuning.h"
#include "tools/darb/scene_evaluation.h"
#include "tools/darb/stop_signals.h"
#include "tools/darb/train_data.h"
#include "tools/darb/train_run.h"
#include "trainer/blocks/run_blocks.h"
#include "trainer/run_folder.h"

namespace darb {

namespace {

constexpr int kMostASide = 64;

// What follows the number; nullptr: there is none from 1 to kMostASide.
const char* read_side(const char* at, const char* end, int& side) {
    const auto [behind, failed] = std::from_chars(at, end, side);
    return failed == std::errc() && side >= 1 && side <= kMostASide ? behind : nullptr;
}

Evaluation evaluate_joined(Device& device, const Dataset& dataset, const TrainFlags& flags,
                           const SplatModel& scene) {
    const std::vector<View> views = held_out_views(dataset.views);
    if (views.empty()) return {};
    SceneEvaluation options;
    options.effects = parse_effects(flags.effects);
    options.background = glm::vec3(flags.train.white_background ? 1.0f : 0.0f);
    options.alpha_is_mask = dataset.alpha_is_mask;
    return evaluate_scene(device, scene, views, options);
}

void print_blocks_plan(const Device& device, const Dataset& dataset, const TrainFlags& flags) {
    if (flags.run.quiet) return;
    const std::size_t held_out = held_out_views(dataset.views).size();
    say("{}: {}, {} photos to train on, {} held out, {} points\n", dataset.root.string(),
        dataset.source, dataset.views.size() - held_out, held_out, dataset.points.size());
    print_notes(dataset.notes);
    say("device: {}\neffects: {}\n", device.description(), flags.run.effects);
    if (!flags.strategy_note.empty()) say("{}\n", flags.strategy_note);
}

std::string summary_of(const BlocksSummary& summary, const TrainFlags& flags) {
    const BlocksManifest& m = summary.manifest;
    std::string text;
    if (!flags.run.quiet && !summary.interrupted) text = blocks_table(m);
    if (!flags.run.quiet && m.held_out > 0)
        text += fmt::format("held-out PSNR {:.2f} dB, SSIM {:.4f} over {} views\n", m.psnr_db,
                            m.ssim, m.held_out);
    const char* what = flags.run.quiet ? "" : "scene    ";
    if (!summary.scene.empty()) text += what + summary.scene.string() + "\n";
    if (summary.interrupted)
        text += fmt::format("interrupted{}{}; go on with: darb train --resume -o '{}'\n",
                            stop_exit_code() == 0 ? "" : " by ", stop_name(),
                            flags.run.output.string());
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

void check_for_blocks(const TrainFlags& flags) {
    parse_blocks(flags.blocks);
    const auto refuse = [](bool given, const char* option, const char* hint) {
        if (given) throw Error(option, "has no place beside --blocks", hint);
    };
    constexpr const char* kAfter = "Leave it out: darb eval and darb convert take the scene.";
    refuse(flags.view, "--view", "Leave it out; darb view opens the scene.");
    refuse(flags.page, "--html", "Leave it out; darb convert OUT page.html writes the page.");
    refuse(!flags.start_checkpoint.empty(), "--start-checkpoint",
           "Leave it out; --resume goes on with a run in blocks.");
    refuse(!flags.run.test_iterations.empty(), "--test-iterations", kAfter);
    refuse(!flags.run.save_iterations.empty(), "--save-iterations", kAfter);
    refuse(!flags.run.checkpoint_iterations.empty(), "--checkpoint-iterations",
           "Leave it out; --checkpoint-interval is for each block.");
    refuse(flags.verbose, "--verbose", "Leave it out: each block's metrics.json has its passes.");
    refuse(flags.allow_mixed, "--allow-mixed", "Leave it out: each block is trained on one rank.");
    refuse(flags.train.start == StartPoints::dense || flags.train.start == StartPoints::random,
           "--start dense or random", "Use --start auto or points.");
    refuse(asks_for_exposure(flags.effects) || flags.train.exposure_grid, "exposure",
           "Leave exposure out: each block would find other colours for the same photo.");
    refuse(flags.refine_cameras == "on" || asks_for_cameras(flags.effects), "--refine-cameras",
           "Leave it out: each block would find another pose for the same photo.");
}

int train_blocks(Ranks& ranks, TrainFlags flags, const TuneFlags& tune, std::string command) {
    refuse_without_cameras(flags, ranks.count());
    std::optional<RunLock> lock;
    Dataset dataset = load_training_data(flags, lock);
    if (ranks.is_first()) {
        check_run_folder(flags.run.output, dataset);
        if (!lock) lock.emplace(flags.run.output);
    }
    plan_effects(dataset, flags, false);
    plan_strategy(dataset, flags);
    flags.run.command = std::move(command);
    const std::atomic<bool>& stop = stop_on_signals();
    std::optional<Tuning> tuning;  // the same for every part, on every rank
    const auto device = [&] {
        auto made = std::make_unique<Device>(command_device(flags.device));
        tuning ? made->set_tuning(*tuning) : settle_tuning(*made, tune);
        return made;
    };
    auto first = device();
    take_tuning_of_first(ranks, *first, !tune.choice.empty());
    tuning = first->tuning();
    if (ranks.is_first()) print_blocks_plan(*first, dataset, flags);
    first.reset();  // each part has one of its own
    const BlocksJob job{
        dataset,
        flags.train,
        flags.run,
        parse_blocks(flags.blocks),
        flags.resume,
        ranks,
        device,
        [&](const SplatModel& scene) { return evaluate_joined(*device(), dataset, flags, scene); }};
    const BlocksSummary summary = run_blocks(job, stop);
    if (ranks.is_first()) write_or_let_go(printable(summary_of(summary, flags), true));
    return summary.interrupted ? stop_exit_code() : 0;
}

}  // namespace darb
