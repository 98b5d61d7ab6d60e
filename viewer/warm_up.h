// WarmUp: compiles what the pictures of a scene need before a window draws the first, on a thread
// of its own. It draws on a device of its own first: drivers that compile at the first dispatch
// keep that on disk, Mesa's among them. Then it makes the same pipelines for the window's device,
// which finds them there.
#pragma once

#include <atomic>
#include <functional>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "engine/gpu/device.h"
#include "engine/gpu/pipeline.h"
#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"
#include "viewer/display.h"

namespace darb {

class WarmUp {
  public:
    /// window: the window's device, which outlives this. options: of one like it. displays: a pane
    /// each. A few splats of the model are drawn, at rest and in motion. wake: called from the
    /// thread at the end. Its destructor waits for the picture or pipeline under way.
    WarmUp(Device& window, DeviceOptions options, const SplatModel& model,
           std::vector<DisplaySettings> displays, const Camera& camera, std::function<void()> wake);
    /// Whether it is over; also where it failed, as the window then compiles itself.
    bool done() const { return done_; }
    /// Once it is done, for the window's device: to be kept until its pictures are drawn.
    std::vector<Pipeline> take_pipelines() { return std::move(made_); }

  private:
    void run(const std::stop_token& stop, Device& window, const DeviceOptions& options,
             const SplatModel& few, const std::vector<DisplaySettings>& displays,
             const Camera& camera);
    std::vector<Pipeline> made_;
    std::atomic<bool> done_{false};
    std::jthread thread_;  // the last member
};

}  // namespace darb
