// SPDX-License-Identifier: MIT
// darb compare DATASET... -o OUT: compares kernels, trained or found, in the paper's tables.
#include "tools/darb/compare.h"

#include <fmt/format.h>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/core/system.h"
#include "engine/data/camera_list.h"
#include "engine/data/dataset.h"
#include "engine/data/image_io.h"
#include "engine/data/metrics.h"
#include "engine/data/run_colmap.h"
#include "engine/gpu/device.h"
#include "engine/kernels/kernel_family.h"
#include "engine/plan/tuner.h"
#include "engine/ranks/ranks.h"
#include "engine/scene/splat_file.h"
#include "tools/darb/command_list.h"
#include "tools/darb/flags.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/scene_evaluation.h"
#include "tools/darb/train_flags.h"
#include "tools/darb/train_plan.h"
#include "tools/paper/compare_merge.h"
#include "tools/paper/compare_report.h"
#include "tools/paper/compare_runs.h"
#include "tools/paper/compare_stats.h"
#include "trainer/job/job.h"
#include "trainer/job/scene_file.h"
#include "trainer/job/training_data.h"
#include "trainer/options/strategy.h"
#include "trainer/run/run_folder.h"
#include "trainer/step/checkpoint.h"
#include "trainer/step/rank_group.h"

namespace darb {

/// Prints why a run failed, unless it was interrupted, and its notes; -q hides the notes.
void say_what_went_wrong(const ComparedRun& run);

/// Measures the runs on one data set.
class RunMeasurer {
  public:
    /// path: the data set's. Throws Error where a photo is too small for one of flags.scales. lpips
    /// may be null.
    RunMeasurer(const CompareFlags& flags, const std::filesystem::path& path,
                const Dataset& dataset, const TrainRequest& first, const Lpips* lpips);

    // These take runs that ended normally. An error becomes a note and leaves the run as it is.

    /// Measures everything but blending.
    void measure(ComparedRun& run);
    /// Measures splats of another program on these views, and keeps their pictures.
    ComparedRun measure_added(const AddedMethod& method, const std::vector<View>& held_out);
    /// Measures the first complete run of each kernel, all on one device, because the times are
    /// compared.
    void measure_blending(std::vector<ComparedRun>& runs, const std::vector<View>& held_out) const;
    /// Describes what is measured. If ranks differed in it, only some runs would get the numbers.
    std::string measurements() const;

  private:
    void on_device(ComparedRun& run, const char* what,
                   const std::function<void(Device&)>& measurement) const;
    void measure_models(ComparedRun& run, Device& device) const;

    const CompareFlags& flags_;
    ViewLpips lpips_;
    std::vector<std::vector<View>> scaled_;  // [scale]
    SceneEvaluation options_;
    Dataset off_path_;
    std::string lpips_name_;
};

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
    check_paper_folder(flags.paper);
    std::sort(flags.iterations.begin(), flags.iterations.end());
    flags.iterations.erase(std::unique(flags.iterations.begin(), flags.iterations.end()),
                           flags.iterations.end());
    if (flags.max_splats > 0)
        flags.forwarded.push_back("--max-splats=" + std::to_string(flags.max_splats));
    if (flags.html.empty()) flags.html = flags.output / "compare.html";
    if (flags.json.empty()) flags.json = flags.output / "compare.json";
    Paths added;
    for (const AddedMethod& method : added_methods(flags)) added.push_back(method.file);
    for (const std::string& dataset : flags.datasets)
        refuse_to_overwrite_inputs(
            {flags.json, flags.html},
            together({files_of(dataset_path(dataset)), flags.lpips, flags.kernel_files, added}));
}

// Paths as seen from the file.
nlohmann::json shared_json(Comparison comparison, const std::filesystem::path& file) {
    for (ComparedDataset& dataset : comparison.datasets) {
        dataset.path = name_in_json(file, dataset.path);
        for (ComparedRun& run : dataset.runs) run.folder = name_in_json(file, run.folder);
    }
    return comparison_json(comparison);
}

