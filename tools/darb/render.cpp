// darb render SCENE.ply --cameras X -o DIR: a PNG of each camera; without cameras a film of a path
// or a turn.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <set>

#include "engine/core/error.h"
#include "engine/core/quantile.h"
#include "engine/core/say.h"
#include "engine/data/image_io.h"
#include "engine/gpu/device_environment.h"
#include "engine/plan/effect_plan.h"
#include "engine/raster/frame_view.h"
#include "engine/render/renderer.h"
#include "tools/darb/accuracy_flags.h"
#include "tools/darb/command_list.h"
#include "tools/darb/depth_file.h"
#include "tools/darb/effect_flags.h"
#include "tools/darb/kernel_flags.h"
#include "tools/darb/numbers.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/render_film.h"
#include "tools/darb/tune_flags.h"
#include "tools/darb/unit_flags.h"
#include "trainer/job/scene_file.h"
#include "trainer/run/evaluation.h"

namespace darb {

namespace {

// -r of a camera list, which states sizes rather than photos: divisor up to 8, width above.
void scale_camera(Camera& camera, int resolution) {
    if (resolution == -1) return;
    if (resolution < 1)
        throw Error("-r", fmt::format("{} is no valid value", resolution),
                    "Use 1, 2, 4 or 8 (a divisor), or a width in pixels above 8.");
    const double scale = resolution <= 8 ? 1.0 / resolution : double(resolution) / camera.width;
    const int width = std::max(1, static_cast<int>(std::lround(camera.width * scale)));
    const int height = std::max(1, static_cast<int>(std::lround(camera.height * scale)));
    camera = resized(camera, width, height);
}

int render(RenderFlags flags) {
    const Accuracy accuracy = chosen_accuracy(flags.accuracy);
    const EffectChoice choice = choose_effects(flags.effects, EffectUse::pictures, flags.data);
    check_depth(flags.depth, accuracy, choice);
    if (flags.cameras.empty()) return render_film(flags, accuracy, choice);
    SplatModel model = in_kernel(flags.kernel, load_scene(flags.scene, nullptr, flags.units));
    note_unused_choices(flags.accuracy, model.kernel);
    std::vector<View> views = open_cameras(flags.cameras, flags.data);
    const bool is_list = !views.empty() && views[0].photo.empty();
    if (is_list)
        for (View& view : views) scale_camera(view.camera, flags.data.resolution);
    std::vector<std::filesystem::path> files;
    std::set<std::string> used;
    for (const View& view : views) files.push_back(flags.output / picture_name(view.name, used));
    Paths outputs = files;
    add_depth_files(flags.depth, files, outputs);
    refuse_to_overwrite_inputs(
        outputs, together({files_of(flags.scene), files_of(flags.cameras), files_of(views)}));
    const WrittenFiles written({}, flags.force);
    written.check(outputs);
    DeviceOptions device_options = command_device(flags.device);
    Device device(device_options);
    settle_tuning(device, flags.tune);
    const float near_plane = flags.near_plane.value_or(static_cast<float>(NEAR_DEFAULT));
    EffectPlan plan = plan_rendering(
        model, views, {.depth = !flags.depth.format.empty(), .near_plane = near_plane}, choice);
    apply_plan(plan, model);
    apply_plan(plan, views);
    for (const View& view : views)
        check_frame(device, view.camera.width, view.camera.height, view.name);
    Renderer renderer(device, model, accuracy, plan.projection(), plan.huge_splat_path());
    const glm::vec3 background(flags.white_background ? 1.0f : 0.0f);
    DepthFiles depths(flags.depth);
    std::vector<double> frame_ms;
    for (const View& view : views) {
        const auto start = std::chrono::steady_clock::now();
        const ImageF image = renderer.render(view.camera, background, -1, near_plane);
        const std::chrono::duration<double, std::milli> ms =
            std::chrono::steady_clock::now() - start;
        frame_ms.push_back(ms.count());
        plan.note_frame(renderer.status().huge_splats, renderer.status().longest_list);
        const auto& file = files[frame_ms.size() - 1];
        write_png(file, to_8bit(image));
        if (plan.on(EFFECT_DEPTH)) depths.write(file, renderer.render_depth());
    }
    written.wrote(outputs);
    depths.print_clipped();
    std::FILE* const out = flags.quiet ? nullptr : stdout;
    tell(out, "effects: {}\n", plan_line(plan));
    tell_paths(flags.quiet, {flags.output});
    tell(out, "{} frames in {}, median {:.2f} ms a frame on {}\n", views.size(),
         flags.output.string(), median(frame_ms), device.info().name);
    return 0;
}

}  // namespace

void add_render(CLI::App& app, Action& action) {
    auto flags = std::make_shared<RenderFlags>();
    CLI::App* command = app.add_subcommand(
        "render", "Render a scene to PNG files: of cameras, along a path, or once around it");
    command->add_option("scene", flags->scene, "splat file, or the output folder of darb train")
        ->required();
    CLI::Option* const cameras =
        command->add_option("--cameras", flags->cameras,
                            "a cameras.json, a transforms.json, a camera_path.json of nerfstudio, "
                            "or a data set; photos are not needed");
    add_film_flags(*command, flags->film, cameras);
    command->add_option("-o,--output", flags->output, "folder of the frames, made where missing")
        ->required();
    command->add_flag("--force", flags->force, "replace pictures that darb did not write")
        ->needs(cameras);
    command->add_option("-r,--resolution", flags->data.resolution,
                        "1, 2, 4, 8: divide the cameras' size; above 8: width in px; default: as "
                        "they are, those of a data set at most 1,600 px wide");
    command->add_flag("-w,--white-background", flags->white_background, "white, not black");
    command
        ->add_option("--near", flags->near_plane,
                     "nearest distance drawn, world units [0.2; without --cameras less of a small "
                     "scene]")
        ->check(above_zero());
    add_kernel_flags(*command, flags->kernel, "draw with it in the place of the scene's own");
    add_accuracy_flags(*command, flags->accuracy);
    add_effects_flag(*command, flags->effects);
    add_lens_flag(*command, flags->data);
    command->get_option("--lens")->needs(cameras);
    command
        ->add_option("--depth", flags->depth.format,
                     "depth beside the frames, NAME_depth: png (16 bits, 0 = nothing seen) or npy "
                     "(float32, world units); NAME_depth_colours.png is for people")
        ->check(CLI::IsMember({"png", "npy"}));
    command->add_option("--depth-unit", flags->depth.unit, "world units of one step of a depth PNG")
        ->capture_default_str()
        ->check(above_zero());
    command->add_option("--device", flags->device, "number or part of a name, see `darb devices`");
    add_tune_flags(*command, flags->tune);
    add_quiet_flag(*command, flags->quiet);
    add_unit_options(*command, flags->units);
    command->callback([flags, &action] { action = [flags] { return render(*flags); }; });
}

}  // namespace darb
