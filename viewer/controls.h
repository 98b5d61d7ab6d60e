// SPDX-License-Identifier: MIT
// What keys and the pointer do: they move the camera at once, and everything else becomes a
// request.
#pragma once

#include "viewer/input.h"
#include "viewer/session.h"

namespace darb {

/// The frame in which input is handled.
struct ControlFrame {
    int width = 0, height = 0;  // px of the window
    double seconds = 0;         // since the frame before
    bool panels_want_mouse = false, panels_want_keys = false;
};

void press(Key key, Session& session);
void move_camera(const Input& input, const ControlFrame& frame, Session& session);
/// Moves the camera along the path that is being played.
void play_path(double seconds, Session& session);
/// Switches back to the free camera, which takes over the current view.
void leave_photo(Session& session);
/// Whether a key that moves the camera is held.
bool holds_a_key(const Input& input);

}  // namespace darb
