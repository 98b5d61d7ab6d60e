// darb view SCENE: the interactive viewer; with --screenshot or --export it needs no window system.

#include <fmt/format.h>

#include <memory>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/core/text.h"
#include "engine/core/user_folders.h"
#include "engine/data/image_io.h"
#include "engine/gpu/device_environment.h"
#include "engine/plan/effect_plan.h"
#include "tools/darb/command_list.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/view_flags.h"
#include "tools/darb/view_window.h"
#include "trainer/job/scene_file.h"

namespace darb {

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

// As its ending says; PNG where it has none.
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

// Frames have names of their own, frame_00000.png and so on, which photos may have, too.
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
    refuse_to_overwrite_inputs(
        {flags.screenshot, flags.times},
        together({files_of(flags.scene), files_of(flags.cameras), files_of(flags.path)}));
    refuse_other_pictures(flags.screenshot);
    if (!flags.scene.empty())
        check_scene_file(find_scene(flags.scene));  // says so before a window opens
    std::string note;
    options.views = find_views(flags, note);
    refuse_to_overwrite_inputs({flags.screenshot, flags.times}, files_of(options.views));
    WrittenFiles({}, flags.force).check({flags.screenshot});
    refuse_frames_among_photos(flags.frames, options.views);
    if (!note.empty()) say("warning: {}\n", note);
    options.resolve = find_scene;
    options.start_at_camera = true;
    if (const auto kept = state_folder(); !kept.empty()) {
        options.up_list = kept / "up.json";
        const bool window = flags.screenshot.empty() && flags.frames.empty() && flags.times.empty();
        if (window) options.recent_list = kept / "recent.json";  // of what a person opened
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

}  // namespace darb
