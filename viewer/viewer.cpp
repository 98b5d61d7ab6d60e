#include "viewer/viewer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/error.h"
#include "engine/data/camera_list.h"
#include "viewer/controls.h"
#include "viewer/tools.h"

namespace darb {

namespace {

constexpr double kStep_s = 1.0 / 60;
constexpr double kLook_s = 0.1;  // between two looks whether ffmpeg has ended

glm::dvec3 start_up(const ViewerOptions& options) {
    if (!options.up.empty()) return up_from_name(options.up);
    return up_of_cameras(cameras_of(options.views)).value_or(glm::dvec3(0, -1, 0));
}

}  // namespace

Viewer::Viewer(Device& device, ViewerOptions options, GLFWwindow* window)
    : device_(&device),
      options_(std::move(options)),
      loader_(options_.resolve, options_.wake),
      canvas_(device),
      gui_(device, canvas_.render_pass(), options_.gui_scale > 0 ? options_.gui_scale : 1, window),
      picture_(device),
      panes_(device),
      remembered_(options_.up_list),
      recent_(options_.recent_list) {
    session_.photos.views = options_.views;
    session_.navigation.set_up(start_up(options_));
    session_.device_name = device.info().name;
    session_.display.accuracy = options_.accuracy;
    // Of each scene that is opened, see show_as_meant.
    session_.display.accuracy.choice[kFootprint] = session_.display.accuracy.choice[kShDegree] = 0;
    session_.gui_scale = options_.gui_scale > 0 ? options_.gui_scale : 1;
    last_frame_ = Clock::now();
}

Viewer::~Viewer() = default;

void Viewer::choose_camera(int n) {
    const int count = static_cast<int>(session_.photos.views.size());
    if (n < 0 || n >= count)
        throw Error("--camera",
                    count == 0 ? "there is no data set to take a camera from"
                               : fmt::format("{} is not one of 0 to {}", n, count - 1),
                    "Name the data set, or a cameras.json: --cameras DATASET.");
    session_.photos.current = n;
    session_.photos.failed = false;
    take_back<request::FrameAll>(session_.requests);  // of a load before
    session_.navigation.take(session_.photos.view().camera);
    if (!shows_nothing()) set_pivot();
}

void Viewer::set_gui_scale(float scale) {
    session_.gui_scale = scale;
    gui_.set_scale(scale);
}

bool Viewer::refined() const {
    return pacing_.refined();
}

bool Viewer::at_rest() const {
    return !loading() && !warm_up_ && pacing_.is_whole() && ready_to_move() && rehearsals_ == 0;
}

double Viewer::frame(const Input& input, int width, int height, bool full) {
    frame_start_ = Clock::now();
    // After a pause only a short step: nothing moved in between.
    const double seconds =
        continuous_ ? std::chrono::duration<double>(frame_start_ - last_frame_).count() : kStep_s;
    last_frame_ = frame_start_;
    take_loaded();
    take_levels();
    if (warm_up_ && warm_up_->done()) end_warm_up();
    if (at_rest()) warm_pipelines_.clear();  // the pictures have them
    for (const auto& path : input.dropped) drop(path);
    canvas_.resize(width, height);
    gui_.begin(width, height);  // now it knows whether the pointer is on a panel
    if (!gui_.wants_keys())
        for (const Key key : input.pressed) press(key, session_);
    follow_photo(width, height);
    const ControlFrame control{width, height, seconds, gui_.wants_mouse(), gui_.wants_keys()};
    Input moves = input;
    if (use_tool(input, control, session_)) moves.left = moves.double_click = false;
    move_camera(moves, control, session_);
    play_path(seconds, session_);
    draw_panels(session_);
    gui_.end();
    act_on_requests(width, height);
    remember_up();
    const bool works = work_.draws();
    step_work();
    load_current_photo();
    pacing_.skip();
    if (live_ != nullptr)
        follow_live(width, height);
    else if (!picture_.empty() && !warm_up_)
        pace_picture(width, height, full, works);

    const double look_s = std::min(
        work_.exports() ? kLook_s : std::numeric_limits<double>::infinity(), expire_toasts());
    continuous_ = session_.path.playing || (!shows_nothing() && (works || holds_a_key(input)));
    if (continuous_) return 0;
    if (pacing_.rehearses() && rehearsals_ > 0) return 0;
    const double refine_s = pacing_.seconds_to_refine(frame_start_);
    if (!picture_.empty() && std::isfinite(refine_s)) return std::min(look_s, refine_s);
    return std::min(look_s, pacing_.count_still_frame());
}

// Returns seconds until the next one goes.
double Viewer::expire_toasts() {
    Session& s = session_;
    if (std::exchange(told_, s.told) != s.told) pacing_.unsettle();  // it is not drawn yet
    const auto now = Clock::now();
    while (!s.toasts.empty() && s.toasts.front().until <= now) s.toasts.pop_front();
    if (s.toasts.empty()) return std::numeric_limits<double>::infinity();
    return std::chrono::duration<double>(s.toasts.front().until - now).count() + 0.001;
}

void Viewer::draw_whole(int width, int height) {
    frame({}, width, height, true);
    pacing_.forget();  // the times are those of a second picture: the first may have compiled
    do frame({}, width, height, true);
    while (!pacing_.settled());
}

void Viewer::compose() {
    canvas_.compose(shown(), session_.display.background,
                    [this](VkCommandBuffer commands) { gui_.draw(commands); });
}

}  // namespace darb
