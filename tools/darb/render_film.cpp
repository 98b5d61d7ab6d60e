#include "tools/darb/render_film.h"

#include <fmt/format.h>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/data/metrics.h"
#include "engine/raster/frame_limit.h"
#include "engine/render/renderer.h"
#include "tools/darb/device_options.h"
#include "tools/darb/effect_flags.h"
#include "tools/darb/outputs.h"
#include "tools/darb/pixel_size.h"
#include "tools/darb/scene_file.h"
#include "trainer/evaluation.h"
#include "viewer/bounds.h"
#include "viewer/path_export.h"
#include "viewer/turntable.h"

namespace darb {

namespace {

CameraPath film_path(const FilmFlags& flags, const PixelSize& size, const SplatModel& model,
                     const std::string& stated_up) {
    if (!flags.path.empty()) return read_camera_path(flags.path);
    TurntableOptions options;
    options.seconds = flags.seconds;
    options.fps = flags.fps;
    options.width = size.width;
    options.height = size.height;
    const std::string& up = flags.up.empty() ? stated_up : flags.up;
    options.up = up.empty() ? guess_up(model) : up_from_name(up);
    return turntable(model, options);
}

}  // namespace

void add_film_flags(CLI::App& c, FilmFlags& flags, CLI::Option* cameras) {
    CLI::Option* const path =
        c.add_option("--path", flags.path,
                     "a camera path that the viewer saved; without it and --cameras the camera "
                     "goes once around the scene. Both make a video, too, where ffmpeg is");
    path->excludes(cameras);
    c.add_option("--size", flags.size, "WIDTHxHEIGHT of a path's or a turn's frames, px")
        ->capture_default_str()
        ->excludes(cameras);
    c.add_option("--fps", flags.fps, "their frames a second")
        ->check(CLI::Range(1, 240))
        ->capture_default_str()
        ->excludes(cameras);
    c.add_option("--seconds", flags.seconds, "of the turn")
        ->check(CLI::Range(0.1, 600.0))
        ->capture_default_str()
        ->excludes(cameras)
        ->excludes(path);
    c.add_option("--up", flags.up,
                 "x, -x, y, -y, z or -z, of the turn (default: what the file says, else a guess)")
        ->excludes(cameras)
        ->excludes(path);
}

int render_film(const RenderFlags& flags, const Accuracy& accuracy, const EffectChoice& choice) {
    if (!flags.depth.format.empty())
        throw Error("--depth", "goes with --cameras alone", "Name the cameras, or leave it out.");
    if (flags.data.resolution != -1)
        throw Error("-r", "divides the size of cameras, and there are none", "Use --size.");
    const PixelSize size = parse_size(flags.film.size);
    SplatFile facts;
    SplatModel model = in_kernel(flags.kernel, load_scene(flags.scene, &facts));
    note_unused_choices(flags.accuracy, model.kernel);
    const CameraPath path = film_path(flags.film, size, model, facts.up);
    DeviceOptions device_options = command_device(flags.device);
    Device device(device_options);
    settle_tuning(device, flags.tune);
    check_frame(device, size.width, size.height, "--size");
    const float near_plane =
        flags.near_plane ? *flags.near_plane : near_plane_for(scene_bounds(model));
    EffectPlan plan =
        plan_rendering(model, {}, {.near_plane = near_plane, .free_camera = true}, choice);
    apply_plan(plan, model);
    Renderer renderer(device, model, accuracy, plan.projection(), plan.huge_splat_path());
    const glm::vec3 background(flags.white_background ? 1.0f : 0.0f);
    PathExport film(path, {flags.output, flags.film.fps, size.width, size.height, {}});
    while (!film.done())
        film.step(
            [&](const Camera& camera, const DisplaySettings&) {
                const ImageF image = renderer.render(camera, background, -1, near_plane);
                plan.note_frame(renderer.status().huge_splats, renderer.status().longest_list);
                return to_8bit(image);
            },
            true);
    tell(flags.quiet ? nullptr : stdout, "effects: {}\n{}\n", plan_line(plan), film.summary());
    tell_paths(flags.quiet, {flags.output});
    return 0;
}

}  // namespace darb
