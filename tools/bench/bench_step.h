// One step of training on a random scene and a photo of noise, in both ways: Adam within the
// backward pass, or gradients in buffers and a pass of its own. Each has splats of its own.
#pragma once

#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/gpu/device.h"
#include "engine/gpu/pipeline_statistics.h"
#include "engine/raster/adam.h"
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

// Every pass of pictures and of training, compiled as a device would run it, and what an iteration
// of training records. Nothing is executed, so that drivers which cannot do it serve as well.

struct RecordedWork {
    RecordedPass pass;
    double bytes = 0;  // that it must move at least once (engine/plan/roofline.h); 0: not known
};

struct PassStatistics {
    DeviceInfo device;
    bool has_statistics = false;             // of the driver; without: times of compilation alone
    std::vector<CompiledPipeline> compiled;  // each once, by shader and constants
    /// An iteration of `splats` visible splats of degree 3 in a picture of this size with six
    /// intersections a splat, the Adam step within the backward pass.
    std::vector<RecordedWork> iteration;
    double splats = 0, pixels = 0, intersections = 0;
};

/// All choices that the device has of a pass (engine/plan/tuning_names.h), the usual ones first.
/// Throws Error as Device does.
PassStatistics compile_every_pass(const std::string& select);

/// For people, a row each.
void print_pass_statistics(std::FILE* out, const PassStatistics& statistics);
/// Everything that the driver says, and the common quantities of it.
nlohmann::json pass_statistics_json(const PassStatistics& statistics);

}  // namespace darb
