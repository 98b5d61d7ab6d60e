// SPDX-License-Identifier: MIT
// TrainWindow: training from the window of darb view. While the form is filled in it looks at the
// photos and forecasts the run, and then it runs it in a thread of its own, as darb train does.
#pragma once

#include <memory>
#include <string>

#include "viewer/window.h"

namespace darb {

class TrainWindow {
  public:
    /// device: as --device takes it, for runs whose form names none.
    TrainWindow(ViewerWindow& window, std::string device);
    /// Ends a run that goes on, which saves itself first, and waits for it.
    ~TrainWindow();
    TrainWindow(const TrainWindow&) = delete;
    TrainWindow& operator=(const TrainWindow&) = delete;

    /// Does what the form asks for; in the window's thread, between two frames. Returns for how
    /// many seconds it can be left alone.
    double follow();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace darb
