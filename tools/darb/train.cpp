// darb train DATASET -o OUT: photos to a splat scene.

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <memory>

#include "engine/core/error.h"
#include "tools/darb/commands.h"
#include "tools/darb/device_options.h"
#include "tools/darb/live_view.h"
#include "tools/darb/train_data.h"
#include "tools/darb/train_flags.h"
#include "tools/darb/train_plan.h"
#include "tools/darb/train_recall.h"
#include "tools/darb/train_run.h"
#include "tools/darb/tune_flags.h"

namespace darb {

namespace {

// The dearest first; what takes less than a hundredth of an iteration is not printed.
void print_passes(std::vector<ReportPass> passes) {
    std::sort(passes.begin(), passes.end(),
              [](const ReportPass& a, const ReportPass& b) { return a.ms > b.ms; });
    double all_ms = 0;
    for (const ReportPass& pass : passes) all_ms += pass.ms;
    if (all_ms > 0) fmt::print("{:.2f} ms an iteration on the device:\n", all_ms);
    for (const ReportPass& pass : passes)
        if (pass.ms > 0.01 * all_ms)
            fmt::print("  {:<18} {:8.3f} ms{}\n", pass.name, pass.ms,
                       pass.roofline
                           ? fmt::format("  {:4.1f} % of the roofline", 100 * *pass.roofline)
                           : "");
}

void print_summary(const RunSummary& summary, const TrainFlags& flags) {
    fmt::print("{} iterations in {:.1f} s\n", summary.iteration, summary.seconds);
    if (!summary.evaluations.empty()) {
        const Evaluation& e = summary.evaluations.back();
        fmt::print("held-out PSNR {:.2f} dB, SSIM {:.4f}, {} splats\n", e.psnr_db, e.ssim,
                   e.splats);
    }
    print_passes(summary.passes);
    if (!summary.model.empty()) fmt::print("scene    {}\n", summary.model.string());
    if (!summary.pictures.empty())
        fmt::print("picture  {}\n", summary.pictures.front().file.string());
    if (!summary.report.empty()) fmt::print("report   {}\n", summary.report.string());
    if (summary.interrupted)
        fmt::print("interrupted; go on with: darb train --resume -o '{}'\n",
                   flags.run.output.string());
}

int train(TrainFlags flags, TuneFlags tune, std::vector<std::string> arguments) {
    const bool recalled = flags.resume && flags.dataset.empty() && !flags.run.output.empty();
    if (recalled) recall_arguments(arguments, flags, tune);
    finish_train_flags(flags);
    if (flags.dataset.empty())
        throw Error("darb train", "no data set", "Name a folder: darb train DATASET -o OUT.");

    DeviceOptions device_options = command_device(flags.device);
    const LiveSystem live(flags.view, device_options);
    Device device(device_options);
    settle_tuning(device, tune);
    Dataset dataset = load_training_data(flags);
    plan_effects(dataset, flags);
    plan_strategy(dataset, flags);
    if (!recalled) flags.run.command = command_text(std::move(arguments), flags.dataset);
    print_plan(device, dataset, flags);
    std::atomic<bool>& stop = stop_on_signals();
    const std::unique_ptr<LiveView> view =
        live.open(device, dataset, stop, flags.train.white_background);
    if (view) flags.run.on_step = [&](const LiveStep& step) { return view->show(step); };
    const RunSummary summary = run_training(device, dataset, flags.train, flags.run, &stop);
    print_summary(summary, flags);
    if (view) view->finish(summary.model);
    return 0;
}

}  // namespace

void add_train(CLI::App& app, Action& action, const std::vector<std::string>& arguments) {
    auto flags = std::make_shared<TrainFlags>();
    auto tune = std::make_shared<TuneFlags>();
    CLI::App* command = app.add_subcommand("train", "Train a splat scene from photos");
    add_train_flags(*command, *flags);
    add_tune_flags(*command, *tune);
    command->callback([flags, tune, arguments, &action] {
        action = [flags, tune, arguments] { return train(*flags, *tune, arguments); };
    });
}

}  // namespace darb
