// SPDX-License-Identifier: MIT
// darb train --view: a window that follows a training run. It has a thread and a device of its own,
// so no iteration, evaluation or compilation holds it up. The run draws the window's pictures
// between two iterations, on its own thread and device.
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <string>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "trainer/run/run.h"

namespace darb {

class LiveView {
  public:
    struct State;
    explicit LiveView(std::unique_ptr<State> state);
    ~LiveView();

    /// Hands over what is new and draws a picture where one is due. It blocks while paused, until
    /// something is asked of the run, and returns how long that was with what was asked. Once the
    /// window is closed it does nothing; where the window fails, it is closed with a warning and
    /// the run goes on.
    LiveAnswer show(const LiveStep& step);
    /// Whether the user stopped the run and wants a web page of it.
    bool publishes() const;
    /// The run is over: shows its scene until the window is closed, and says this first; empty:
    /// nothing.
    void finish(const std::filesystem::path& model, const std::string& said = {});

  private:
    void warn(const std::string& reason);
    std::unique_ptr<State> state_;
    bool publishes_ = false;  // as it was when the window was closed
};

/// Starts the window system, which must happen before the device is made; does nothing where `on`
/// is false. Throws Error where there is no display, or no viewer in this build.
class LiveSystem {
  public:
    /// options: for the run's device; the window uses the same one.
    LiveSystem(bool on, const DeviceOptions& options);
    ~LiveSystem();
    /// Null where it is off. stop: set by Ctrl-C, ends a pause. white: the background is white
    /// instead of black.
    std::unique_ptr<LiveView> open(Device& device, const Dataset& dataset,
                                   const std::atomic<bool>& stop, bool white) const;

  private:
    struct System;
    std::unique_ptr<System> system_;
};

}  // namespace darb
