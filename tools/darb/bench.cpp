// SPDX-License-Identifier: MIT
// darb bench [FILTER]: how long frames, training steps, sorts and starts take on this device, what
// data they move, and how near that is to what the device can do.
#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/core/system.h"
#include "engine/gpu/device.h"
#include "engine/plan/effect_plan.h"
#include "tools/bench/bench_report.h"
#include "tools/bench/cases.h"
#include "tools/bench/growth.h"
#include "tools/darb/command_list.h"
#include "tools/darb/devices.h"
#include "tools/darb/flags.h"
#include "tools/darb/outputs.h"
#include "tools/darb/tune_flags.h"
#include "trainer/job/job.h"
#include "trainer/job/scene_file.h"

namespace darb {

/// what: a scene of one's own, measured with the photos of `dataset` where one is named; otherwise
/// a regular expression for the names of the cases, where "" means all. Throws Error where nothing
/// fits.
std::vector<BenchCase> chosen_cases(const std::string& what, const std::filesystem::path& dataset,
                                    bool full);

/// The cases whose scenes exist; each of the others gets a line on stderr.
std::vector<BenchCase> possible_cases(std::vector<BenchCase> cases, const BenchOptions& options);

// darb bench --growth.

struct GrowthFlags {
    bool on = false;
    GrowthPlan plan;
    std::filesystem::path html;
};

/// Adds --growth and the options that belong to it.
void add_growth_flags(CLI::App& command, GrowthFlags& flags);

/// Measures, prints the table and writes the files that were named. filter: for the names of the
/// cases. Throws Error where the flags contradict each other.
void check_growth(const GrowthFlags& flags, const std::string& filter);

/// Where the results go, beside the page.
struct BenchOutputs {
    std::filesystem::path json, paper;
    bool quiet = false;
};
void bench_growth(Device& device, const GrowthFlags& flags, const nlohmann::json& context,
                  const BenchOutputs& outputs,
                  const std::function<void(const std::string&)>& progress);

namespace {

struct BenchFlags {
    std::string filter, device, note;  // filter: also the path of a scene
    std::filesystem::path data, json, dataset, paper;
    BenchOptions options;
    GrowthFlags growth;
    TuneFlags tune;
    bool list = false, quiet = false, brief = false;
};

void run_cases(Device& device, const DeviceRates& rates, const std::vector<BenchCase>& cases,
               const BenchFlags& flags, const nlohmann::json& context) {
    nlohmann::json json{{"context", context}, {"benchmarks", nlohmann::json::array()}};
    std::vector<BenchResult> results;
    for (const BenchCase& one : cases) {
        BenchResult result = one.run(device, rates, flags.options);
        result.name = one.name;
        tell(stream_beside_json(flags.json, flags.quiet), "{}",
             result_text(result, rates, !flags.brief));
        json["benchmarks"].push_back(result_json(result, rates));
        results.push_back(std::move(result));
        // kept even if a later case ends the run
        if (flags.json != "-") write_json(flags.json, json);
    }
    if (flags.json == "-") write_json(flags.json, json);
    write_paper(flags.paper, bench_report(results, rates, context), {});
}

int bench(BenchFlags flags) {
    check_growth(flags.growth, flags.filter);
    check_paper_folder(flags.paper);
    std::vector<BenchCase> cases = chosen_cases(flags.filter, flags.dataset, flags.options.full);
    for (const BenchCase& one : cases)
        if (flags.list) tell("{}\n", one.name);
    if (flags.list) return 0;
    BenchOptions& options = flags.options;
    const char* usual = std::getenv("DARB_TEST_DATA");
    options.data = bench_data_folder(flags.data, usual != nullptr ? usual : "../shared/data");
    options.device = flags.device;
    flags.growth.plan.sampling = options.sampling;
    options.program = program_file();
    options.plan_training = [](Dataset& dataset, const std::vector<ImageU8>& photos,
                               TrainOptions& train) {
        const EffectPlan plan = plan_training(dataset, photos, train.sh_degree);
        apply_plan(plan, train);
        apply_plan(plan, dataset.views);
    };
    options.progress = say_note;
    if (!flags.growth.on) cases = possible_cases(std::move(cases), options);
    Paths read = together({files_of(flags.filter), files_of(flags.dataset)});
    for (const BenchCase& one : cases)
        if (options.data) read = together({read, files_of(*options.data / one.file)});
    refuse_to_overwrite_inputs({flags.json, flags.growth.html}, read);
    DeviceOptions device_options = command_device(flags.device);
    Device device(device_options);
    settle_tuning(device, flags.tune);
    require_timestamps(device);
    const DeviceRates rates = measure_rates(device);
    const nlohmann::json context = context_json(device, rates, flags.note);
    tell(stream_beside_json(flags.json, flags.quiet), "{}", context_text(context));
    if (flags.growth.on)
        bench_growth(device, flags.growth, context, {flags.json, flags.paper, flags.quiet},
                     options.progress);
    else
        run_cases(device, rates, cases, flags, context);
    tell_paths(flags.quiet, {flags.json, flags.growth.html, flags.paper});
    return 0;
}

}  // namespace

void add_bench(CLI::App& app, Action& action) {
    auto flags = std::make_shared<BenchFlags>();
    CLI::App* command = app.add_subcommand("bench", "Measure speed: frames, training steps, sorts");
    command->add_option("filter", flags->filter,
                        "a scene of your own, or a regular expression for the names of cases");
    command->add_option("dataset", flags->dataset, "photos with cameras for a scene of your own");
    command->add_flag("--list", flags->list, "only print the names");
    command->add_option("--data", flags->data,
                        "folder of the data sets and of splats/; default: $DARB_TEST_DATA, else "
                        "../shared/data");
    add_json_option(*command, flags->json);
    add_paper_option(*command, flags->paper);
    command->add_option("--note", flags->note, "a note about the machine, kept in the file");
    command->add_flag("--full", flags->options.full,
                      "a longer preparation: fox_800 after 7,000 iterations, not 1,000");
    command
        ->add_option("--seconds", flags->options.sampling.seconds,
                     "at least this long for each case")
        ->capture_default_str()
        ->check(zero_or_more());
    command
        ->add_option("--samples", flags->options.sampling.least, "at least this many for each case")
        ->capture_default_str()
        ->check(CLI::Range(1, 200));
    add_growth_flags(*command, flags->growth);
    command->add_flag("--brief", flags->brief, "print one line per case, without passes");
    add_quiet_flag(*command, flags->quiet);
    command->add_option("--device", flags->device, "number or part of a name, see `darb devices`");
    add_tune_flags(*command, flags->tune);
    command->callback([flags, &action] { action = [flags] { return bench(*flags); }; });
}

std::vector<BenchCase> chosen_cases(const std::string& what, const std::filesystem::path& dataset,
                                    bool full) {
    std::error_code none;
    if (!what.empty() && std::filesystem::exists(what, none))
        return own_cases(find_scene(what), dataset);
    if (!dataset.empty())
        throw Error(what, "is no scene", "Name a splat file: darb bench SCENE DATASET.");
    std::vector<BenchCase> cases = bench_cases(full);
    try {
        const std::regex filter(what);
        std::erase_if(cases,
                      [&](const BenchCase& one) { return !std::regex_search(one.name, filter); });
    } catch (const std::regex_error& e) {
        throw Error("darb bench " + what, fmt::format("is no regular expression: {}", e.what()),
                    "Use part of a name; darb bench --list shows them.");
    }
    if (cases.empty())
        throw Error("darb bench " + what, "fits no case",
                    "darb bench --list shows them; a scene of your own is a file.");
    return cases;
}

std::vector<BenchCase> possible_cases(std::vector<BenchCase> cases, const BenchOptions& options) {
    std::error_code error;
    std::erase_if(cases, [&](const BenchCase& one) {
        if (one.file.empty()) return false;
        if (options.data && std::filesystem::exists(*options.data / one.file, error)) return false;
        say("warning: {} is left out: no {}; name its folder with --data\n", one.name,
            ((options.data ? *options.data : "DATA") / one.file).string());
        return true;
    });
    return cases;
}

void add_growth_flags(CLI::App& command, GrowthFlags& flags) {
    command.add_flag(
        "--growth", flags.on,
        "time against splats, pixels and intersections instead, with fitted exponents");
    command
        .add_option("--most-splats", flags.plan.most_splats, "splats up to which --growth measures")
        ->capture_default_str()
        ->check(CLI::Range(1'000u, 100'000'000u));
    command.add_option("--html", flags.html, "write the plots of --growth to this page");
}

void check_growth(const GrowthFlags& flags, const std::string& filter) {
    if (flags.on && !filter.empty())
        throw Error("darb bench --growth " + filter, "--growth measures no cases",
                    "Leave one of them out.");
    if (!flags.on && !flags.html.empty())
        throw Error("darb bench --html", "the page is that of --growth", "Add --growth.");
}

void bench_growth(Device& device, const GrowthFlags& flags, const nlohmann::json& context,
                  const BenchOutputs& outputs,
                  const std::function<void(const std::string&)>& progress) {
    const std::vector<GrowthCurve> curves = measure_growth(device, flags.plan, progress);
    write_json(outputs.json, {{"context", context}, {"growth", growth_json(curves)}});
    const Report report = growth_report(curves, context);
    if (!flags.html.empty()) write_file_atomic(flags.html, report.page());
    write_paper(outputs.paper, report, {});
    tell(stream_beside_json(outputs.json, outputs.quiet), "{}", growth_table(curves));
}

}  // namespace darb
