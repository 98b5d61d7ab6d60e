// SPDX-License-Identifier: MIT
// One training step on a random scene and a photo of noise, in two ways: with Adam inside the
// backward pass, or with gradients in buffers and a pass of its own. Each way has its own splats.
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

    /// Runs one step and returns its passes.
    std::vector<PassTime> run(bool apart);
    const gpu::FrameStatus& status() const { return status_; }
    /// The passes of the last step.
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

// Compiles every pass of pictures and of training as a device would run it, and lists what a
// training iteration records. Nothing is executed, so that drivers without a device serve as well.

struct RecordedWork {
    RecordedPass pass;
    double bytes = 0;  // the least that it must move (engine/plan/roofline.h); 0: not known
};

struct PassStatistics {
    DeviceInfo device;
    bool has_statistics = false;             // from the driver; otherwise there are only times of
                                             // compilation
    std::vector<CompiledPipeline> compiled;  // one per shader and set of constants
    /// An iteration with `splats` visible splats of degree 3, in a picture of this size with six
    /// intersections per splat, and the Adam step inside the backward pass.
    std::vector<RecordedWork> iteration;
    double splats = 0, pixels = 0, intersections = 0;
};

/// Compiles every choice that the device has for each pass (engine/plan/tuner.h), the usual
/// ones first. Throws Error as Device does.
PassStatistics compile_every_pass(const std::string& select);

/// Prints a table, one row per pipeline.
void print_pass_statistics(std::FILE* out, const PassStatistics& statistics);
/// Everything that the driver reports, and the quantities common to drivers.
nlohmann::json pass_statistics_json(const PassStatistics& statistics);

}  // namespace darb