/// What all its data sets share.
void take_head(const CompareFlags& flags, const std::vector<int>& kernels, Comparison& comparison) {
    for (const int kernel : kernels) comparison.kernels.emplace_back(kernel_name(kernel));
    for (const AddedMethod& method : added_methods(flags))
        if (std::find(comparison.added.begin(), comparison.added.end(), method.name) ==
            comparison.added.end())
            comparison.added.push_back(method.name);
    comparison.kernels.insert(comparison.kernels.end(), comparison.added.begin(),
                              comparison.added.end());
    comparison.iterations = flags.iterations;
    comparison.scales = flags.scales;
    comparison.seeds = flags.seeds;
    comparison.settings = settings_of(flags);
    DeviceOptions options = command_device(flags.device);
    {
        const Device device(options);
        comparison.machines = {{device.info().name, device.info().driver}};
        comparison.device = device.info().name + ", " + device.info().driver;
    }
}

int compare(Ranks& ranks, CompareFlags flags) {
    check_flags(flags);
    const std::vector<int> kernels = kernels_of(flags);
    Comparison comparison;
    const std::optional<Lpips> lpips = load_lpips(flags, comparison.lpips_note);
    // wrong options end it before anything begins
    for (const std::string& dataset : flags.datasets) {
        const TrainRequest run = train_request_of(flags, dataset, kernels.front(), 0);
        refuse_without_cameras(run, ranks.count());
        if (effect_in_words(run.effects, "cameras").value_or(false))
            throw Error("--effects with cameras", "has no place in compare, which has one for all",
                        "Leave cameras out: darb eval measures runs that refine theirs.");
    }
    take_head(flags, kernels, comparison);
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
        const Report report = comparison_report(comparison);
        write_file_atomic(flags.html, report.page());
        write_paper(flags.paper, report, {});
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
        "compare",
        "Train, measure and report several kernels on data sets; resumes where it stopped");
    add_compare_flags(*command, *flags);
    command->callback([flags, &action] {
        action = [flags] {
            if (!flags->merge.empty()) return merge_reports(*flags);
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

// What the runs of a comparison have in common, as its files put it: without folders of the
// machine.

namespace fs = std::filesystem;

std::vector<fs::path> paths_in_options(const CompareFlags& flags) {
    std::vector<std::string> words = CLI::detail::split_up(flags.train_options);
    words.insert(words.end(), flags.forwarded.begin(), flags.forwarded.end());
    std::vector<fs::path> paths;
    std::error_code none;
    for (const std::string& word : words) {
        const fs::path value = word.starts_with('-') ? word.substr(word.find('=') + 1) : word;
        if (value.is_absolute() || (value.has_parent_path() && fs::exists(value, none)))
            paths.push_back(value);
    }
    return paths;
}

std::string settings_of(const CompareFlags& flags) {
    std::string words;
    for (const std::string& word : flags.forwarded) words += " " + word;
    if (!flags.train_options.empty()) words += " " + flags.train_options;
    for (const fs::path& path : paths_in_options(flags))
        if (const auto at = words.find(path.string()); at != std::string::npos)
            words.replace(at, path.string().size(), shared_name(flags.output, path));
    const std::string growth =
        flags.max_splats > 0
            ? fmt::format("Growth stops at {} splats.", flags.max_splats)
            : "Equal densification threshold, so each kernel has its own number of splats.";
    return fmt::format("{} Options of training:{}.", growth,
                       words.empty() ? " the defaults" : words);
}

void leave_folders_out(ComparedDataset& dataset, const CompareFlags& flags) {
    std::vector<std::filesystem::path> paths = paths_in_options(flags);
    paths.insert(paths.end(), {dataset_path(dataset.path.string()), flags.output});
    for (const AddedMethod& method : added_methods(flags)) paths.push_back(method.file);
    for (ComparedRun& run : dataset.runs)
        for (std::string* text : {&run.failure, &run.notes})
            for (const std::filesystem::path& path : paths) *text = without_folders(*text, path);
}

void check_same_runs(Ranks& ranks, const CompareFlags& flags, const std::string& dataset,
                     const std::vector<int>& kernels, const std::string& fingerprint,
                     const std::string& measurements) {
    if (ranks.count() == 1) return;
    std::string runs = fmt::format("with seeds {}, kernels", flags.seeds);
    for (const int kernel : kernels) runs += fmt::format(" {}", kernel_name(kernel));
    RankFacts facts = rank_facts();
    facts.emplace_back("data set", fingerprint.empty() ? "unread" : fingerprint);
    facts.emplace_back("runs", runs);
    facts.emplace_back("measurements", measurements);
    facts.emplace_back("settings",
                       settings_text(train_request_of(flags, dataset, kernels.front(), 0).train));
    check_same(ranks, facts);
}

std::optional<Lpips> load_lpips(const CompareFlags& flags, std::string& note) {
    note = "LPIPS was left out: no weights were given (--lpips FILE).";
    for (const auto& file : flags.lpips)
        if (!std::filesystem::exists(file)) {
            constexpr const char* left_out = "LPIPS was left out: {} does not exist.";
            note = fmt::format(left_out, file.filename().string());
            say("warning: {}\n", fmt::format(left_out, file.string()));
            return std::nullopt;
        }
    if (flags.lpips.empty()) return std::nullopt;
    std::optional<Lpips> lpips(std::in_place, flags.lpips, LpipsOptions{flags.lpips_as_3dgs, 0});
    note = fmt::format("LPIPS: {}, colours from {} to 1{}.", lpips->net_name(),
                       flags.lpips_as_3dgs ? "0" : "-1",
                       flags.lpips_as_3dgs ? " as in the evaluation of 3DGS" : "");
    return lpips;
}

// The training runs of a comparison, made by the code of `darb train`.

namespace {

/// One data set, and what its runs share.
class Comparer {
  public:
    Comparer(const CompareFlags& flags, const std::string& name, int kernel, const Lpips* lpips)
        : flags_(flags), name_(name) {
        TrainRequest first = train_request_of(flags, name, kernel, 0);
        std::optional<RunLock> lock;  // held while COLMAP writes
        dataset_ = load_training_data(first, lock, {flags.quiet, &stop_on_signals()});
        say_notes(dataset_.notes);
        if (held_out().empty())
            throw Error(name, "holds no view out", "Give it more photos, or a list of test views.");
        photos_ = load_photos(dataset_.views);
        measurer_.emplace(flags, dataset_path(name), dataset_, first, lpips);
    }

    const std::vector<View>& views() const { return dataset_.views; }
    std::string fingerprint() const { return dataset_fingerprint(dataset_, photos_); }
    RunMeasurer& measurer() { return *measurer_; }
    std::vector<View> held_out() const { return held_out_views(dataset_.views); }
    /// This rank's share of all runs, by seed and then by kernel, until the user stops.
    std::vector<ComparedRun> runs(const std::vector<int>& kernels, const Ranks& ranks,
                                  const std::atomic<bool>& stop);

  private:
    ComparedRun run(int kernel, std::uint64_t seed, const std::atomic<bool>& stop);
    void train(TrainJob& job, const std::atomic<bool>& stop);

    const CompareFlags& flags_;
    std::string name_;
    Dataset dataset_;
    std::vector<ImageU8> photos_;
    std::optional<RunMeasurer> measurer_;
};

void Comparer::train(TrainJob& job, const std::atomic<bool>& stop) {
    job = resolve(job.request, dataset_, photos_);
    const TrainRequest& request = job.request;
    for (const std::string& note : job.notes) say_note("note: " + note);
    const TrainOptions& options = job.options;
    const RunState state =
        run_state(request.output, settings_text(options), format_camera_list(job.dataset.views),
                  options.iterations, held_out().size(), hold_out_text(request.data.held_out));
    const std::string title = fmt::format("{}: {}, seed {}", dataset_name(name_),
                                          kernel_name(options.kernel), options.seed);
    if (state == RunState::finished) return say_note(title + ": is there");
    if (state == RunState::partial) job.resume_from = request.output / "checkpoint.darb";
    say_note(title);
    const RunLock lock(request.output);
    Device device(
        // one for each run, so that the peak of memory is the run's own
        command_device(flags_.device));
    settle_tuning(device);
    find_start(device, job, say_stereo_begins);
    darb::run(device, job, {.quiet = flags_.quiet, .stop = &stop});
}

std::vector<ComparedRun> Comparer::runs(const std::vector<int>& kernels, const Ranks& ranks,
                                        const std::atomic<bool>& stop) {
    std::vector<ComparedRun> done;
    for (int seed = 0, item = 0; seed < flags_.seeds; ++seed)
        for (const int kernel : kernels)
            if (has_turn(ranks, std::size_t(item++)) && !stop)
                done.push_back(run(kernel, static_cast<std::uint64_t>(seed), stop));
    return done;
}

ComparedRun Comparer::run(int kernel, std::uint64_t seed, const std::atomic<bool>& stop) {
    const TrainRequest request = train_request_of(flags_, name_, kernel, seed);
    ComparedRun run;
    run.kernel = kernel_name(kernel);
    run.seed = seed;
    run.folder = request.output;
    TrainJob job{.request = request, .options = request.train};
    job.dataset.views = dataset_.views;
    try {
        train(job, stop);
        if (stop) run.failure = "interrupted; the same command goes on with it";
        if (!stop) read_run(run, flags_.iterations);
    } catch (const std::exception& e) {
        run.failure = e.what();
        count_exception(e, run);
    }
    if (run.failure.empty())
        measurer_->measure(run);
    else
        read_unfinished_run(run, flags_.iterations, settings_text(job.options),
                            format_camera_list(job.dataset.views));
    say_what_went_wrong(run);
    return run;
}

}  // namespace

ComparedDataset compare_on(const CompareFlags& flags, const std::string& dataset,
                           const std::vector<int>& kernels, const Lpips* lpips, Ranks& ranks,
                           const std::atomic<bool>& stop) {
    ComparedDataset result{dataset_name(dataset), dataset, {}};
    std::optional<Comparer> comparer;
    try {
        comparer.emplace(flags, dataset, kernels.front(), lpips);
    } catch (const Error& e) {
        check_same_runs(ranks, flags, dataset, kernels, "", "");
        ComparedRun& failed = result.runs.emplace_back();
        failed.kernel = "every kernel";
        failed.failure = e.what();
        failed.exit_code = 2;
        say_what_went_wrong(failed);
        return result;
    }
    check_same_runs(ranks, flags, dataset, kernels, comparer->fingerprint(),
                    comparer->measurer().measurements());
    refuse_to_overwrite_inputs({flags.json, flags.html}, files_of(comparer->views()));
    result.fingerprint = comparer->fingerprint();
    result.width = comparer->held_out().front().camera.width;
    result.height = comparer->held_out().front().camera.height;
    const std::vector<ComparedRun> own = comparer->runs(kernels, ranks, stop);
    result.runs = runs_of_all(ranks, own, kernels.size() * static_cast<std::size_t>(flags.seeds));
    for (const ComparedRun& run : result.runs)
        if (std::none_of(own.begin(), own.end(),
                         [&](const ComparedRun& its) { return its.folder == run.folder; }))
            say_what_went_wrong(run);
    for (const AddedMethod& method : added_methods(flags))
        if (method.dataset == result.name && ranks.is_first() && !stop)
            result.runs.push_back(comparer->measurer().measure_added(method, comparer->held_out()));
    if (ranks.is_first() && !stop)
        comparer->measurer().measure_blending(result.runs, comparer->held_out());
    return result;
}

// The command line of `darb compare`, and the one that each of its runs gets.

namespace fs = std::filesystem;

namespace {

/// An option that is passed on to `darb train` as it is.
void forward(CLI::App& command, CompareFlags& flags, const std::string& names,
             const std::string& word, const std::string& help) {
    command.add_option_function<std::string>(
        names,
        [&flags, word](const std::string& value) { flags.forwarded.push_back(word + "=" + value); },
        help);
}

/// What is measured beside PSNR and SSIM, and on what beside the runs.
void add_measure_flags(CLI::App& command, CLI::Option* datasets, CompareFlags& flags) {
    command
        .add_option("--lpips", flags.lpips,
                    "a safetensors file with the weights of AlexNet or VGG16 or of LPIPS's layers; "
                    "once for each file")
        ->allow_extra_args(false);
    command.add_flag("--flip", flags.flip,
                     "also measure FLIP, what a viewer sees change between picture and photo");
    auto* add = command
                    .add_option("--add", flags.add,
                                "NAME=FILE: also measure the splats of another program, in any "
                                "format that darb reads; NAME@DATASET=FILE where there are several "
                                "data sets; once for each")
                    ->allow_extra_args(false);
    command
        .add_option("--merge", flags.merge,
                    "instead of comparing, make one report of several compare.json, such as those "
                    "of several machines")
        ->excludes(datasets)
        ->excludes(add);
    command.add_flag("--lpips-as-3dgs", flags.lpips_as_3dgs,
                     "feed colours from 0 to 1 into LPIPS, as published figures of splats do");
}

}  // namespace

void add_compare_flags(CLI::App& command, CompareFlags& flags) {
    auto* datasets = command.add_option(
        "datasets", flags.datasets,
        "data sets as for darb train; PATH@images_4 names a photo folder for one of them");
    command.add_option("-o,--output", flags.output,
                       "folder of the runs, OUT/DATASET/KERNEL/seedN; finished runs are kept");
    command
        .add_option("--kernels", flags.kernels,
                    "paper (its five), all (nine), or names and expressions with commas")
        ->capture_default_str();
    add_kernel_file_flag(command, flags.kernel_files);
    command
        .add_option(
            "--pulses", flags.pulses,
            "pulses of raised_cosine and sinc, with commas: 1,2,3 tests what rings cost and gain")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->capture_default_str()
        ->check(CLI::Range(1, KERNEL_MAX_PULSES));
    command
        .add_option("--iterations", flags.iterations,
                    "evaluate after these iterations, with commas")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->capture_default_str()
        ->check(CLI::Range(1, 10'000'000));
    command.add_option("--seeds", flags.seeds, "runs of each")
        ->capture_default_str()
        ->check(CLI::Range(1, 100));
    command
        .add_option("--max-splats", flags.max_splats,
                    "growth stops at this many splats, so that counts are equal")
        ->check(above_zero());
    forward(command, flags, "-r,--resolution", "--resolution", "as in darb train");
    add_scales_flag(command, flags.scales);
    forward(command, flags, "--hold-out", "--hold-out", "as in darb train");
    forward(command, flags, "-i,--images", "--images", "as in darb train");
    forward(command, flags, "--effects", "--effects", "as in darb train");
    forward(command, flags, "--footprint", "--footprint", "psi or exact");
    forward(command, flags, "--strategy", "--strategy", strategy_names());
    command.add_option("--train-options", flags.train_options,
                       "more options of darb train, together in quotes");
    add_measure_flags(command, datasets, flags);
    command
        .add_option("--blending-views", flags.blending_views,
                    "views whose blending is counted and timed; 0: none")
        ->capture_default_str()
        ->check(zero_or_more());
    command.add_option("--html", flags.html, "the report's file (default OUT/compare.html)");
    command.add_option("--json", flags.json,
                       "the numbers' file (default OUT/compare.json); - is stdout");
    add_paper_option(command, flags.paper);
    command.add_option("--device", flags.device, "number or part of a name, see `darb devices`");
    add_quiet_flag(command, flags.quiet);
}

std::vector<int> kernels_of(const CompareFlags& flags) {
    std::vector<int> rows;
    for (const int kernel : kernels_from_list("--kernels", flags.kernels, flags.kernel_files))
        for (const int pulses : flags.pulses)
            if (const auto row = kernel_with_pulses(kernel, pulses);
                row && std::find(rows.begin(), rows.end(), *row) == rows.end())
                rows.push_back(*row);
    if (rows.empty())
        throw Error("--pulses", "none of the kernels has so many",
                    "raised_cosine and sinc have 1 to 3 pulses, the others one.");
    return rows;
}

std::vector<AddedMethod> added_methods(const CompareFlags& flags) {
    std::vector<AddedMethod> methods;
    std::set<std::string> taken;
    for (const std::string& text : flags.add) {
        const std::string option = "--add " + text;
        const std::size_t equals = text.find('=');
        if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
            throw Error(option, "is not NAME=FILE", "Give it as --add 3dgs=point_cloud.ply.");
        AddedMethod method{text.substr(0, equals), "", text.substr(equals + 1)};
        if (const std::size_t at = method.name.rfind('@'); at != std::string::npos) {
            method.dataset = method.name.substr(at + 1);
            method.name.resize(at);
        } else if (flags.datasets.size() == 1) {
            method.dataset = dataset_name(flags.datasets.front());
        } else {
            throw Error(option, "does not say to which of the data sets it belongs",
                        "Name it: --add " + method.name + "@" +
                            dataset_name(flags.datasets.front()) + "=" + method.file.string() +
                            ".");
        }
        if (std::none_of(flags.datasets.begin(), flags.datasets.end(), [&](const auto& dataset) {
                return dataset_name(dataset) == method.dataset;
            }))
            throw Error(option, "no data set here is called " + method.dataset,
                        "Name one by the last folder of its path.");
        if (method.name.empty() || kernel_from_name(method.name))
            throw Error(option, "a method cannot be called \"" + method.name + "\"",
                        "Give it a name that is not empty and no kernel's.");
        if (!taken.insert(method.dataset + "/" + file_name(method.name)).second)
            throw Error(option, "another method has this name",
                        "Give them names that differ in letters or digits.");
        if (!fs::exists(method.file))
            throw Error(method.file.string(), "no such file or folder", "Check the name.");
        methods.push_back(std::move(method));
    }
    return methods;
}

int merge_reports(const CompareFlags& flags) {
    if (flags.output.empty())
        throw Error("darb compare --merge", "no output folder", "Name one with -o OUT.");
    if (flags.merge.size() < 2)
        throw Error("darb compare --merge", "names one report", "Name two or more.");
    check_paper_folder(flags.paper);
    const fs::path html = flags.html.empty() ? flags.output / "compare.html" : flags.html;
    const fs::path json = flags.json.empty() ? flags.output / "compare.json" : flags.json;
    refuse_to_overwrite_inputs({html, json}, flags.merge);
    std::vector<Comparison> reports;
    for (const fs::path& file : flags.merge) reports.push_back(read_comparison(file));
    MergedComparison merged = merge_comparisons(flags.merge, reports);
    say_notes(merged.notes);
    const std::string lines = repeated_lines(merged.repeated);
    for (RepeatedCell& cell : merged.repeated)
        for (std::string* file : {&cell.first, &cell.second}) *file = name_in_json(json, *file);
    Report report = comparison_report(merged.comparison);
    report.table(repeated_table(merged.repeated), 2);
    fs::create_directories(flags.output);
    nlohmann::json numbers = shared_json(merged.comparison, json);
    numbers["repeated"] = repeated_json(merged.repeated);
    write_json(json, numbers);
    write_file_atomic(html, report.page());
    write_paper(flags.paper, report, flags.merge);
    tell(stream_beside_json(json, flags.quiet), "{}{}report   {}\n",
         comparison_table(merged.comparison), lines, html.string());
    tell_paths(flags.quiet, {json, html, flags.paper});
    return 0;
}

std::string dataset_path(const std::string& dataset) {
    return fs::exists(dataset) ? dataset : dataset.substr(0, dataset.rfind('@'));
}

std::string dataset_name(const std::string& dataset) {
    const auto path = fs::absolute(dataset_path(dataset)).lexically_normal();
    return (path.has_filename() ? path : path.parent_path()).filename().string();
}

TrainRequest train_request_of(const CompareFlags& flags, const std::string& dataset, int kernel,
                              std::uint64_t seed) {
    const std::string name(kernel_name(kernel)), path = dataset_path(dataset);
    const auto folder = flags.output / dataset_name(dataset) / name / fmt::format("seed{}", seed);
    std::vector<std::string> words{path, "-o", folder.string(), "--eval"};
    words.push_back("--kernel=" + std::string(kernel_name(*kernel_with_pulses(kernel, 1))));
    words.push_back(fmt::format("--pulses={}", kernel_pulses(kernel)));
    words.push_back(fmt::format("--seed={}", seed));
    words.push_back(fmt::format("--iterations={}", flags.iterations.back()));
    for (const char* list : {"--test-iterations", "--save-iterations"}) {
        words.push_back(list);
        for (const int i : flags.iterations) words.push_back(std::to_string(i));
    }
    const bool own_images = path.size() < dataset.size();
    if (own_images) words.push_back("--images=" + dataset.substr(path.size() + 1));
    for (const std::string& word : flags.forwarded)
        if (!own_images || !word.starts_with("--images=")) words.push_back(word);
    return parse_train_words(std::move(words), flags.train_options, "darb compare");
}

void say_what_went_wrong(const ComparedRun& run) {
    if (run.exit_code != 0 && !run.failure.empty()) say("failed: {}\n", run.failure);
    if (!run.notes.empty()) say_note("note: " + run.notes);
}

RunMeasurer::RunMeasurer(const CompareFlags& flags, const std::filesystem::path& path,
                         const Dataset& dataset, const TrainRequest& first, const Lpips* lpips)
    : flags_(flags),
      lpips_(lpips),
      off_path_(off_path_of(path, dataset.options)),
      lpips_name_(lpips ? lpips->net_name() : "none") {
    for (const double scale : flags.scales)
        scaled_.push_back(scaled_views(held_out_views(dataset.views), scale));
    options_.background = glm::vec3(first.train.white_background ? 1.0f : 0.0f);
    options_.effects = parse_effects(first.effects);  // measured with the effects of the training
    options_.alpha_is_mask = dataset.alpha_is_mask;
}

void RunMeasurer::measure_models(ComparedRun& run, Device& device) const {
    for (ComparedAt& at : run.at) {
        if (at.model.empty()) continue;
        const SplatModel model = load_splats(at.model);
        for (std::size_t i = 0; i < scaled_.size(); ++i) {
            const Evaluation e = evaluate_scene(device, model, scaled_[i], options_);
            at.scales.push_back({flags_.scales[i], e.psnr_db, e.ssim});
        }
        if (off_path_.views.empty()) continue;
        SceneEvaluation options = options_;
        options.alpha_is_mask = off_path_.alpha_is_mask;
        at.off_path_db =
            evaluate_scene(device, model, held_out_views(off_path_.views), options).psnr_db;
    }
}

void RunMeasurer::on_device(ComparedRun& run, const char* what,
                            const std::function<void(Device&)>& measurement) const {
    attempt(run, what, [&] {
        DeviceOptions options = command_device(flags_.device);
        Device device(options);
        settle_tuning(device);
        measurement(device);
    });
}

void RunMeasurer::measure(ComparedRun& run) {
    attempt(run, "LPIPS", [&] { lpips_.measure(run); });
    if (flags_.flip) attempt(run, "FLIP", [&] { measure_flip(run); });
    attempt(run, "learned shapes", [&] { read_shapes_of(run); });
    if (!scaled_.empty() || !off_path_.views.empty())
        on_device(run, "other sizes and views off the path",
                  [&](Device& device) { measure_models(run, device); });
}

ComparedRun RunMeasurer::measure_added(const AddedMethod& method,
                                       const std::vector<View>& held_out) {
    ComparedRun run;
    run.kernel = method.name;
    run.trained_here = false;
    run.folder = flags_.output / method.dataset / "added" / file_name(method.name);
    const int last = flags_.iterations.back();
    const std::filesystem::path pictures = run.folder / "held_out" / std::to_string(last);
    try {
        const SplatModel model = load_scene(method.file);
        SceneEvaluation options = options_;
        std::set<std::string> used;
        std::vector<std::filesystem::path> files;
        options.on_picture = [&](const View& view, const ImageF& picture, const ImageU8& photo) {
            files.push_back(pictures / picture_name(view.name, used));
            write_png(files.back(), side_by_side(composite(photo, options_.background), picture));
        };
        Device device(command_device(flags_.device));
        settle_tuning(device);
        const Evaluation measured = evaluate_scene(device, model, held_out, options);
        ComparedAt at;
        at.psnr_db = measured.psnr_db;
        at.ssim = measured.ssim;
        at.seconds = std::nan("");
        at.splats = static_cast<double>(model.size());
        at.model = find_scene(method.file);
        if (std::filesystem::is_regular_file(at.model))
            at.model_mb = 1e-6 * static_cast<double>(std::filesystem::file_size(at.model));
        if (measured.arc) at.arc_db = measured.arc->psnr_db;
        for (std::size_t v = 0; v < measured.views.size(); ++v)
            at.views.push_back({measured.views[v].name, measured.views[v].psnr_db,
                                measured.views[v].ssim, std::nullopt, files[v]});
        for (const int iteration : flags_.iterations) {
            run.at.push_back(at);
            run.at.back().iteration = iteration;
        }
    } catch (const std::exception& e) {
        run.failure = e.what();
        count_exception(e, run);
    }
    if (run.failure.empty()) measure(run);
    say_what_went_wrong(run);
    return run;
}

void RunMeasurer::measure_blending(std::vector<ComparedRun>& runs,
                                   const std::vector<View>& held_out) const {
    if (flags_.blending_views == 0) return;
    std::vector<Camera> cameras;
    for (const View& view : held_out) cameras.push_back(view.camera);
    std::set<std::string> done;  // kernels
    for (ComparedRun& run : runs) {
        if (!run.failure.empty() || done.contains(run.kernel)) continue;
        const std::string before = run.notes;
        on_device(run, "blending", [&](Device& device) {
            measure_blending_of(run, device, cameras, flags_.blending_views);
            done.insert(run.kernel);
        });
        if (run.notes != before) say_note("note: " + run.notes.substr(before.size()));
    }
}

std::string RunMeasurer::measurements() const {
    std::string text =
        fmt::format("LPIPS {}, {} views off the path, sizes", lpips_name_, off_path_.views.size());
    for (const double scale : flags_.scales) text += fmt::format(" {}", scale);
    return text;
}

}  // namespace darb
