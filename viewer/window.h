// SPDX-License-Identifier: MIT
// ViewerWindow: a GLFW window around a Viewer. It draws a frame when there is something new (input,
// a finished load, a picture to refine), and otherwise the process sleeps.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "engine/gpu/device.h"
#include "viewer/viewer.h"

namespace darb {

/// The window system. It is started before the device, so that the device can be made for it.
class WindowSystem {
  public:
    WindowSystem();  // throws Error where there is no display
    ~WindowSystem();
    WindowSystem(const WindowSystem&) = delete;
    WindowSystem& operator=(const WindowSystem&) = delete;
    /// Asks for what Device needs to present to windows.
    void require(DeviceOptions& options) const;
};

class ViewerWindow {
  public:
    /// options.wake is set here. width and height are in screen coordinates.
    ViewerWindow(Device& device, ViewerOptions options, int width, int height);
    ~ViewerWindow();
    ViewerWindow(const ViewerWindow&) = delete;
    ViewerWindow& operator=(const ViewerWindow&) = delete;

    Viewer& viewer();
    void set_title(const std::string& title);
    /// Makes the next pump draw a frame.
    void redraw();
    /// Handles what happened and draws a frame where one is wanted. Sleeps up to patience_s (may be
    /// infinity) until there is something to do. Returns false once the window is closed.
    bool pump(double patience_s);
    /// Does what `wake` of the options does; may be called from any thread.
    void wake();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace darb
