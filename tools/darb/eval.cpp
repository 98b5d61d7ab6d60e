// darb eval SCENE.ply DATASET: PSNR and SSIM of the scene's pictures against the photos.

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/core/text.h"
#include "engine/data/dataset.h"
#include "engine/raster/frame_limit.h"
#include "engine/render/renderer.h"
#include "tools/darb/accuracy_flags.h"
#include "tools/darb/command_list.h"
#include "tools/darb/device_options.h"
#include "tools/darb/effect_flags.h"
#include "tools/darb/json_output.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/scene_file.h"
#include "tools/darb/tune_flags.h"
#include "trainer/evaluation.h"
#include "trainer/exposure_fit.h"

namespace darb {

namespace {

struct EvalFlags {
    std::filesystem::path scene, dataset, json;
    std::string split = "test", device, effects = "auto";
    bool eval_exposure = false, quiet = false;
    bool white_background = false;
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

nlohmann::json to_json(const Evaluation& evaluation) {
    nlohmann::json views = nlohmann::json::array();
    for (const ViewMetrics& v : evaluation.views)
        views.push_back({{"name", v.name}, {"psnr_db", v.psnr_db}, {"ssim", v.ssim}});
    return {{"mean", {{"psnr_db", evaluation.psnr_db}, {"ssim", evaluation.ssim}}},
            {"views", views}};
}

void print_table(std::FILE* out, const Evaluation& evaluation) {
    const std::string mean = fmt::format("mean of {}", evaluation.views.size());
    size_t width = mean.size();
    for (const ViewMetrics& v : evaluation.views) width = std::max(width, printable(v.name).size());
    const auto row = [&](const std::string& name, double psnr_db, double ssim) {
        tell(out, "{:<{}}  {:>8.3f}  {:>7.4f}\n", name, width, psnr_db, ssim);
    };
    tell(out, "{:<{}}  {:>8}  {:>7}\n", "view", width, "PSNR dB", "SSIM");
    for (const ViewMetrics& v : evaluation.views) row(printable(v.name), v.psnr_db, v.ssim);
    row(mean, evaluation.psnr_db, evaluation.ssim);
}

int eval(EvalFlags flags) {
    refuse_to_overwrite_inputs({flags.json},
                               together({files_of(flags.scene), files_of(flags.dataset)}));
    const Accuracy accuracy = chosen_accuracy(flags.accuracy);
    flags.data.hold_out = true;  // sources without a split of their own: every 8th view
    const EffectChoice choice = choose_effects(flags.effects, EffectUse::measuring, flags.data);
    SplatModel model = load_scene(flags.scene);
    const Dataset dataset = load_dataset(flags.dataset, flags.data);
    print_notes(dataset.notes);
    refuse_to_overwrite_inputs({flags.json}, files_of(dataset.views));
    std::vector<View> views = views_of(dataset, flags);
    DeviceOptions device_options = command_device(flags.device);
    Device device(device_options);
    settle_tuning(device);
    const EffectPlan plan = plan_rendering(model, views, {}, choice);
    apply_plan(plan, model);
    apply_plan(plan, views);
    for (const View& view : views)
        check_frame(device, view.camera.width, view.camera.height, view.name);
    Renderer renderer(device, model, accuracy, plan.projection(), plan.huge_splat_path());
    const glm::vec3 background(flags.white_background ? 1.0f : 0.0f);
    Evaluation evaluation;
    for (const View& view : views) {
        const ImageU8 photo = load_photo(view);
        ImageF image = renderer.render(view.camera, background);
        if (flags.eval_exposure)
            image = apply_exposure(fit_exposure(image, photo, background, dataset.alpha_is_mask),
                                   image);
        evaluation.views.push_back(
            compare_view(view.name, image, photo, background, dataset.alpha_is_mask));
    }
    take_means(evaluation);
    write_json(flags.json, to_json(evaluation));
    print_table(stream_beside_json(flags.json, flags.quiet), evaluation);
    tell_paths(flags.quiet, {flags.json});
    return 0;
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
                     "test: the data set's own test views, else every 8th by name; train: the "
                     "others; all")
        ->capture_default_str()
        ->check(CLI::IsMember({"test", "train", "all"}));
    add_json_option(*command, flags->json);
    command
        ->add_option("-i,--images", flags->data.images_folder, "photo folder of a COLMAP project")
        ->capture_default_str();
    command->add_option("-r,--resolution", flags->data.resolution,
                        "as in training: 1, 2, 4, 8 or a width in px");
    command->add_flag("-w,--white-background", flags->white_background,
                      "white behind alpha, not black");
    add_accuracy_flags(*command, flags->accuracy);
    add_effects_flag(*command, flags->effects);
    add_lens_flag(*command, flags->data);
    command->add_flag("--eval-exposure", flags->eval_exposure,
                      "fit each picture's colours to its photo by an affine map before measuring");
    command->add_option("--device", flags->device, "number or part of a name, see `darb devices`");
    add_quiet_flag(*command, flags->quiet);
    command->callback([flags, &action] { action = [flags] { return eval(*flags); }; });
}

}  // namespace darb
