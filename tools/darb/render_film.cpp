#include "tools/darb/render_film.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/data/camera_list.h"
#include "engine/data/metrics.h"
#include "engine/gpu/device_environment.h"
#include "engine/plan/effect_plan.h"
#include "engine/raster/frame_view.h"
#include "engine/render/renderer.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/pixel_size.h"
#include "trainer/job/scene_file.h"
#include "trainer/run/evaluation.h"
#include "viewer/bounds.h"
#include "viewer/path_export.h"
#include "viewer/turntable.h"

namespace darb {

namespace {

constexpr const char* kUsualSize = "1280x720";
constexpr int kUsualFps = 30;

// What is given, else what the path says.
PixelSize film_size(const FilmFlags& flags, const CameraPath& path) {
    if (!flags.size.empty()) return parse_size(flags.size);
    return path.width > 0 ? PixelSize{path.width, path.height} : parse_size(kUsualSize);
}

int film_fps(const FilmFlags& flags, const CameraPath& path) {
    if (flags.fps > 0) return flags.fps;
    return path.fps > 0 ? std::clamp(static_cast<int>(std::lround(path.fps)), 1, 240) : kUsualFps;
}

/// What the turn goes around is what these look at; those beside the scene may be unreadable.
std::vector<Camera> cameras_of_turn(const RenderFlags& flags) {
    if (!flags.film.around.empty()) return cameras_of(open_cameras(flags.film.around));
    try {
        return cameras_of(cameras_beside(flags.scene));
    } catch (const Error& e) {
        say("warning: {}\n", e.what());
        return {};
    }
}

CameraPath turn_around(const RenderFlags& render, const PixelSize& size, const SplatModel& model,
                       const std::string& stated_up) {
    const FilmFlags& flags = render.film;
    TurntableOptions options;
    options.seconds = flags.seconds;
    options.fps = film_fps(flags, {});
    options.width = size.width;
    options.height = size.height;
    options.cameras = cameras_of_turn(render);
    const std::optional<glm::dvec3> held = up_of_cameras(options.cameras);
    options.up = !flags.up.empty()    ? up_from_name(flags.up)
                 : held               ? *held
                 : !stated_up.empty() ? up_from_name(stated_up)
                                      : guess_up(model);
    return turntable(model, options);
}

}  // namespace

void add_film_flags(CLI::App& c, FilmFlags& flags, CLI::Option* cameras) {
    CLI::Option* const path = c.add_option(
        "--path", flags.path,
        "a camera path that the viewer saved, or a camera_path.json of nerfstudio; "
        "without it and --cameras the camera goes once around what the scene's cameras "
        "look at. Both make a video, too, where ffmpeg is");
    path->excludes(cameras);
    c.add_option("--size", flags.size, "WIDTHxHEIGHT of a path's or a turn's frames, px")
        ->default_str("nerfstudio's path: as it says, else 1280x720")
        ->excludes(cameras);
    c.add_option("--fps", flags.fps, "their frames a second")
        ->check(CLI::Range(1, 240))
        ->default_str("nerfstudio's path: as it says, else 30")
        ->excludes(cameras);
    c.add_option("--seconds", flags.seconds, "of the turn")
        ->check(CLI::Range(0.1, 600.0))
        ->capture_default_str()
        ->excludes(cameras)
        ->excludes(path);
    c.add_option("--up", flags.up,
                 "x, -x, y, -y, z or -z, of the turn (default: as the cameras were held, else what "
                 "the file says, else a guess)")
        ->excludes(cameras)
        ->excludes(path);
    c.add_option("--around", flags.around,
                 "a cameras.json, a transforms.json or a data set: the turn goes around what these "
                 "cameras look at (default: the cameras.json of the scene's run)")
        ->excludes(cameras)
        ->excludes(path);
}

int render_film(const RenderFlags& flags, const Accuracy& accuracy, const EffectChoice& choice) {
    if (!flags.depth.format.empty())
        throw Error("--depth", "goes with --cameras alone", "Name the cameras, or leave it out.");
    if (flags.data.resolution != -1)
        throw Error("-r", "divides the size of cameras, and there are none", "Use --size.");
    CameraPath path;
    if (!flags.film.path.empty()) path = read_camera_path(flags.film.path);
    say_notes(path.notes);
    const PixelSize size = film_size(flags.film, path);
    SplatFile facts;
    SplatModel model = in_kernel(flags.kernel, load_scene(flags.scene, &facts, flags.units));
    note_unused_choices(flags.accuracy, model.kernel);
    if (flags.film.path.empty()) path = turn_around(flags, size, model, facts.up);
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
    PathExport film(path, {flags.output, film_fps(flags.film, path), size.width, size.height, {}});
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
