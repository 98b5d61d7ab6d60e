// SPDX-License-Identifier: MIT
// The blend passes of frames as training records them, measured beside the native loops on the same
// tile lists in the same process; and the counts of those frames.
#pragma once

#include <vector>

#include "engine/gpu/device.h"
#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"
#include "tools/bench/measure.h"

namespace darb {

struct BlendFigures {
    FrameCounts counts;                 // means over the cameras
    double contributing = 0;            // mean over the cameras
    std::vector<Yardstick> yardsticks;  // "blend" and "blend backward"; empty for kernels other
                                        // than the Gaussian
};

/// A sample draws every camera once on the device, with a made-up dL/dimage, and once natively. The
/// splats do not change.
BlendFigures measure_blend(Device& device, const SplatModel& model,
                           const std::vector<Camera>& cameras, const ProjectionEffects& effects,
                           const Sampling& sampling);

/// Runs the two blend passes and the native loops once, on one camera, for tests. The agreements
/// are the PSNR of the pictures and the relative error of the sums per intersection.
std::vector<Yardstick> compare_blend(Device& device, const SplatModel& model, const Camera& camera,
                                     int threads = 0);

}  // namespace darb
