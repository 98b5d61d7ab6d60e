// WarmUp: compiles what the pictures of a scene need before a window draws the first, on a thread
// and a device of its own. Drivers keep what was compiled on disk, Mesa's among them, so the
// window's device finds it there and is not held up for seconds.
#pragma once

#include <atomic>
#include <functional>
#include <thread>
#include <vector>

#include "engine/gpu/device.h"
#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"
#include "viewer/display.h"

namespace darb {

class WarmUp {
  public:
    /// options: of a device like the window's. displays: a pane each. A few splats of the model are
    /// drawn, at rest and in motion. wake: called from the thread at the end.
    WarmUp(DeviceOptions options, const SplatModel& model, std::vector<DisplaySettings> displays,
           const Camera& camera, std::function<void()> wake);
    /// Whether it is over; also where it failed, as the window then compiles itself.
    bool done() const { return done_; }

  private:
    void run(const DeviceOptions& options, const SplatModel& few,
             const std::vector<DisplaySettings>& displays, const Camera& camera) const;
    std::atomic<bool> done_{false};
    std::jthread thread_;  // the last member
};

}  // namespace darb
