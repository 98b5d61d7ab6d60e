// StepFrame: one training view on its way through a step, as a strategy may record into it.
#pragma once

#include "engine/gpu/commands.h"
#include "engine/raster/backward.h"
#include "engine/raster/frame.h"
#include "engine/raster/frame_view.h"

namespace darb {

struct StepFrame {
    Commands& commands;
    const FrameView& view;
    const Frame& frame;
    Backward& backward;
    GpuSplats& splats;
    const Buffer& image;    // the picture that is compared
    const Buffer& photo;    // with this, uint [H][W]
    const Buffer& d_image;  // [3][H][W], scratch until the loss writes it
    int iteration;
    /// Of a batch, [N][2], all zero: where the strategy adds what it sums up of this view; null:
    /// to its own sums.
    const Buffer* scores = nullptr;
};

}  // namespace darb
