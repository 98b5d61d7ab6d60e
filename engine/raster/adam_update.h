// AdamUpdate: the step of the optimiser from gradients in buffers, which may be of several views,
// of other processes or a caller's own. For one view it is the step that Backward::record makes, to
// rounding: Adam with bias correction (Kingma and Ba 2015), the regularisers, the largest scale,
// the fading of what stands too near to a camera, and the harmonics' step in every so many
// iterations.
#pragma once

#include <array>
#include <map>

#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "engine/raster/adam_step.h"
#include "engine/raster/frame_view.h"
#include "engine/raster/gradient_buffers.h"

namespace darb {

class AdamUpdate {
  public:
    explicit AdamUpdate(Device& device);

    /// splats must have moments, and the gradients must be theirs. status: gpu::FrameStatus of the
    /// frames; where one overflowed nothing happens. scale: of the gradients, 1 / views for the
    /// mean of the views' losses. step.clearance is record_fading's. Throws Error for what
    /// check_step refuses and for gradients of other splats.
    void record(Commands& commands, GpuSplats& splats, const GradientBuffers& gradients,
                const Buffer& status, int sh_degree, const AdamStep& step, float scale = 1);

    /// After record(), once for each view of the step: splats nearer to the camera than the
    /// clearance (world units) fade. Records nothing where that is 0.
    void record_fading(Commands& commands, GpuSplats& splats, const GradientBuffers& gradients,
                       const Buffer& status, const FrameView& view, float clearance);

    /// What the views showed, added to sums [N][2] as Backward::gradient_sum() holds them.
    void record_sums(Commands& commands, const GradientBuffers& gradients, const Buffer& status,
                     const Buffer& gradient_sum);

  private:
    const Pipeline& pipeline(int attribute, std::uint32_t floats, int rest);

    Device* device_;
    std::map<std::array<int, 3>, Pipeline> pipelines_;  // by attribute, floats and REST_*
    Pipeline fade_, add_views_;
};

}  // namespace darb
