// darb compare DATASET... -o OUT: kernels side by side, trained or found, as the paper's tables.

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/data/run_colmap.h"
#include "engine/gpu/device.h"
#include "engine/gpu/device_environment.h"
#include "engine/ranks/ranks.h"
#include "tools/darb/command_list.h"
#include "tools/darb/compare_flags.h"
#include "tools/darb/json_output.h"
#include "tools/darb/outputs.h"
#include "tools/darb/stop_signals.h"
#include "trainer/job/training_data.h"
#include "trainer/run/run_folder.h"
#include "trainer/step/rank_group.h"

namespace darb {

namespace {

void check_flags(CompareFlags& flags) {
    if (flags.datasets.empty())
        throw Error("darb compare", "no data set", "Name folders: darb compare DATASET... -o OUT.");
    if (flags.output.empty())
        throw Error("darb compare", "no output folder", "Name one with -o OUT.");
    std::vector<std::string> names;
    for (const std::string& dataset : flags.datasets) {
        if (!std::filesystem::exists(dataset_path(dataset)))
            throw Error(dataset, "no such file or folder", "Check the name.");
        const std::string name = dataset_name(dataset);
        if (std::find(names.begin(), names.end(), name) != names.end())
            throw Error(dataset, "another data set is called " + name + " too",
                        "Rename one folder: the name tells their runs apart.");
        names.push_back(name);
    }
    std::sort(flags.iterations.begin(), flags.iterations.end());
    flags.iterations.erase(std::unique(flags.iterations.begin(), flags.iterations.end()),
                           flags.iterations.end());
    if (flags.max_splats > 0)
        flags.forwarded.push_back("--max-splats=" + std::to_string(flags.max_splats));
    if (flags.html.empty()) flags.html = flags.output / "compare.html";
    if (flags.json.empty()) flags.json = flags.output / "compare.json";
    for (const std::string& dataset : flags.datasets)
        refuse_to_overwrite_inputs(
            {flags.json, flags.html},
            together({files_of(dataset_path(dataset)), flags.lpips, flags.kernel_files}));
}

// Paths as the file sees them.
nlohmann::json shared_json(Comparison comparison, const std::filesystem::path& file) {
    for (ComparedDataset& dataset : comparison.datasets) {
        dataset.path = name_in_json(file, dataset.path);
        for (ComparedRun& run : dataset.runs) run.folder = name_in_json(file, run.folder);
    }
    return comparison_json(comparison);
}

int compare(Ranks& ranks, CompareFlags flags) {
    check_flags(flags);
    const std::vector<int> kernels = kernels_of(flags);
    Comparison comparison;
    const std::optional<Lpips> lpips = load_lpips(flags, comparison.lpips_note);
    for (const std::string& dataset : flags.datasets) {  // bad options end it before it begins
        const TrainRequest run = train_request_of(flags, dataset, kernels.front(), 0);
        refuse_without_cameras(run, ranks.count());
        if (effect_in_words(run.effects, "cameras").value_or(false))
            throw Error("--effects with cameras", "has no place in compare, which has one for all",
                        "Leave cameras out: darb eval measures runs that refine theirs.");
    }
    for (const int kernel : kernels) comparison.kernels.emplace_back(kernel_name(kernel));
    comparison.iterations = flags.iterations;
    comparison.scales = flags.scales;
    comparison.seeds = flags.seeds;
    comparison.settings = settings_of(flags);
    DeviceOptions options = command_device(flags.device);
    {
        const Device device(options);
        comparison.device = device.info().name + ", " + device.info().driver;
    }
    std::optional<RunLock> lock;
    if (ranks.is_first()) lock.emplace(flags.output);
    const std::atomic<bool>& stop = stop_on_signals();
    int exit_code = 0;
    bool stopped = any_stops(ranks, stop);
    for (const std::string& dataset : flags.datasets) {
        if (stopped) break;
        comparison.datasets.push_back(
            compare_on(flags, dataset, kernels, lpips ? &*lpips : nullptr, ranks, stop));
        stopped = any_stops(ranks, stop);
        if (!ranks.is_first()) continue;
        leave_folders_out(comparison.datasets.back(), flags);
        for (const ComparedRun& run : comparison.datasets.back().runs)
            if (exit_code != 1 && run.exit_code != 0) exit_code = run.exit_code;
        if (flags.json != "-") write_json(flags.json, shared_json(comparison, flags.json));
        write_file_atomic(flags.html, comparison_html(comparison));
    }
    if (!ranks.is_first()) return 0;
    if (flags.json == "-") write_json(flags.json, shared_json(comparison, flags.json));
    const std::string shown = fmt::format(
        "{}{}\n{}",
        flags.quiet ? "" : comparison_table(comparison) + comparison.lpips_note + "\nreport   ",
        flags.html.string(),
        stopped ? fmt::format("interrupted{}; the same command goes on\n",
                              stop ? fmt::format(" by {}", stop_name()) : " on another rank")
                : "");
    const std::string text = printable(shown, true);
    if (flags.json == "-")
        say_text(text);
    else if (!write_or_let_go(text))
        throw Error("standard output", std::string("cannot be written: ") + std::strerror(errno),
                    "The runs are complete: " + flags.html.string() + " shows them.");
    return stopped ? std::max(stop_exit_code(), 1) : exit_code;
}

}  // namespace

void add_compare(CLI::App& app, Action& action) {
    auto flags = std::make_shared<CompareFlags>();
    CLI::App* command = app.add_subcommand(
        "compare", "Kernels side by side on data sets: trains, measures, reports; resumes");
    add_compare_flags(*command, *flags);
    command->callback([flags, &action] {
        action = [flags] {
            return with_ranks([&](Ranks& ranks) {
                try {
                    return compare(ranks, *flags);
                } catch (const ColmapStopped&) {
                    return stop_exit_code();
                }
            });
        };
    });
}

}  // namespace darb
