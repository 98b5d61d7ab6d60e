// SPDX-License-Identifier: MIT
// darb cost SCENE.ply [DATASET]: the time that each accuracy setting costs and the accuracy that it
// gains.
#include <fmt/format.h>
#include <filesystem>
#include <memory>
#include <string>

#include "engine/core/count_text.h"
#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/ranks/ranks.h"
#include "engine/scene/stored_units.h"
#include "tools/cost/cost_report.h"
#include "tools/cost/train_cost.h"
#include "tools/darb/command_list.h"
#include "tools/darb/devices.h"
#include "tools/darb/flags.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/train_flags.h"
#include "tools/darb/train_plan.h"
#include "tools/darb/tune_flags.h"
#include "trainer/job/job.h"
#include "trainer/job/scene_file.h"

namespace darb {

struct CostFlags {
    std::string scene, dataset, device, train, train_options;
    int seeds = 0, iterations = 0;
    std::filesystem::path json, html, paper;
    bool quick = false, full = false, quiet = false, white_background = false;
    DatasetOptions data;
    TuneFlags tune;
    KernelFlags kernel;  // replaces the scene's
    std::string size = "640x480";
    StoredUnits units;  // how the scene's file stores its values
};

/// Runs darb cost --train DATASET.
int train_cost(Ranks& ranks, const CostFlags& flags);

namespace {

// How much work a run does: quick about a tenth of the default, full about ten times as much.
struct Extent {
    CostPlan plan;
    size_t views = 8;
};

Extent extent_of(const CostFlags& flags) {
    Extent extent;
    if (flags.quick) extent = {{2, 5, 3, 4}, 2};
    if (flags.full) extent = {{10, 100, 240, 64}, 32};
    return extent;
}

CostViews views_of(const CostFlags& flags, const SplatModel& model, size_t most) {
    if (flags.dataset.empty()) {
        const PixelSize size = parse_size(flags.size);
        return orbit_views(model, static_cast<int>(std::min<size_t>(most, 8)), size.width,
                           size.height);
    }
    DatasetOptions options = flags.data;
    hold_out_as_trained(flags.scene, options);
    const Dataset dataset = load_dataset(flags.dataset, options);
    say_notes(dataset.notes);
    refuse_to_overwrite_inputs({flags.json, flags.html}, files_of(dataset.views));
    return dataset_views(dataset, most);
}

int cost(const CostFlags& flags) {
    if (!flags.train.empty())
        return with_ranks([&](Ranks& ranks) { return train_cost(ranks, flags); });
    check_paper_folder(flags.paper);
    if (flags.scene.empty())
        throw Error("darb cost", "no scene", "Name a PLY file, or a data set with --train.");
    refuse_to_overwrite_inputs({flags.json, flags.html},
                               together({files_of(flags.scene), files_of(flags.dataset)}));
    const Extent extent = extent_of(flags);
    const SplatModel model = in_kernel(flags.kernel, load_scene(flags.scene, nullptr, flags.units));
    if (model.size() == 0)
        throw Error(flags.scene, "holds no splats", "There is nothing to measure.");
    const CostViews views = views_of(flags, model, extent.views);
    DeviceOptions device_options = command_device(flags.device);
    Device device(device_options);
    settle_tuning(device, flags.tune);
    require_timestamps(device);
    const CostResult result =
        measure_cost(device, model, views, glm::vec3(flags.white_background ? 1.0f : 0.0f),
                     extent.plan, say_note);
    nlohmann::json json = cost_json(result);
    json["scene"] = name_in_json(flags.json, flags.scene);
    json["dataset"] = flags.dataset.empty() ? "" : name_in_json(flags.json, flags.dataset);
    write_json(flags.json, json);
    if (!flags.html.empty())
        write_file_atomic(flags.html,
                          cost_report(result, name_in_json(flags.html, flags.scene)).page());
    write_paper(flags.paper, cost_report(result, name_in_json(flags.paper, flags.scene)),
                together({files_of(flags.scene), files_of(flags.dataset)}));
    tell(stream_beside_json(flags.json, flags.quiet), "{}: {} splats, {}; {} views of {}\n\n{}",
         flags.scene, count_text(model.size()), result.device, views.cameras.size(),
         flags.dataset.empty() ? "an orbit" : flags.dataset, cost_table(result));
    tell_paths(flags.quiet, {flags.json, flags.html, flags.paper});
    return 0;
}

}  // namespace

void add_cost(CLI::App& app, Action& action) {
    auto flags = std::make_shared<CostFlags>();
    CLI::App* command =
        app.add_subcommand("cost", "Measure what each accuracy setting costs in time");
    command->add_option("scene", flags->scene, "PLY file, or the output folder of darb train");
    auto* dataset = command->add_option(
        "dataset", flags->dataset, "photos with cameras (default: eight views around the splats)");
    auto* train = command->add_option("--train", flags->train,
                                      "measure the settings in training on this data set instead");
    command
        ->add_option("--train-options", flags->train_options,
                     "options of darb train, such as \"--kernel sinc --effects none\"")
        ->needs(train);
    command->add_option("--seeds", flags->seeds, "runs per setting with --train (default 3)")
        ->check(CLI::Range(1, 100))
        ->needs(train);
    command
        ->add_option("--iterations", flags->iterations,
                     "iterations of a run with --train (default 1,500)")
        ->check(CLI::Range(20, 1'000'000))
        ->needs(train);
    add_json_option(*command, flags->json);
    command->add_option("--html", flags->html, "write a page with plots to this file");
    add_paper_option(*command, flags->paper);
    auto* quick = command->add_flag("--quick", flags->quick,
                                    "take seconds: fewer views, repeats and combinations");
    command->add_flag("--full", flags->full, "take minutes: more of all three")->excludes(quick);
    command->add_option("--size", flags->size, "size of the views around the splats, px")
        ->capture_default_str()
        ->excludes(train)
        ->excludes(dataset);
    command
        ->add_option("-i,--images", flags->data.images_folder, "photo folder of a COLMAP project")
        ->capture_default_str();
    command->add_option("-r,--resolution", flags->data.resolution,
                        "as in training: 1, 2, 4, 8 or a width in px");
    add_hold_out_flag(*command, flags->data);
    command->add_flag("-w,--white-background", flags->white_background, "white, not black");
    add_quiet_flag(*command, flags->quiet);
    add_unit_options(*command, flags->units);
    add_kernel_flags(*command, flags->kernel, "measure with this kernel instead of the scene's");
    for (const char* option : {"--kernel", "--kernel-file"})
        command->get_option(option)->excludes(train);
    command->add_option("--device", flags->device, "number or part of a name, see `darb devices`");
    add_tune_flags(*command, flags->tune);
    command->callback([flags, &action] { action = [flags] { return cost(*flags); }; });
}

// darb cost --train DATASET: what each accuracy setting costs and changes in training.

int train_cost(Ranks& ranks, const CostFlags& flags) {
    if (!flags.scene.empty())
        throw Error("darb cost " + flags.scene + " --train " + flags.train,
                    "--train takes no scene: it trains its own", "Leave the scene out.");
    check_paper_folder(flags.paper);
    int iterations = flags.quick ? 300 : flags.full ? 7'000 : 1'500;
    if (flags.iterations > 0) iterations = flags.iterations;
    std::vector<std::string> words{flags.train, "-o",       ".",
                                   "--eval",    "--images", flags.data.images_folder};
    words.push_back(fmt::format("--iterations={}", iterations));
    if (flags.data.resolution != DatasetOptions{}.resolution)
        words.push_back(fmt::format("--resolution={}", flags.data.resolution));
    if (flags.data.hold_out) words.push_back("--hold-out=" + hold_out_text(flags.data.held_out));
    if (flags.white_background) words.emplace_back("--white-background");
    const TrainRequest request = parse_train_words(words, flags.train_options, "darb cost --train");
    if (request.train.accuracy != Accuracy{})
        throw Error("--train-options " + flags.train_options,
                    "sets the accuracy, which each row of the measurement sets itself",
                    "Leave it out; the rows fast and exact are among them.");
    TrainCostPlan plan;
    plan.ranks = &ranks;
    plan.seeds = flags.quick ? 1 : flags.full ? 5 : 3;
    if (flags.seeds > 0) plan.seeds = flags.seeds;
    Dataset dataset = load_dataset(request.dataset, request.data);
    say_notes(dataset.notes);
    refuse_to_overwrite_inputs({flags.json, flags.html},
                               together({files_of(flags.train), files_of(dataset.views)}));
    DeviceOptions device_options = command_device(flags.device);
    Device device(device_options);
    settle_tuning(device, flags.tune);
    TrainJob job = resolve(request, std::move(dataset));
    for (const std::string& note : job.notes) say_note("note: " + note);
    find_start(device, job, say_stereo_begins);
    say_note("effects: " + plan_line(job.effects));
    if (!job.start_note.empty()) say_note(job.start_note);
    TrainCostResult result = measure_train_cost(device, job.dataset, job.options, plan, say_note);
    if (!ranks.is_first()) return 0;
    result.dataset = name_in_json(flags.json, flags.train);
    write_json(flags.json, train_cost_json(result));
    result.dataset = name_in_json(flags.html, flags.train);
    const Report report = train_cost_report(result);
    if (!flags.html.empty()) write_file_atomic(flags.html, report.page());
    write_paper(flags.paper, report, files_of(flags.train));
    tell(stream_beside_json(flags.json, flags.quiet), "{}: iterations {}, seeds {}, {}\n\n{}",
         flags.train, result.iterations, result.seeds, result.device, train_cost_table(result));
    tell_paths(flags.quiet, {flags.json, flags.html, flags.paper});
    return 0;
}

}  // namespace darb
