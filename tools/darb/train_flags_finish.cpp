// Command line to options: what the parser leaves as words.
#include <fmt/format.h>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/kernels/shaped_kernel.h"
#include "tools/darb/effect_flags.h"
#include "tools/darb/numbers.h"
#include "tools/darb/outputs.h"
#include "tools/darb/train_flags.h"
#include "trainer/options/strategy.h"

namespace darb {

TrainFlags parse_train_flags(std::vector<std::string> words, const std::string& options,
                             const std::string& command) {
    words.insert(words.begin(), "train");
    for (const std::string& word : CLI::detail::split_up(options)) words.push_back(word);
    TrainFlags f;
    CLI::App app;
    add_train_flags(*app.add_subcommand("train"), f);
    try {
        app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
        refuse_no_numbers(app);
    } catch (const CLI::ParseError& e) {
        throw Error(command, e.what(), "`darb train --help` lists what --train-options takes.");
    }
    if (!f.request.blocks.empty())
        throw Error(command + " --blocks " + f.request.blocks, "is an option of darb train alone",
                    "Leave it out.");
    finish_train_flags(f);
    return f;
}

namespace {

// --depths FOLDER, which 3DGS looks for in the data set.
void finish_depths(TrainFlags& f) {
    namespace fs = std::filesystem;
    if (f.depths.empty()) return;
    const std::string option = "--depths " + f.depths.string();
    if (words_refuse_effect(f.request.effects, "depth"))
        throw Error(option, fmt::format("means nothing with --effects {}", f.request.effects),
                    "Leave one of the two out.");
    f.request.effects = effects_beside(f.request.effects, "+depth");
    if (f.request.resume) return;  // the folder was as seen from where the run began
    const fs::path set = fs::is_regular_file(f.request.dataset)
                             ? fs::path(f.request.dataset).parent_path()
                             : fs::path(f.request.dataset);
    fs::path read = set / "depths";  // the order in which they are looked for
    if (!fs::is_directory(read)) read = set / "depth";
    std::error_code none;
    if (!fs::equivalent(read, set / f.depths, none) && !fs::equivalent(read, f.depths, none))
        throw Error(option, "is no folder that measured depths are read from",
                    fmt::format("Put them into {}: 16-bit grey PNG in millimetres or .npy in "
                                "metres, named as the photos. Then {} or --effects +depth "
                                "trains with them.",
                                (set / "depths").string(), "--depths depths"));
}

// --strategy, and whether it knows what was given beside it.
void finish_strategy(TrainFlags& f) {
    const auto strategy = strategy_from_name(f.strategy);
    if (!strategy)
        throw Error("--strategy " + f.strategy, "no such strategy",
                    fmt::format("Use {}.", strategy_names()));
    f.request.train.strategy = *strategy;
    for (const auto& [name, strategies] : f.of_strategies)
        if (strategies.find(f.strategy) == std::string::npos)
            throw Error(name, fmt::format("means nothing with --strategy {}", f.strategy),
                        fmt::format("Leave it out; it goes with --strategy {}.", strategies));
}

// Where no -o is given: output/NAME, of the folder or the video, or of a .json file's folder.
std::filesystem::path usual_output(const std::string& dataset) {
    std::filesystem::path path = std::filesystem::absolute(dataset).lexically_normal();
    if (path.filename().empty() || path.extension() == ".json") path = path.parent_path();
    return std::filesystem::path("output") / path.stem();
}

// Scripts give those of long runs to short ones, too.
void note_iterations_beyond(const TrainFlags& f) {
    const std::pair<const char*, const std::vector<int>&> lists[] = {
        {"--test-iterations", f.request.test_iterations},
        {"--save-iterations", f.request.save_iterations},
        {"--checkpoint-iterations", f.request.checkpoint_iterations}};
    for (const auto& [name, list] : lists)
        for (const int iteration : list)
            if (iteration > f.request.train.iterations)
                say_note(fmt::format("note: {} {} is beyond the end at {}: it never comes", name,
                                     iteration, f.request.train.iterations));
}

}  // namespace

void finish_train_flags(TrainFlags& f) {
    TrainRequest& r = f.request;
    TrainOptions& t = r.train;
    r.effects = effects_beside(r.effects, f.effects);
    const int kernel = chosen_kernel(f.kernel).value_or(KERNEL_GAUSSIAN);
    const auto row = kernel_with_pulses(kernel, f.pulses);
    if (!row)
        throw Error(fmt::format("--kernel {} --pulses {}", kernel_name(kernel), f.pulses),
                    "there is no such kernel",
                    "Only raised_cosine and sinc have --pulses 2 or 3; others have one.");
    finish_depths(f);
    choose_effects(r.effects, EffectUse::training, r.data);
    finish_strategy(f);
    t.kernel = *row;
    t.accuracy = chosen_accuracy(f.accuracy, true);
    note_unused_choices(f.accuracy, t.kernel);
    t.footprint =
        t.accuracy.value(kFootprint) == FOOTPRINT_EXACT ? Footprint::exact : Footprint::psi;
    check_request(r);
    if (t.shape_lr && !kernel_has_shape(t.kernel))
        say_note("note: --shape-lr is not used: splats have shapes of their own with --kernel " +
                 shaped_kernel_names());
    if (r.page && kernel_has_shape(t.kernel))
        throw Error("--html", "web pages cannot draw shapes of splats yet",
                    "Leave it out; darb convert --kernel gaussian OUT page.html writes a page of "
                    "nearest Gaussians.");
    note_iterations_beyond(f);
    if (r.output.empty() && r.dataset.empty() && !r.resume)
        throw Error("darb train", "no data set", "Name a folder: darb train DATASET -o OUT.");
    if (r.output.empty() && !r.resume) {
        r.output = usual_output(r.dataset);
        if (!f.quiet) say("output: {}; -o names another\n", r.output.string());
    }
    if (r.output.empty()) throw Error("darb train", "no output folder", "Name one with -o OUT.");
}

}  // namespace darb
