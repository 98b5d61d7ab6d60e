// The blend passes of frames as training records them, beside the native loops on the same tile
// lists in the same process, and what those frames count.
#pragma once

#include <vector>

#include "engine/gpu/device.h"
#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"
#include "tools/bench/measure.h"

namespace darb {

struct BlendFigures {
    FrameCounts counts;                 // means over the cameras
    double contributing = 0;            // likewise
    std::vector<Yardstick> yardsticks;  // "blend" and "blend backward"; empty for other kernels
                                        // than the Gaussian
};

/// A sample draws every camera once on the device, with a made-up dL/dimage, and once natively.
/// Splats are not changed.
BlendFigures measure_blend(Device& device, const SplatModel& model,
                           const std::vector<Camera>& cameras, const ProjectionEffects& effects,
                           const Sampling& sampling);

/// The two blend passes and the native loops once, on one camera, for tests: PSNR of the pictures
/// and relative error of the sums an intersection are the agreements.
std::vector<Yardstick> compare_blend(Device& device, const SplatModel& model, const Camera& camera,
                                     int threads = 0);

}  // namespace darb
