// SPDX-License-Identifier: MIT
// darb eval SCENE.ply DATASET: PSNR and SSIM of the scene's pictures against the photos.
#include <fmt/format.h>
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/parse_number.h"
#include "engine/core/say.h"
#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/plan/effect_plan.h"
#include "engine/render/light_share.h"
#include "engine/scene/splat_model.h"
#include "tools/darb/command_list.h"
#include "tools/darb/flags.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/scene_evaluation.h"
#include "tools/darb/tune_flags.h"
#include "trainer/job/scene_file.h"

namespace darb {

constexpr std::uint32_t kFewViews = 3;  // fewer views than this count as few

struct LightOfView {
    std::string name;
    double share = 0;  // 0 to 1
};

struct LightReport {
    std::size_t few = 0, splats = 0;  // few: how many of the splats few training views see
    std::vector<LightOfView> views;
    // arc: only where there are views off it; mean is then theirs
    std::optional<double> mean, arc, off_path;
};

/// all: the whole data set, whose views that are not held out are those that see the splats. views:
/// those to measure, as are off_path, which may be empty. Measures at the views' size with the
/// default accuracy.
LightReport measure_light(Device& device, const SplatModel& model, const EffectChoice& effects,
                          const std::vector<View>& all, const std::vector<View>& views,
                          const std::vector<View>& off_path);

/// Prints the report and returns it as JSON.
nlohmann::json told_light(std::FILE* out, const LightReport& light);

namespace {

struct EvalFlags {
    std::filesystem::path scene, dataset, json, paper;
    std::string split = "test", device, effects = "auto";
    bool eval_exposure = false, quiet = false, light = false, align = false, white = false;
    bool flip = false;
    std::vector<double> scales;  // empty: the size of the photos
    StoredUnits units;
    DatasetOptions data;
    AccuracyFlags accuracy;
};

std::vector<View> views_of(const Dataset& dataset, const EvalFlags& flags) {
    std::vector<View> views;
    for (const View& view : dataset.views)
        if (flags.split == "all" || view.is_test == (flags.split == "test")) views.push_back(view);
    if (views.empty())
        throw Error(flags.dataset.string(),
                    fmt::format("none of its {} views belongs to the split '{}'",
                                dataset.views.size(), flags.split),
                    "Choose another one with --split test, train or all.");
    return views;
}

void tell_off_path(std::FILE* out, const Evaluation& evaluation, Report& report) {
    tell(out, "off path, mean of {}: {:.3f} dB, SSIM {:.4f}\n", evaluation.views.size(),
         evaluation.psnr_db, evaluation.ssim);
    print_depth(out, evaluation);
    Table table = evaluation_table(evaluation);
    table.name = "off path";
    table.title = "Views off the path";
    report.table(std::move(table));
}

/// Tells the evaluation, one or at several sizes, and returns it as JSON.
template <class Measured>
nlohmann::json told_evaluation(std::FILE* out, const Measured& measured, Report& report) {
    print_evaluation(out, measured);
    report.table(evaluation_table(measured));
    return evaluation_json(measured);
}

int eval(Ranks& ranks, EvalFlags flags) {
    refuse_to_overwrite_inputs({flags.json},
                               together({files_of(flags.scene), files_of(flags.dataset)}));
    check_paper_folder(flags.paper);
    SceneEvaluation options;
    options.flip = flags.flip;
    options.ranks = &ranks;
    options.accuracy = chosen_accuracy(flags.accuracy);
    hold_out_as_trained(flags.scene, flags.data);
    options.effects = choose_effects(flags.effects, EffectUse::measuring, flags.data);
    options.background = glm::vec3(flags.white ? 1.0f : 0.0f);
    options.fit_exposure = flags.eval_exposure;
    options.align_cameras = flags.align;
    const SplatModel model = load_scene(flags.scene, nullptr, flags.units);
    note_unused_choices(flags.accuracy, model.kernel);
    Dataset dataset = load_dataset(flags.dataset, flags.data);
    take_trained_cameras(flags.scene, dataset.views);
    options.alpha_is_mask = dataset.alpha_is_mask;
    options.depth_scale = dataset.depth_scale;
    say_notes(dataset.notes);
    refuse_to_overwrite_inputs({flags.json}, files_of(dataset.views));
    const std::vector<View> views = views_of(dataset, flags);
    const Dataset away =
        flags.split == "train" ? Dataset{} : off_path_of(flags.dataset, flags.data);
    say_notes(away.notes);
    refuse_to_overwrite_inputs({flags.json}, files_of(away.views));
    const std::vector<View> beyond = held_out_views(away.views);
    // made before the first picture, because a photo may be too small
    std::vector<std::vector<View>> sizes;
    for (const double scale : flags.scales) sizes.push_back(scaled_views(views, scale));
    DeviceOptions device_options = command_device(flags.device);
    Device device(device_options);
    settle_tuning(device);
    std::FILE* const out = stream_beside_json(flags.json, flags.quiet);
    Report report("Evaluation", name_in_json(flags.paper, flags.scene) + " on " +
                                    name_in_json(flags.paper, flags.dataset));
    nlohmann::json figures =
        flags.scales.empty()
            ? told_evaluation(out, evaluate_scene(device, model, views, options), report)
            : told_evaluation(out, evaluate_scales(device, model, flags.scales, sizes, options),
                              report);
    if (!away.views.empty()) {
        options.alpha_is_mask = away.alpha_is_mask;
        const Evaluation evaluation = evaluate_scene(device, model, beyond, options);
        figures["off_path"] = evaluation_json(evaluation);
        tell_off_path(out, evaluation, report);
    }
    if (!ranks.is_first()) return 0;
    if (flags.light)
        figures["light_of_few_views"] = told_light(
            out, measure_light(device, model, options.effects, dataset.views, views, beyond));
    write_json(flags.json, figures);
    write_paper(flags.paper, report,
                together({files_of(flags.scene), files_of(dataset.views), files_of(away.views)}));
    tell_paths(flags.quiet, {flags.json, flags.paper});
    return 0;
}

double size_to_measure_at(const std::string& word) {
    double size = 0;
    const auto [end, error] = parse_number(word.data(), word.data() + word.size(), size);
    if (error != std::errc{} || end != word.data() + word.size() || !(size >= 0.01 && size <= 100))
        throw CLI::ValidationError(
            "--scales", fmt::format("{} is neither a number of 0.01 to 100, nor linear or "
                                    "logarithms",
                                    word));
    return size;
}

// Adds the sizes to measure at; their name --scales also has another meaning, as in other commands.
void add_scales_or_units(CLI::App& command, std::vector<double>& scales, StoredUnits& units) {
    command
        .add_option_function<std::vector<std::string>>(
            "--scales",
            [&scales, &units](const std::vector<std::string>& words) {
                for (const std::string& word : words) {
                    if (word == "linear" || word == "logarithms") {
                        units.scales =
                            word == "linear" ? StoredScales::linear : StoredScales::logarithms;
                        continue;
                    }
                    scales.push_back(size_to_measure_at(word));
                }
            },
            "sizes to measure at, as multiples of the size of -r, with commas: 0.5,1,2,4; or, as "
            "in darb info, linear or logarithms: what the file stores as scales")
        ->delimiter(',')
        ->allow_extra_args(false);
}

}  // namespace

void add_eval(CLI::App& app, Action& action) {
    auto flags = std::make_shared<EvalFlags>();
    CLI::App* command = app.add_subcommand("eval", "Measure a scene against photos: PSNR and SSIM");
    command->add_option("scene", flags->scene, "splat file, or the output folder of darb train")
        ->required();
    command->add_option("dataset", flags->dataset, "photos with cameras, as darb train takes them")
        ->required();
    command
        ->add_option("--split", flags->split,
                     "test: the views that are held out; train: the others; all: both")
        ->capture_default_str()
        ->check(CLI::IsMember({"test", "train", "all"}));
    add_json_option(*command, flags->json);
    add_paper_option(*command, flags->paper);
    command->add_flag("--flip", flags->flip,
                      "also measure FLIP, what a viewer sees change between picture and photo");
    command
        ->add_option("-i,--images", flags->data.images_folder, "photo folder of a COLMAP project")
        ->capture_default_str();
    command->add_option("-r,--resolution", flags->data.resolution,
                        "as in training: 1, 2, 4, 8 or a width in px");
    add_scales_or_units(*command, flags->scales, flags->units);
    add_hold_out_flag(*command, flags->data)->default_str("as the scene was trained, else every:8");
    command->add_flag(
        "--light-share", flags->light,
        "also print the share of the light from splats that fewer than three training views see");
    command->add_flag("-w,--white-background", flags->white, "white behind alpha, not black");
    add_accuracy_flags(*command, flags->accuracy);
    add_effects_flag(*command, flags->effects);
    add_lens_flag(*command, flags->data);
    add_depth_scale_flag(*command, flags->data);
    command->add_flag("--eval-exposure", flags->eval_exposure,
                      "fit each picture's colours to its photo by an affine map before measuring");
    command->add_flag(
        "--align-cameras", flags->align,
        "turn and move each camera until the picture fits its photo, before measuring");
    command->add_option("--device", flags->device, "number or part of a name, see `darb devices`");
    add_quiet_flag(*command, flags->quiet);
    add_unit_options(*command, flags->units, false);
    command->callback([flags, &action] {
        action = [flags] { return with_ranks([&](Ranks& ranks) { return eval(ranks, *flags); }); };
    });
}

namespace {

std::vector<Camera> cameras_of(std::vector<View> views, const EffectPlan& plan) {
    apply_plan(plan, views);
    std::vector<Camera> cameras;
    for (const View& view : views) cameras.push_back(view.camera);
    return cameras;
}

std::optional<double> mean_of(const std::vector<double>& shares) {
    if (shares.empty()) return std::nullopt;
    double sum = 0;
    for (const double share : shares) sum += share;
    return sum / double(shares.size());
}

}  // namespace

LightReport measure_light(Device& device, const SplatModel& model, const EffectChoice& effects,
                          const std::vector<View>& all, const std::vector<View>& views,
                          const std::vector<View>& off_path) {
    SplatModel planned = model;
    const EffectPlan plan = plan_rendering(planned, views, {}, effects);
    apply_plan(plan, planned);
    std::vector<View> training = all;
    std::erase_if(training, [](const View& view) { return view.is_test; });
    const std::vector<std::uint32_t> seen =
        views_that_see(device, planned, cameras_of(training, plan));
    std::vector<std::uint8_t> few;
    for (const std::uint32_t count : seen) few.push_back(count < kFewViews ? 1 : 0);
    LightReport light;
    light.splats = few.size();
    light.few = static_cast<std::size_t>(std::count(few.begin(), few.end(), 1));
    std::vector<double> in_arc, others;
    const std::vector<double> shares = light_shares(device, planned, few, cameras_of(views, plan));
    for (std::size_t v = 0; v < views.size(); ++v) {
        light.views.push_back({views[v].name, shares[v]});
        (views[v].in_arc ? in_arc : others).push_back(shares[v]);
    }
    light.mean = mean_of(others.empty() ? in_arc : others);
    if (!others.empty()) light.arc = mean_of(in_arc);
    light.off_path = mean_of(light_shares(device, planned, few, cameras_of(off_path, plan)));
    return light;
}

namespace {

void print_light(std::FILE* out, const LightReport& light) {
    const auto percent = [](const char* what, const std::optional<double>& share) {
        return share ? fmt::format("{}{:.2f} %", what, 100 * *share) : std::string();
    };
    tell(out, "light of splats that fewer than {} training views see ({} of {}): {}{}{}\n",
         kFewViews, light.few, light.splats, percent("", light.mean), percent(", arc ", light.arc),
         percent(", off path ", light.off_path));
}

}  // namespace

nlohmann::json told_light(std::FILE* out, const LightReport& light) {
    print_light(out, light);
    nlohmann::json views = nlohmann::json::array();
    for (const LightOfView& view : light.views)
        views.push_back({{"name", view.name}, {"share", view.share}});
    nlohmann::json json{{"fewer_than", kFewViews},
                        {"splats", light.few},
                        {"of_splats", light.splats},
                        {"views", views}};
    const std::pair<const char*, const std::optional<double>&> means[] = {
        {"mean", light.mean}, {"arc", light.arc}, {"off_path", light.off_path}};
    for (const auto& [name, share] : means)
        if (share) json[name] = *share;
    return json;
}

}  // namespace darb
