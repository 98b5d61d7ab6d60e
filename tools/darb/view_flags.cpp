#include "tools/darb/view_flags.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/shaped_kernel.h"
#include "tools/darb/effect_flags.h"
#include "tools/darb/kernel_flags.h"
#include "tools/darb/numbers.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/unit_flags.h"
#include "trainer/job/scene_file.h"

namespace darb {

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
    c.add_option("scene", flags.scene, "a splat file or point cloud, or a folder of darb train");
    c.add_option("--cameras", flags.cameras,
                 "a data set, to look through its cameras and compare with its photos");
    c.add_option("--camera", flags.camera, "start at this camera of the data set, from 0")
        ->check(zero_or_more());
    c.add_option(
        "--up", flags.up,
        "x, -x, y, -y, z or -z (default: from the cameras, else as turned before, else guessed)");
    c.add_option("--size", flags.size, "WIDTHxHEIGHT of window, screenshot and frames, px")
        ->capture_default_str();
    c.add_option("--screenshot", flags.screenshot,
                 "write the window's content to this .png or .jpg, without a window");
    c.add_flag("--force", flags.force, "let --screenshot replace a picture that darb did not write")
        ->needs(c.get_option("--screenshot"));
    c.add_option("--path", flags.path,
                 "a camera path that the viewer saved, or a camera_path.json of nerfstudio");
    c.add_option("--export", flags.frames,
                 "write the path's frames (and a video, with ffmpeg) to this folder, no window")
        ->needs(c.get_option("--path"));
    c.add_option("--fps", flags.fps, "frames a second of --export")
        ->check(CLI::Range(1, 240))
        ->capture_default_str();
    c.add_option("--times", flags.times,
                 "orbit for some seconds, rest, write frame times to this JSON, and close")
        ->needs(c.get_option("scene"));
    c.add_option("--show", flags.show, "what is drawn")
        ->check(CLI::IsMember({"picture", "error", "depth", "work"}))
        ->capture_default_str();
    c.add_option("--splats-as", flags.style, "how splats are drawn")
        ->check(CLI::IsMember({"splats", "points", "ellipsoids"}))
        ->capture_default_str();
    c.add_flag("--compare", flags.compare, "photo beside the picture, at a camera of the data set");
    c.add_option("--beside", flags.beside,
                 "these kernels, with commas, side by side with the scene's own: up to three");
    add_kernel_file_flag(c, flags.kernel_files);
    c.add_flag("--difference", flags.difference,
               "all but the leftmost of what is side by side show their error to it");
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

}  // namespace darb
