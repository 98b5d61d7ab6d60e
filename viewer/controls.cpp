// SPDX-License-Identifier: MIT
#include "viewer/controls.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "viewer/commands.h"
#include "viewer/tools.h"
#include "viewer/view_camera.h"

namespace darb {

namespace {

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
    const Command& c = command(key);
    if (c.enabled(s)) c.act(s);
}

bool holds_a_key(const Input& in) {
    return in.ahead || in.back || in.to_left || in.to_right || in.rise || in.sink;
}

void leave_photo(Session& s) {
    if (s.photos.current >= 0 && s.photos.shown_fov_y > 0) {
        s.navigation.fov_y = s.photos.shown_fov_y;
        s.navigation.centre_x = s.photos.shown_centre_x;
        s.navigation.centre_y = s.photos.shown_centre_y;
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
