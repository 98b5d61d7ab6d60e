// StepFrame: one training step on its way, as a strategy may record into it.
#pragma once

#include "engine/gpu/commands.h"
#include "engine/raster/gpu_splats.h"

namespace darb {

struct StepFrame {
    Commands& commands;
    GpuSplats& splats;
    const Buffer& status;  // gpu::FrameStatus
    int iteration;
};

}  // namespace darb
