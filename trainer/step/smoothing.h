// SPDX-License-Identifier: MIT
// The 3D smoothing filter of Mip-Splatting in training: its deviations on the device, and splats
// with the filter worked in for files.
#pragma once

#include <vector>

#include "engine/gpu/commands.h"
#include "engine/raster/forward.h"

namespace darb {

class SmoothingFilter {
  public:
    SmoothingFilter(Device& device, const ProjectionEffects& effects);

    /// Sizes splats.smoothing() and fills it from its positions and these cameras. Waits.
    void update(GpuSplats& splats, const Buffer& cameras, std::uint32_t camera_count);

  private:
    Device* device_;
    Pipeline filter_;
    Commands commands_;
};

/// The filter of a run: it follows the splats as they move, come and go.
class TrainedSmoothing {
  public:
    /// cameras: those of the training photos at their whole size.
    TrainedSmoothing(Device& device, const ProjectionEffects& effects,
                     const std::vector<gpu::CameraData>& cameras);

    /// To be called after every step, which was the iterations (begin, end]: notes whether the
    /// filter has to follow one of them.
    void advance(int begin, int end);
    void mark_stale() { stale_ = true; }
    bool is_stale() const { return stale_; }
    /// The queue must be idle.
    void update(GpuSplats& splats);

  private:
    SmoothingFilter filter_;
    Buffer cameras_;
    std::uint32_t camera_count_;
    bool stale_ = true;
};

/// The same splats without a filter beside them: standard deviations widened, opacities lowered.
/// filter: [N] world units. They look the same through project.comp, up to rounding and to
/// opacities whose logit float32 does not hold.
SplatModel bake_smoothing(const SplatModel& model, const std::vector<float>& filter);

}  // namespace darb
