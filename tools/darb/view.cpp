// SPDX-License-Identifier: MIT
// darb view SCENE: the interactive viewer; with --screenshot or --export it needs no window system.
#include "tools/darb/view.h"

#include <fmt/format.h>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <glm/gtc/constants.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/quantile.h"
#include "engine/core/say.h"
#include "engine/core/system.h"
#include "engine/core/text.h"
#include "engine/core/user_folders.h"
#include "engine/data/image_io.h"
#include "engine/data/metrics.h"
#include "engine/gpu/device.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/plan/effect_plan.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/subject.h"
#include "tools/darb/command_list.h"
#include "tools/darb/flags.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/train_window.h"
#include "trainer/job/scene_file.h"
#include "viewer/controls.h"
#include "viewer/picture_pacing.h"
#include "viewer/saved_files.h"
#include "viewer/seconds.h"
#include "viewer/window.h"

namespace darb {

using ViewClock = std::chrono::steady_clock;

/// The window that is measured, and whether its display is gone.
struct MeasuredView {
    ViewerWindow& window;
    const std::atomic<bool>& lost;
};

/// Draws a frame where one is wanted. Throws Error where the window was closed, its display is gone
/// or the viewer shows an error.
void pump(const MeasuredView& m, double patience_s);

struct Rest {
    // until the picture has all pixels; until it has all splats, too
    double refined_s = 0, whole_s = 0;
};
/// Waits until the picture is whole.
Rest rest(const MeasuredView& m);

/// Turns the orbit by the step of this many seconds.
void turn(ViewerWindow& window, double seconds);
/// Orbits for this many seconds and adds each frame's time, ms.
void move(const MeasuredView& m, double seconds, std::vector<double>& moving_ms);

/// PSNR of frames in motion, as the window shows them, against the picture at rest from the same
/// place, with hidden panels, at six places around the scene.
std::vector<double> compare_motion(const MeasuredView& m);

// darb view --times: the frame times of a window in motion and at rest, as a user would see them.

/// Waits for the scene that is being loaded, orbits it for five seconds and lets it rest. Writes
/// the times as JSON and prints them in a line. Throws Error where the load fails, or where the
/// window is closed before the end.
void write_view_times(ViewerWindow& window, const Device& device, const std::atomic<bool>& lost,
                      const std::filesystem::path& file);

// darb view with a window, until it is closed, its display ends or a signal comes.

/// Returns the exit code: 0, or that of the signal that ended it. Throws Error where there is no
/// display or the window fails. Where the window ends by itself, unsaved work is recovered and
/// reported.
int view_in_window(const ViewFlags& flags, const ViewerOptions& options, const PixelSize& size,
                   const std::string& note);

namespace {

constexpr int kJpegQuality = 95;

bool is_jpeg_name(const std::filesystem::path& file) {
    return has_extension(file, ".jpg") || has_extension(file, ".jpeg");
}

void refuse_other_pictures(const std::filesystem::path& file) {
    if (!file.has_extension() || has_extension(file, ".png") || is_jpeg_name(file)) return;
    throw Error(file.string(), "its ending names no picture that can be written",
                "Use .png or .jpg.");
}

// Writes the format that the name's ending asks for; PNG where it has none.
void write_screenshot(const std::filesystem::path& file, const ImageU8& image) {
    if (is_jpeg_name(file))
        write_file_atomic(file, encode_jpeg(image, kJpegQuality));
    else
        write_png(file, image);
}

int without_window(const ViewFlags& flags, const ViewerOptions& options, const PixelSize& size,
                   const std::string& note) {
    DeviceOptions device_options = command_device(flags.device);
    Device device(device_options);
    settle_tuning(device, flags.tune);
    Viewer viewer(device, options);
    apply_flags(viewer, flags, size);
    if (!note.empty()) viewer.session().tell(note);
    if (!flags.scene.empty()) viewer.open(flags.scene);
    viewer.finish_loading();
    viewer.draw_whole(size.width, size.height);
    if (!viewer.session().error.empty()) throw Error("darb view", viewer.session().error);
    if (!flags.screenshot.empty()) {
        viewer.compose();
        viewer.canvas().submit_and_wait();
        write_screenshot(flags.screenshot, viewer.canvas().read_back());
        WrittenFiles({}, flags.force).wrote({flags.screenshot});
        tell("{}\n", flags.screenshot.string());
    }
    if (!flags.frames.empty()) {
        viewer.export_path_now();
        tell(flags.quiet ? nullptr : stdout, "{}\n", viewer.session().note);
        tell_paths(flags.quiet, {flags.frames});
    }
    return 0;
}

// Frames have names of their own, such as frame_00000.png, which photos may have, too.
void refuse_frames_among_photos(const std::filesystem::path& frames,
                                const std::vector<View>& views) {
    std::error_code none;
    for (const auto& file : files_of(views))
        if (!file.empty() && std::filesystem::equivalent(frames, file.parent_path(), none))
            throw Error(frames.string(), "holds photos that are read: " + file.string(),
                        "Name another folder with --export.");
}

int view(ViewFlags flags) {
    const PixelSize size = parse_size(flags.size);
    ViewerOptions options;
    options.up = flags.up;
    options.gui_scale = flags.gui_scale;
    options.quiet = flags.quiet;
    options.units = flags.units;
    options.accuracy = chosen_accuracy(flags.accuracy);
    options.effects = choose_effects(flags.effects, EffectUse::pictures, flags.data);
    if (!flags.up.empty()) up_from_name(flags.up);
    refuse_to_overwrite_inputs({flags.screenshot, flags.times},
                               together({files_of(flags.scene), files_of(flags.cameras),
                                         files_of(flags.path), files_of(flags.mesh)}));
    for (const std::filesystem::path& more : flags.more)
        refuse_to_overwrite_inputs({flags.screenshot, flags.times}, files_of(more));
    refuse_other_pictures(flags.screenshot);
    if (!flags.scene.empty())
        check_scene_file(find_scene(flags.scene));  // reports an error before a window opens
    for (const std::filesystem::path& more : flags.more) check_scene_file(find_scene(more));
    options.more = flags.more;
    options.cameras = flags.cameras;
    if (!flags.mesh.empty()) check_mesh_file(flags.mesh);
    options.mesh = flags.mesh;
    std::string note;
    options.views = find_views(flags, note);
    refuse_to_overwrite_inputs({flags.screenshot, flags.times}, files_of(options.views));
    WrittenFiles({}, flags.force).check({flags.screenshot});
    refuse_frames_among_photos(flags.frames, options.views);
    if (!note.empty()) say("warning: {}\n", note);
    options.resolve = find_scene;
    options.trains_on = can_train_on;
    options.start_at_camera = true;
    if (const auto kept = state_folder(); !kept.empty()) {
        options.up_list = kept / "up.json";
        const bool window = flags.screenshot.empty() && flags.frames.empty() && flags.times.empty();
        if (window) options.recent_list = kept / "recent.json";  // what a person opened
    }
    if (flags.cameras.empty()) options.find_cameras = cameras_beside;
    if (!flags.screenshot.empty() || !flags.frames.empty())
        return without_window(flags, options, size, note);
    return view_in_window(flags, options, size, note);
}

}  // namespace

void add_view(CLI::App& app, Action& action) {
    auto flags = std::make_shared<ViewFlags>();
    CLI::App* command =
        app.add_subcommand("view", "Look at a scene in a window, edit it, fly through it");
    add_view_flags(*command, *flags);
    command->callback([flags, &action] { action = [flags] { return view(*flags); }; });
}

namespace fs = std::filesystem;

std::vector<View> find_views(const ViewFlags& flags, std::string& note) {
    DatasetOptions options = flags.data;
    options.require_photos = false;
    if (!flags.cameras.empty()) return open_cameras(flags.cameras, options);
    if (flags.scene.empty()) return {};
    try {
        return cameras_beside(flags.scene);
    } catch (const Error& e) {
        note = e.what();
        return {};
    }
}

namespace {

std::vector<int> kernels_beside(const ViewFlags& flags) {
    const std::vector<int> kernels =
        flags.beside.empty() ? kernels_of_files(flags.kernel_files)
                             : kernels_from_list("--beside", flags.beside, flags.kernel_files);
    if (kernels.size() > kMostBeside)
        throw Error("--beside", fmt::format("{} kernels are too many", kernels.size()),
                    fmt::format("Up to {} fit beside the scene's own.", kMostBeside));
    for (const int kernel : kernels)
        if (kernel_has_shape(kernel))
            throw Error(fmt::format("--beside {}", kernel_name(kernel)),
                        "takes a shape of each splat, and kernels side by side share their splats",
                        "Open a scene of that kernel, or name another.");
    return kernels;
}

}  // namespace

void apply_flags(Viewer& viewer, const ViewFlags& flags, const PixelSize& size) {
    Session& s = viewer.session();
    const auto choice = [](const std::string& name, std::initializer_list<const char*> names) {
        return static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
    };
    s.display.mode = choice(flags.show, {"picture", "error", "depth", "work"});
    s.display.style =
        static_cast<SplatStyle>(choice(flags.style, {"splats", "points", "ellipsoids"}));
    if (!flags.mesh.empty()) {
        s.display.mesh =
            static_cast<MeshShow>(1 + choice(flags.mesh_show, {"alone", "both", "beside"}));
        s.display.mesh_look =
            static_cast<MeshLook>(choice(flags.mesh_look, {"colours", "shape", "edges"}));
    }
    if (flags.white_background) s.display.background = glm::vec3(1.0f);
    s.panels = !flags.no_panels;
    s.path.export_width = size.width;
    s.path.export_height = size.height;
    s.path.fps = flags.fps;
    if (!flags.frames.empty()) s.path.folder = flags.frames;
    if (!flags.path.empty()) {
        s.path.file = flags.path;
        s.path.path = read_camera_path(flags.path);
        s.path.mark_saved();
    }
    if (!flags.beside.empty() || !flags.kernel_files.empty())
        s.panes.kernels = kernels_beside(flags);
    s.panes.difference = flags.difference;
    if (flags.camera >= 0) viewer.choose_camera(flags.camera);
    if (flags.show == "error" && s.photos.current < 0)
        throw Error("--show error", "needs a photo", "Add --cameras DATASET --camera N.");
    const bool nothing_chosen = s.photos.current < 0 && !flags.screenshot.empty();
    if (flags.compare && (s.photos.views.empty() || nothing_chosen))
        throw Error("--compare", "needs a photo", "Add --cameras DATASET --camera N.");
    s.photos.compare = flags.compare;
}

void add_view_flags(CLI::App& c, ViewFlags& flags) {
    c.add_option("scene", flags.scene,
                 "a splat file or point cloud, a project (.darb.json), or a folder of darb train");
    c.add_option("more", flags.more, "more scenes, each added as a layer");
    c.add_option("--cameras", flags.cameras,
                 "a data set, to look through its cameras and compare with its photos");
    c.add_option("--camera", flags.camera, "start at this camera of the data set, counted from 0")
        ->check(zero_or_more());
    c.add_option("--up", flags.up,
                 "up axis: x, -x, y, -y, z or -z (default: from the cameras, else as turned "
                 "before, else guessed)");
    c.add_option("--size", flags.size, "size of window, screenshot and frames, WIDTHxHEIGHT px")
        ->capture_default_str();
    c.add_option("--screenshot", flags.screenshot,
                 "write the window's content to this .png or .jpg, without a window");
    c.add_flag("--force", flags.force, "let --screenshot replace a picture that darb did not write")
        ->needs(c.get_option("--screenshot"));
    c.add_option("--path", flags.path,
                 "a camera path that the viewer saved, or a camera_path.json of nerfstudio");
    c.add_option(
         "--export", flags.frames,
         "write the path's frames, and with ffmpeg a video, to this folder, without a window")
        ->needs(c.get_option("--path"));
    c.add_option("--fps", flags.fps, "frames a second of --export")
        ->check(CLI::Range(1, 240))
        ->capture_default_str();
    c.add_option("--times", flags.times,
                 "orbit for some seconds, rest, write the frame times to this JSON file, and close")
        ->needs(c.get_option("scene"));
    c.add_option("--show", flags.show, "what is drawn")
        ->check(CLI::IsMember({"picture", "error", "depth", "work"}))
        ->capture_default_str();
    c.add_option("--splats-as", flags.style, "how splats are drawn")
        ->check(CLI::IsMember({"splats", "points", "ellipsoids"}))
        ->capture_default_str();
    c.add_option(
         "--mesh", flags.mesh,
         "a mesh to show with the scene, such as darb mesh writes: .ply, .obj, .glb or .gltf")
        ->needs(c.get_option("scene"));
    c.add_option("--mesh-show", flags.mesh_show,
                 "alone: the mesh; both: mesh and splats in one picture; beside: in two strips")
        ->check(CLI::IsMember({"alone", "both", "beside"}))
        ->needs(c.get_option("--mesh"))
        ->capture_default_str();
    c.add_option("--mesh-as", flags.mesh_look,
                 "colours: those of the vertices; shape: grey; edges: grey with the faces' edges")
        ->check(CLI::IsMember({"colours", "shape", "edges"}))
        ->needs(c.get_option("--mesh"))
        ->capture_default_str();
    c.add_flag("--compare", flags.compare,
               "show the photo beside the picture, at a camera of the data set");
    c.add_option("--beside", flags.beside,
                 "show up to three kernels, named with commas, side by side with the scene's own");
    add_kernel_file_flag(c, flags.kernel_files);
    c.add_flag("--difference", flags.difference,
               "show how all pictures but the leftmost differ from it");
    c.add_flag("--no-panels", flags.no_panels, "start with the panels hidden (key H)");
    c.add_option("--gui-scale", flags.gui_scale, "size of the panels (default: the display's)")
        ->check(CLI::Range(0.5, 4.0));
    c.add_flag("-w,--white-background", flags.white_background, "white, not black");
    add_quiet_flag(c, flags.quiet);
    add_accuracy_flags(c, flags.accuracy);
    add_effects_flag(c, flags.effects);
    add_lens_flag(c, flags.data);
    c.add_option("--device", flags.device, "number or part of a name, see `darb devices`");
    add_tune_flags(c, flags.tune);
    add_unit_options(c, flags.units);
}

namespace {

constexpr double kTurn_s = 20;  // time of a whole turn
constexpr int kCompared = 6;    // frames in motion, a sixth of a turn apart

}  // namespace

void pump(const MeasuredView& m, double patience_s) {
    ViewerWindow& window = m.window;
    if (m.lost) throw Error("window", "the display is gone", "Try again.");
    if (!window.pump(patience_s)) throw Error("--times", "the window was closed", "Try again.");
    const std::string& error = window.viewer().session().error;
    if (!error.empty()) throw Error("darb view", error);
}

Rest rest(const MeasuredView& m) {
    const auto start = ViewClock::now();
    Rest times;
    do {
        pump(m, 0.01);
        if (times.refined_s == 0 && m.window.viewer().refined())
            times.refined_s = seconds_since(start);
    } while (!m.window.viewer().at_rest());
    times.whole_s = seconds_since(start);
    return times;
}

void turn(ViewerWindow& window, double seconds) {
    // as a drag does, because a photo's camera does not move
    leave_photo(window.viewer().session());
    window.viewer().session().navigation.orbit(2 * glm::pi<double>() * seconds / kTurn_s, 0);
    window.redraw();
}

void move(const MeasuredView& m, double seconds, std::vector<double>& moving_ms) {
    const auto start = ViewClock::now();
    for (auto last = start; seconds_since(start) < seconds;) {
        turn(m.window, seconds_since(last));
        last = ViewClock::now();
        pump(m, 0);
        moving_ms.push_back(m.window.viewer().session().times.frame_ms);
    }
}

std::vector<double> compare_motion(const MeasuredView& m) {
    ViewerWindow& window = m.window;
    Session& s = window.viewer().session();
    const bool panels = std::exchange(s.panels, false);
    std::vector<double> psnr_db;
    for (int i = 0; i < kCompared; ++i) {
        turn(m.window, kTurn_s / kCompared);
        rest(m);
        turn(m.window, 0.02);
        pump(m, 0);
        const ImageF moving = to_float(window.viewer().canvas().read_back());
        rest(m);
        psnr_db.push_back(psnr(moving, to_float(window.viewer().canvas().read_back())));
    }
    s.panels = panels;
    window.redraw();
    return psnr_db;
}

namespace {

constexpr double kMotion_s = 5;  // time of the orbit
constexpr int kRests = 5;

// Measures several rests after small turns.
nlohmann::ordered_json rests_json(ViewerWindow& window, const MeasuredView& measured) {
    std::vector<double> refined_s, whole_s, rest_ms;
    for (int i = 0; i < kRests; ++i) {
        if (i > 0) turn(window, 0.05);
        const Rest times = rest(measured);
        refined_s.push_back(times.refined_s);
        whole_s.push_back(times.whole_s);
        rest_ms.push_back(window.viewer().session().times.full_ms);
    }
    return {{"median_ms", nearest_rank(rest_ms, 0.5)},
            {"worst_ms", nearest_rank(rest_ms, 1)},
            {"refined_after_s", nearest_rank(refined_s, 0.5)},
            {"refined_after_worst_s", nearest_rank(refined_s, 1)},
            {"whole_after_s", nearest_rank(whole_s, 0.5)},
            {"whole_after_worst_s", nearest_rank(whole_s, 1)}};
}

}  // namespace

void write_view_times(ViewerWindow& window, const Device& device, const std::atomic<bool>& lost,
                      const std::filesystem::path& file) {
    const MeasuredView measured{window, lost};
    const auto start = ViewClock::now();
    const Session& s = window.viewer().session();
    rest(measured);
    const double to_first_rest_s = seconds_since(start);
    while (!window.viewer().levels_ready()) pump(measured, 0.1);
    const double levels_s = seconds_since(start);
    std::vector<double> moving_ms;
    const auto motion = ViewClock::now();
    move(measured, kMotion_s, moving_ms);
    const double frames_per_s = double(moving_ms.size()) / seconds_since(motion);
    const double first_ms = moving_ms.front();  // taken before they are reordered
    const MotionQuality quality = s.times.quality;
    const nlohmann::ordered_json rests = rests_json(window, measured);
    std::vector<double> psnr_db = compare_motion(measured);
    const Canvas& canvas = window.viewer().canvas();
    const nlohmann::ordered_json json = {{"scene", s.scene->file.filename().string()},
                                         {"splats", s.scene->model.size()},
                                         {"sh_degree", s.scene->model.sh_degree},
                                         {"device", device.info().name},
                                         {"driver", device.info().driver},
                                         {"width_px", canvas.width()},
                                         {"height_px", canvas.height()},
                                         {"load_s", s.scene->load_s},
                                         {"load_to_first_rest_s", to_first_rest_s},
                                         {"load_to_levels_s", levels_s},
                                         {"motion",
                                          {{"frames", moving_ms.size()},
                                           {"frames_per_s", frames_per_s},
                                           {"first_ms", first_ms},
                                           {"median_ms", nearest_rank(moving_ms, 0.5)},
                                           {"p95_ms", nearest_rank(moving_ms, 0.95)},
                                           {"scale", quality.scale},
                                           {"splat_share", quality.splats},
                                           {"psnr_db", nearest_rank(psnr_db, 0.5)},
                                           {"worst_psnr_db", nearest_rank(psnr_db, 0)}}},
                                         {"rest", rests},
                                         {"peak_memory_bytes", peak_memory_bytes()},
                                         {"device_memory_bytes", device.allocated_bytes()}};
    write_file_atomic(file,
                      json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
    tell(
        "{}: {:.1f} frames/s in motion ({:.1f} ms, first {:.1f} ms, {:.1f} dB), at rest {:.1f} "
        "ms\n",
        s.scene->file.filename().string(), frames_per_s, nearest_rank(moving_ms, 0.5), first_ms,
        nearest_rank(psnr_db, 0.5), rests["median_ms"].get<double>());
}

namespace {

constexpr double kSignalNap_s = 0.2;  // between looks for signals and for the end of the display

// Where the window ends by itself, unsaved work is kept.
int show_until_closed(ViewerWindow& window, const std::string& device,
                      const std::atomic<bool>& lost) {
    const std::atomic<bool>& stop = stop_on_signals();
    const auto recovered = [&](const std::string& hint) {
        const std::string kept = recover_unsaved(window.viewer().session());
        return (hint.empty() ? "" : hint + "\n  ") +
               (kept.empty() ? "There were no changes to save." : kept);
    };
    try {
        TrainWindow training(window, device);
        double nap_s = kSignalNap_s;
        while (!stop && window.pump(nap_s)) {
            if (lost) throw Error("window", "the display is gone");
            nap_s = std::min(kSignalNap_s, training.follow());
        }
    } catch (const std::exception& e) {  // also where memory runs out
        if (lost) throw Error("window", "the display is gone", recovered(""));
        const auto* known = dynamic_cast<const Error*>(&e);
        throw known != nullptr ? Error(known->where, known->reason, recovered(known->hint))
                               : Error("window", e.what(), recovered(""));
    }
    if (stop) say("interrupted by {}\n  {}\n", stop_name(), recovered(""));
    return stop ? stop_exit_code() : 0;
}

}  // namespace

int view_in_window(const ViewFlags& flags, const ViewerOptions& options, const PixelSize& size,
                   const std::string& note) {
    // set when the display is gone; declared before what it must outlive
    std::atomic<bool> lost{false};
    const WindowSystem windows;
    survive_display_loss(lost);
    DeviceOptions device_options = command_device(flags.device);
    windows.require(device_options);
    Device device(device_options);
    settle_tuning(device, flags.tune);
    ViewerOptions with_device = options;
    with_device.second_device = device_options;
    ViewerWindow window(device, with_device, size.width, size.height);
    apply_flags(window.viewer(), flags, size);
    if (!note.empty()) window.viewer().session().tell(note);
    if (!flags.scene.empty()) {
        window.viewer().open(flags.scene);
        window.set_title(scene_name(flags.scene, true) + " - darb");
    }
    if (flags.times.empty()) return show_until_closed(window, flags.device, lost);
    write_view_times(window, device, lost, flags.times);
    return 0;
}

}  // namespace darb
