// SPDX-License-Identifier: MIT
#include "viewer/controls.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "viewer/tools.h"
#include "viewer/view_camera.h"

namespace darb {

namespace {

bool run_goes_on(const Session& s) {
    return s.training.live && !s.training.finished;
}

// From the free camera it steps to the first or the last one.
void step_camera(Session& s, bool next) {
    const int count = static_cast<int>(s.photos.views.size());
    if (count == 0) return;
    const int from = s.photos.current >= 0 ? s.photos.current : next ? count - 1 : 0;
    s.ask(request::ChooseCamera{(from + (next ? 1 : count - 1)) % count});
}

void play_or_pause(Session& s) {
    if (run_goes_on(s))
        s.training.paused = !s.training.paused;
    else
        s.path.playing = !s.path.playing && !s.path.path.keys.empty();
}

void step_training(Session& s) {
    if (!run_goes_on(s)) return;
    s.training.paused = true;
    ++s.training.steps_to_go;
}

// Removes the last measured point while measuring, else the selection, or what is inside the box or
// sphere that is shown.
void remove_selected(Session& s) {
    if (!s.scene || s.edit.transforms()) return;
    if (s.tools.tool == Tool::measure)
        drop_measured_point(s);
    else if (s.edit.selected_count() > 0)
        show_edit(s.edit.remove_selected(), s);
    else if (s.selection.shown)
        show_edit(s.edit.remove(s.scene->model, s.selection.region, true), s);
}

void edit_by_key(Session& s, std::size_t (*edit)(Edit&)) {
    if (s.scene && !s.edit.transforms()) show_edit(edit(s.edit), s);
}

SplatSet all_of(const Edit& edit, std::uint8_t value) {
    return SplatSet(edit.removed().size(), value);
}

void stop_and_close(Session& s) {
    if (cancel_stroke(s)) return;
    s.path.playing = false;
    s.error.clear();
    s.help = false;
    s.open_dialog.shown = false;
    choose_tool(Tool::navigate, s);
    s.ask(request::CancelLoad{});
    s.ask(request::CancelWork{});
    s.ask(request::Stay{});
    s.ask(request::LeaveFullScreen{});
}

struct KeyRow {
    Key key;
    void (*act)(Session&);
};

constexpr KeyRow kKeys[] = {
    {Key::frame_all, [](Session& s) { s.ask(request::FrameAll{}); }},
    {Key::level, [](Session& s) { s.navigation.level(); }},
    {Key::hide_panels, [](Session& s) { s.panels = !s.panels; }},
    {Key::full_screen, [](Session& s) { s.ask(request::ToggleFullScreen{}); }},
    {Key::picture, [](Session& s) { s.ask(request::TakePicture{}); }},
    {Key::next_camera, [](Session& s) { step_camera(s, true); }},
    {Key::last_camera, [](Session& s) { step_camera(s, false); }},
    {Key::add_key, [](Session& s) { s.path.path.add(s.navigation, s.path.seconds_per_key); }},
    {Key::play, play_or_pause},
    {Key::step, step_training},
    {Key::remove, remove_selected},
    {Key::undo, undo_edit},
    {Key::redo, redo_edit},
    {Key::select_all,
     [](Session& s) {
         edit_by_key(s, [](Edit& e) { return e.select(all_of(e, 1), Combine::replace); });
     }},
    {Key::select_none,
     [](Session& s) {
         edit_by_key(s, [](Edit& e) { return e.select(all_of(e, 0), Combine::replace); });
     }},
    {Key::select_others,
     [](Session& s) { edit_by_key(s, [](Edit& e) { return e.invert_selection(); }); }},
    {Key::hide, [](Session& s) { edit_by_key(s, [](Edit& e) { return e.hide_selected(); }); }},
    {Key::show_hidden, [](Session& s) { edit_by_key(s, [](Edit& e) { return e.show_hidden(); }); }},
    {Key::open, [](Session& s) { s.ask(request::ShowOpen{}); }},
    {Key::save, [](Session& s) { s.ask(request::Save{}); }},
    {Key::quit, [](Session& s) { s.ask(request::Quit{}); }},
    {Key::help, [](Session& s) { s.help = !s.help; }},
    {Key::escape, stop_and_close},
};

// The directions right, up and ahead; a key and its opposite cancel out.
glm::dvec3 flight(const Input& in) {
    return {double(in.to_right) - double(in.to_left), double(in.rise) - double(in.sink),
            double(in.ahead) - double(in.back)};
}

void drag(const Input& in, int height, Session& s) {
    Navigation& n = s.navigation;
    const bool pans = in.middle || (in.left && in.shift);
    if (!pans && !in.left && !in.right) return;
    // the window's height is half a turn
    const double turn = glm::pi<double>() / std::max(height, 1);
    leave_photo(s);
    if (pans)
        n.pan(in.dx, in.dy, height);
    else if (in.right)
        n.look(in.dx * turn, in.dy * turn);
    else
        n.orbit(in.dx * turn, in.dy * turn);
}

// While flying, the wheel changes the speed.
void turn_wheel(const Input& in, Session& s) {
    if (in.right || (flight(in) != glm::dvec3(0.0) && !in.control)) {
        s.fly_speed *= std::pow(1.25, in.wheel);
    } else {
        leave_photo(s);
        s.navigation.zoom(std::pow(0.9, in.wheel));
    }
}

}  // namespace

void press(Key key, Session& s) {
    const int tool = static_cast<int>(key) - static_cast<int>(Key::tool_navigate);
    if (tool >= 0 && tool < kToolCount) choose_tool(static_cast<Tool>(tool), s);
    for (const KeyRow& row : kKeys)
        if (row.key == key) row.act(s);
}

bool holds_a_key(const Input& in) {
    return in.ahead || in.back || in.to_left || in.to_right || in.rise || in.sink;
}

void leave_photo(Session& s) {
    if (s.photos.current >= 0 && s.photos.shown_fov_y > 0) {
        s.navigation.fov_y = s.photos.shown_fov_y;
        s.navigation.centre_x = s.photos.shown_centre_x;
    }
    s.photos.current = -1;
    if (s.display.mode == VIEW_ERROR) s.display.mode = VIEW_COLOUR;
}

void move_camera(const Input& in, const ControlFrame& frame, Session& s) {
    if (!frame.panels_want_mouse) {
        if (in.dx != 0 || in.dy != 0) drag(in, frame.height, s);
        if (in.wheel != 0) turn_wheel(in, s);
        if (in.double_click && s.scene) {
            const Camera camera =
                camera_in_window(s.photos, s.navigation, free_area(s, frame.width, frame.height));
            if (const auto hit = pick(s.scene->model, s.edit.unseen(), camera, in.x, in.y))
                s.navigation.set_pivot_depth(*hit);
        }
    }
    const glm::dvec3 direction = flight(in);
    if (direction == glm::dvec3(0.0) || in.control || frame.panels_want_keys) return;
    leave_photo(s);
    s.navigation.fly(glm::normalize(direction) * s.fly_speed * std::min(frame.seconds, 0.25));
}

void AskedState::tell(const std::string& text) {
    constexpr auto kShown = std::chrono::seconds(4);
    note = text;
    toasts.push_back({text, std::chrono::steady_clock::now() + kShown});
    ++told;
}

bool AskedState::attempt(const std::function<void()>& step) {
    try {
        step();
        return true;
    } catch (const std::exception& e) {
        error = e.what();
        return false;
    }
}

void play_path(double seconds, Session& s) {
    PathState& p = s.path;
    p.playing = p.playing && !p.path.keys.empty();
    if (!p.playing) return;
    p.at_s += seconds;
    leave_photo(s);
    apply(p.path.sample(p.at_s), s.navigation);
    if (p.at_s < p.path.duration()) return;
    p.at_s = 0;
    p.playing = false;
}

}  // namespace darb
