// darb bench [FILTER]: how long frames, training steps, sorts and starts take on this device, what
// they work on, and how near that is to what the device can do.

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/gpu/device_environment.h"
#include "engine/plan/effect_plan.h"
#include "tools/bench/bench_report.h"
#include "tools/bench/cases.h"
#include "tools/bench/scenes.h"
#include "tools/darb/bench_choice.h"
#include "tools/darb/bench_growth.h"
#include "tools/darb/command_list.h"
#include "tools/darb/devices.h"
#include "tools/darb/json_output.h"
#include "tools/darb/numbers.h"
#include "tools/darb/outputs.h"
#include "tools/darb/tune_flags.h"
#include "trainer/job/job.h"

namespace darb {

namespace {

struct BenchFlags {
    std::string filter, device, note;  // filter: or a scene
    std::filesystem::path data, json, dataset;
    BenchOptions options;
    GrowthFlags growth;
    TuneFlags tune;
    bool list = false, quiet = false, brief = false;
};

void run_cases(Device& device, const DeviceRates& rates, const std::vector<BenchCase>& cases,
               const BenchFlags& flags, const nlohmann::json& context) {
    nlohmann::json json{{"context", context}, {"benchmarks", nlohmann::json::array()}};
    for (const BenchCase& one : cases) {
        BenchResult result = one.run(device, rates, flags.options);
        result.name = one.name;
        tell(stream_beside_json(flags.json, flags.quiet), "{}",
             result_text(result, rates, !flags.brief));
        json["benchmarks"].push_back(result_json(result, rates));
        if (flags.json != "-") write_json(flags.json, json);  // should a later case end the run
    }
    if (flags.json == "-") write_json(flags.json, json);
}

int bench(BenchFlags flags) {
    check_growth(flags.growth, flags.filter);
    std::vector<BenchCase> cases = chosen_cases(flags.filter, flags.dataset, flags.options.full);
    for (const BenchCase& one : cases)
        if (flags.list) tell("{}\n", one.name);
    if (flags.list) return 0;
    BenchOptions& options = flags.options;
    const char* usual = std::getenv("DARB_TEST_DATA");
    options.data = bench_data_folder(flags.data, usual != nullptr ? usual : "../shared/data");
    options.device = flags.device;
    flags.growth.plan.sampling = options.sampling;
    options.program = std::filesystem::read_symlink("/proc/self/exe");
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
        bench_growth(device, flags.growth, context, flags.json, flags.quiet, options.progress);
    else
        run_cases(device, rates, cases, flags, context);
    tell_paths(flags.quiet, {flags.json, flags.growth.html});
    return 0;
}

}  // namespace

void add_bench(CLI::App& app, Action& action) {
    auto flags = std::make_shared<BenchFlags>();
    CLI::App* command = app.add_subcommand("bench", "Measure speed: frames, training steps, sorts");
    command->add_option("filter", flags->filter,
                        "a scene of one's own, or a regular expression on the cases' names");
    command->add_option("dataset", flags->dataset, "photos with cameras for a scene of one's own");
    command->add_flag("--list", flags->list, "only print the names");
    command->add_option("--data", flags->data,
                        "folder of the data sets and of splats/; default: $DARB_TEST_DATA, else "
                        "../shared/data");
    add_json_option(*command, flags->json);
    command->add_option("--note", flags->note, "about the machine, kept in the file");
    command->add_flag("--full", flags->options.full,
                      "the long set-up: fox_800 after 7,000 iterations, not 1,000");
    command->add_option("--seconds", flags->options.sampling.seconds, "of each case, at least")
        ->capture_default_str()
        ->check(zero_or_more());
    command->add_option("--samples", flags->options.sampling.least, "of each case, at least")
        ->capture_default_str()
        ->check(CLI::Range(1, 200));
    add_growth_flags(*command, flags->growth);
    command->add_flag("--brief", flags->brief, "a line a case, no passes");
    add_quiet_flag(*command, flags->quiet);
    command->add_option("--device", flags->device, "number or part of a name, see `darb devices`");
    add_tune_flags(*command, flags->tune);
    command->callback([flags, &action] { action = [flags] { return bench(*flags); }; });
}

}  // namespace darb
