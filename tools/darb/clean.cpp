// SPDX-License-Identifier: MIT
// darb clean SCENE -o OUT: leaves out isolated parts, haze, what floats in free space and what few
// photos show, and says what each of these costs.
#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/core/count_text.h"
#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/data/camera_list.h"
#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/plan/effect_plan.h"
#include "engine/publish/fit_pictures.h"
#include "engine/render/cleaning.h"
#include "engine/render/free_space.h"
#include "engine/render/renderer.h"
#include "engine/scene/clutter.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/region.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/subject.h"
#include "tools/darb/command_list.h"
#include "tools/darb/flags.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/scene_evaluation.h"
#include "tools/darb/tune_flags.h"
#include "trainer/job/scene_file.h"

namespace darb {

namespace {

constexpr double kIsolatedShare = 0.01;  // of the heaviest part, where no rule is named

struct CleanFlags {
    std::filesystem::path scene, photos, cameras, output, json, paper;
    std::optional<double> isolated;               // share of the heaviest part
    std::string haze;                             // OPACITY,SIZE; empty: off
    std::uint32_t free_space = 0, few_views = 0;  // views; 0: off
    std::string region, device;
    bool dry_run = false, force = false, quiet = false;
    DatasetOptions data;
    StoredUnits units;
    TuneFlags tune;
};

struct Cameras {
    std::vector<Camera> cameras;
    bool of_photos = false;  // they stand where photos were taken
};

/// Evenly chosen cameras: of the photos, else those named, else of the scene's run, else around it.
Cameras chosen_cameras(const CleanFlags& flags, const SplatModel& model,
                       const std::vector<View>& photos) {
    constexpr int kAround = 24, kWidth = 640, kHeight = 480;
    std::vector<View> views = photos;
    if (views.empty() && !flags.cameras.empty()) views = open_cameras(flags.cameras, flags.data);
    if (views.empty()) views = cameras_beside(flags.scene);
    if (views.empty()) return {orbit_cameras(model, kAround, kWidth, kHeight), false};
    return {evenly_chosen(cameras_of(views)), true};
}

CleaningRules rules_from(const CleanFlags& flags, const SplatModel& model, const Cameras& cameras) {
    CleaningRules rules;
    rules.free_space = flags.free_space;
    rules.few_views = flags.few_views;
    if (!flags.haze.empty()) take_haze("--haze", flags.haze, rules);
    if (!flags.region.empty())
        rules.region = region_from("--region", flags.region, model,
                                   cameras.of_photos ? std::span<const Camera>(cameras.cameras)
                                                     : std::span<const Camera>());
    rules.isolated = flags.isolated.value_or(rules.any() ? 0.0 : kIsolatedShare);
    return rules;
}

/// Draws the scene with the effects that it calls for, without lenses.
std::unique_ptr<Renderer> plain_renderer(Device& device, SplatModel model, const Cameras& cameras) {
    std::vector<View> views;
    for (const Camera& camera : cameras.cameras) {
        views.emplace_back().camera = camera;
        views.back().camera.lens = {};
    }
    DatasetOptions none;
    const EffectPlan plan =
        plan_rendering(model, views, {}, choose_effects("auto", EffectUse::pictures, none));
    apply_plan(plan, model);
    return std::make_unique<Renderer>(device, model, Accuracy{}, plan.projection(),
                                      plan.huge_splat_path());
}

/// PSNR of the held-out photos before and after.
struct Judgement {
    std::size_t views = 0;
    double before = 0, after = 0;  // dB
};

std::optional<Judgement> judge(Device& device, const Dataset& photos, const EffectChoice& effects,
                               const SplatModel& before, const SplatModel& after) {
    const std::vector<View> views = held_out_views(photos.views);
    if (views.empty()) return {};
    SceneEvaluation options;
    options.effects = effects;
    options.alpha_is_mask = photos.alpha_is_mask;
    options.depth_scale = photos.depth_scale;
    SlowProgress progress("measuring held-out photos");
    progress.at(0.0);
    Judgement judged{views.size()};
    judged.before = evaluate_scene(device, before, views, options).psnr_db;
    judged.after = evaluate_scene(device, after, views, options).psnr_db;
    return judged;
}

nlohmann::json report_json(const CleanFlags& flags, const Clutter& clutter,
                           const std::optional<Judgement>& judged) {
    nlohmann::json json{{"output", flags.dry_run ? "" : name_in_json(flags.json, flags.output)},
                        {"splats", clutter.together.set.size()}};
    const auto row = [](const ClutterOfRule& rule) {
        return nlohmann::json{
            {"rule", rule.rule}, {"splats", count_of(rule.set)}, {"light_share", rule.light}};
    };
    for (const ClutterOfRule& rule : clutter.rules) json["rules"].push_back(row(rule));
    json["together"] = row(clutter.together);
    if (judged)
        json["held_out"] = {{"views", judged->views},
                            {"psnr_before", judged->before},
                            {"psnr_after", judged->after}};
    return json;
}

void tell_report(std::FILE* out, const Clutter& clutter, const std::optional<Judgement>& judged) {
    const auto row = [&](const ClutterOfRule& rule) {
        const std::size_t count = count_of(rule.set);
        tell(out, "{:<19}{:>9} splats ({:.1f} %), {:.2f} % of the light\n", rule.rule, count,
             100 * double(count) / double(rule.set.size()), 100 * rule.light);
    };
    for (const ClutterOfRule& rule : clutter.rules) row(rule);
    if (clutter.rules.size() > 1) row(clutter.together);
    if (judged)
        tell(out, "{} held-out photos: {:.2f} dB before, {:.2f} dB after\n", judged->views,
             judged->before, judged->after);
}

Report paper_report(const CleanFlags& flags, const Clutter& clutter,
                    const std::optional<Judgement>& judged) {
    Report report("Cleaning", name_in_json(flags.paper, flags.scene));
    Table table{"rules", "What each rule leaves out", "", {}, {}};
    table.columns = {{"rule", "", Better::neither, 0, TableColumn::Kind::name},
                     {"splats", "", Better::neither, 0},
                     {"of the splats", "%", Better::neither, 1},
                     {"of the light", "%"}};
    const auto add = [&](const ClutterOfRule& rule, bool ranked) {
        const double count = double(count_of(rule.set));
        table.rows.push_back(
            {{rule.rule, count, 100 * count / double(rule.set.size()), 100 * rule.light}, ranked});
    };
    for (const ClutterOfRule& rule : clutter.rules) add(rule, true);
    if (clutter.rules.size() > 1) add(clutter.together, false);
    report.table(std::move(table));
    if (!judged) return report;
    Table photos{"held out",
                 "Held-out photos",
                 fmt::format("Means over {} photos.", judged->views),
                 {{"", "", Better::neither, 0, TableColumn::Kind::name}, {"PSNR", "dB"}},
                 {{{"before", judged->before}}, {{"after", judged->after}}}};
    report.table(std::move(photos));
    return report;
}

SplatFormat checked_format(const CleanFlags& flags) {
    const std::optional<SplatFormat> format = format_to_write(flags.output);
    if (!format)
        throw Error(flags.output.string(), "names no format that can be written",
                    "Let it end in " + endings_to_write() + ".");
    return *format;
}

void check_named(const CleanFlags& flags) {
    if (flags.output.empty() && !flags.dry_run)
        throw Error("clean", "names no output",
                    "Add -o OUT.ply, or --dry-run to see what would go.");
    if (!flags.output.empty() && flags.dry_run)
        throw Error("--dry-run", "writes no scene, and -o names one", "Leave out one of them.");
}

void write_cleaned(const CleanFlags& flags, SplatFormat format, const Paths& inputs,
                   const WrittenFiles& written, SplatModel& model) {
    for (const std::string& loss : losses_of(format, model, flags.output.string()))
        say("warning: {}: {}\n", flags.output.string(), loss);
    drop_unwritable(format, model);
    const EncodedSplats encoded = encode_scene(format, model, flags.output.string());
    const Paths outputs = outputs_of(flags.output, encoded);
    refuse_to_overwrite_inputs(outputs, inputs, Replaces::all);
    written.check(outputs);
    write_encoded(flags.output, encoded);
    written.wrote(outputs);
}

int clean(CleanFlags flags) {
    check_named(flags);
    check_paper_folder(flags.paper);
    const Paths inputs =
        together({files_of(flags.scene), files_of(flags.cameras), files_of(flags.photos)});
    refuse_to_overwrite_inputs({flags.output, flags.json}, inputs, Replaces::all);
    const WrittenFiles written(files_of(flags.scene), flags.force);
    const SplatFormat format = flags.dry_run ? SplatFormat::ply : checked_format(flags);
    if (!flags.dry_run) written.check({flags.output});
    hold_out_as_trained(flags.scene, flags.data);
    const EffectChoice effects = choose_effects("auto", EffectUse::measuring, flags.data);
    SplatModel model = load_scene(flags.scene, nullptr, flags.units);
    if (model.size() == 0)
        throw Error(flags.scene.string(), "the scene has no splats", "Clean one that has some.");
    Dataset photos;
    if (!flags.photos.empty()) {
        photos = load_dataset(flags.photos, flags.data);
        take_trained_cameras(flags.scene, photos.views);
    }
    say_notes(photos.notes);
    const Cameras cameras = chosen_cameras(flags, model, photos.views);
    if (!cameras.of_photos && (flags.free_space > 0 || flags.few_views > 0))
        throw Error(flags.free_space > 0 ? "--free-space" : "--few-views",
                    "needs the cameras of the photos, and the scene has none",
                    "Name them with --cameras, or the photos themselves with --photos.");
    Device device(command_device(flags.device));
    settle_tuning(device, flags.tune);
    SlowProgress progress("free space");
    const Clutter clutter = find_clutter(
        device, model, cameras.cameras, rules_from(flags, model, cameras),
        [&] { return plain_renderer(device, model, cameras); },
        [&](double share) { progress.at(share); });
    const SplatSet& all = clutter.together.set;
    if (count_of(all) == model.size())
        throw Error(flags.scene.string(), "nothing would be left",
                    "Use lower limits; --dry-run shows what each rule takes.");
    SplatModel kept = model;
    keep_splats([&](std::size_t i) { return all[i] == 0; }, kept);
    const std::optional<Judgement> judged = judge(device, photos, effects, model, kept);
    if (!flags.dry_run) write_cleaned(flags, format, inputs, written, kept);
    write_json(flags.json, report_json(flags, clutter, judged));
    write_paper(flags.paper, paper_report(flags, clutter, judged),
                together({inputs, files_of(photos.views), {flags.output}}));
    std::FILE* const out = stream_beside_json(flags.json, flags.quiet);
    tell_report(out, clutter, judged);
    if (!flags.dry_run)
        tell(out, "{}: {} of {} splats\n", flags.output.string(), count_text(kept.size()),
             count_text(model.size()));
    tell_paths(flags.quiet, {flags.output, flags.json, flags.paper});
    return 0;
}

}  // namespace

void add_clean(CLI::App& app, Action& action) {
    auto flags = std::make_shared<CleanFlags>();
    CLI::App* command =
        app.add_subcommand("clean", "Remove isolated parts, haze and what floats in free space");
    command->add_option("scene", flags->scene, "splat file, or the output folder of darb train")
        ->required();
    command->add_option("-o,--output", flags->output, "the cleaned scene: " + endings_to_write());
    command->add_flag("--dry-run", flags->dry_run,
                      "print what would be removed, and write nothing");
    command->add_flag("--force", flags->force, "replace a file that darb did not write");
    command
        ->add_option("--isolated", flags->isolated,
                     "remove parts that touch nothing else and whose opacity times area is less "
                     "than this share of the heaviest part's")
        ->default_str("0.01 if no rule is named, else off")
        ->check(CLI::Range(0.0, 1.0));
    command
        ->add_option("--haze", flags->haze,
                     "OPACITY,SIZE, such as 0.1,5: remove splats whose opacity is at most OPACITY "
                     "and whose largest standard deviation is at least SIZE times the median")
        ->default_str("off");
    command
        ->add_option("--free-space", flags->free_space,
                     "remove splats that float before a surface in at least this many views, such "
                     "as 3, and lie at a surface in at most a quarter as many")
        ->default_str("off")
        ->check(CLI::Range(1, 1000));
    command
        ->add_option("--few-views", flags->few_views,
                     "remove splats that are seen, but in fewer views than this")
        ->default_str("off")
        ->check(CLI::Range(1, 1000));
    command
        ->add_option("--region", flags->region,
                     std::string("remove everything outside this region: ") + kRegionHelp)
        ->default_str("off");
    command->add_option("--photos", flags->photos,
                        "the scene's photos, given as to darb train; measures the PSNR of the "
                        "held-out ones before and after");
    command->add_option("--cameras", flags->cameras,
                        "a cameras.json, a transforms.json or a data set; --photos brings its own "
                        "(default: those of the scene's run, else 24 around the scene, which "
                        "--free-space and --few-views do not take)");
    command->add_option("-r,--resolution", flags->data.resolution,
                        "of the photos: 1, 2, 4 or 8 to divide their size, or a width in px");
    add_json_option(*command, flags->json);
    add_paper_option(*command, flags->paper);
    command->add_option("--device", flags->device, "number or part of a name, see `darb devices`");
    add_tune_flags(*command, flags->tune);
    add_quiet_flag(*command, flags->quiet);
    add_unit_options(*command, flags->units);
    command->callback([flags, &action] { action = [flags] { return clean(*flags); }; });
}

}  // namespace darb
