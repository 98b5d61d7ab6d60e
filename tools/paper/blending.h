// What blending a kernel's scene takes: splats per pixel, intersections per splat, time per splat
// and pixel.
#pragma once

#include <vector>

#include "engine/gpu/device.h"
#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"

namespace darb {

struct BlendStatistics {
    double blended_per_pixel = 0;  // splats with alpha at or over the cut-off, before the stop
    double intersections_per_splat = 0;  // splat-tile intersections over visible splats
    double blend_ms = 0;                 // of the forward blend pass a frame, median of the repeats
    double frame_ms = 0;                 // of all forward passes
    double ns_per_splat_pixel = 0;       // blend_ms over splats blended, all pixels
};

/// Means over the cameras, of which there must be one; counts from the reference in double, times
/// by the device's timestamps (0 where it has none).
BlendStatistics measure_blending(Device& device, const SplatModel& model,
                                 const std::vector<Camera>& cameras, int repeats = 5);

}  // namespace darb
