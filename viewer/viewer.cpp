// SPDX-License-Identifier: MIT
#include "viewer/viewer.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "engine/core/error.h"
#include "viewer/seconds.h"

namespace darb {

namespace {

constexpr double kStep_s = 1.0 / 60;
constexpr double kLook_s = 0.1;  // time between two looks at whether ffmpeg has ended
constexpr double kNoFrame = std::numeric_limits<double>::infinity();

float panel_scale(const ViewerOptions& options) {
    return options.gui_scale > 0 ? options.gui_scale : 1;
}

}  // namespace

Viewer::Viewer(Device& device, const ViewerOptions& options, GLFWwindow* window)
    : document_(session_, options),
      painter_(device, session_, {panel_scale(options), options.wake, options.second_device},
               window),
      controller_(device, session_, document_, painter_) {
    session_.device_name = device.info().name;
    session_.gui_scale = panel_scale(options);
    session_.open_dialog.recent = document_.recent();
    session_.wake = options.wake;
}

double Viewer::frame(const Input& input, int width, int height, bool full) {
    const double seconds = start_clock();
    painter_.begin(width, height);  // from here on the panels know whether the pointer is on one
    controller_.take_loaded();
    controller_.take_pictures_of_run();
    const Gui& gui = painter_.gui();
    const bool flies = controller_.take_input(
        input, {width, height, seconds, gui.wants_mouse(), gui.wants_keys()});
    draw_panels(session_);
    painter_.gui().end();
    controller_.act(width, height);
    const bool works = painter_.draws_work();
    painter_.paint({width, height, full, document_.follows_run()});
    const double toasts_s = controller_.expire_toasts();
    continuous_ = session_.path.playing || (!document_.empty() && (works || flies));
    if (continuous_) return 0;
    return std::min(
        {painter_.exports() ? kLook_s : kNoFrame, toasts_s, painter_.seconds_to_next()});
}

// Returns the seconds by which the frame moves. After a pause they are few, because nothing moved
// in between.
double Viewer::start_clock() {
    const double since =
        seconds_since(std::exchange(last_frame_, std::chrono::steady_clock::now()));
    return continuous_ ? since : kStep_s;
}

void Viewer::draw_whole(int width, int height) {
    frame({}, width, height, true);
    painter_.forget();  // times should come from a second picture, as the first may have compiled
    do frame({}, width, height, true);
    while (!painter_.settled());
}

void Viewer::open(const std::filesystem::path& path) {
    session_.attempt([&] { document_.load(path, false); });
}

void Viewer::finish_loading() {
    if (!loading()) {
        if (!session_.error.empty()) throw Error("darb view", session_.error);
        return;
    }
    controller_.finish_loading();
    painter_.finish_mesh();
}

void Viewer::make_room_for_run(std::vector<View> views) {
    painter_.begin_run();
    document_.make_room_for_run(std::move(views));
}

void Viewer::show_live(LivePicture& pictures, const Bounds& bounds, const LiveScene& scene) {
    painter_.begin_run();
    document_.follow_run(pictures, bounds, scene);
}

void Viewer::end_live() {
    controller_.take_pictures_of_run();
    document_.end_run();
}

void Viewer::set_gui_scale(float scale) {
    session_.gui_scale = scale;
    painter_.gui().set_scale(scale);
}

void Viewer::export_path_now() {
    document_.need_scene("export");
    painter_.start_export();
    painter_.forget();
    while (painter_.exports()) painter_.step_export(true);
}

}  // namespace darb
