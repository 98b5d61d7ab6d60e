// One step of training on a random scene and a photo of noise, in both ways: Adam within the
// backward pass, or gradients in buffers and a pass of its own. Each has splats of its own.
#pragma once

#include <vector>

#include "engine/gpu/commands.h"
#include "engine/raster/adam_update.h"
#include "engine/raster/backward.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/loss.h"

namespace darb {

class BenchStep {
  public:
    BenchStep(Device& device, const SplatModel& model, const Camera& camera);

    /// The passes of one step.
    std::vector<PassTime> run(bool apart);
    const gpu::FrameStatus& status() const { return status_; }
    /// Of the last step.
    const std::vector<RecordedPass>& recorded() const { return commands_.recorded(); }

  private:
    void record_apart(GpuSplats& splats);

    int sh_degree_;
    FrameBuffers buffers_;
    Forward forward_;
    Backward backward_;
    Loss loss_;
    AdamUpdate update_;
    Commands commands_;
    GpuSplats fused_, apart_;
    GradientBuffers gradients_;
    FrameView view_;
    Buffer cameras_, photo_, d_image_, result_;
    gpu::FrameStatus status_{};
};

}  // namespace darb
