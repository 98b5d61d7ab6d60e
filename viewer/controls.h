// SPDX-License-Identifier: MIT
// What keys and the pointer do: with the camera at once, with everything else as requests.
#pragma once

#include "viewer/input.h"
#include "viewer/session.h"

namespace darb {

/// Of a frame in which input is looked at.
struct ControlFrame {
    int width = 0, height = 0;  // px of the window
    double seconds = 0;         // since the frame before
    bool panels_want_mouse = false, panels_want_keys = false;
};

void press(Key key, Session& session);
void move_camera(const Input& input, const ControlFrame& frame, Session& session);
/// The camera goes on along the path that is played.
void play_path(double seconds, Session& session);
/// Back to the free camera, where it is.
void leave_photo(Session& session);
/// One that moves the camera.
bool holds_a_key(const Input& input);

}  // namespace darb
