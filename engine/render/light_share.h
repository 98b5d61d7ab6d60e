// SPDX-License-Identifier: MIT
// How much of a picture's light comes from splats that few training views confirm. A splat's light
// in a view is what it adds to the pixels: the sum of its T alpha over them.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/gpu/device.h"
#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// [N] In how many of the cameras' pictures a splat is blended into some pixel; a splat hidden by
/// others is not. Renders one picture with gradients per camera.
std::vector<std::uint32_t> views_that_see(Device& device, const SplatModel& model,
                                          const std::vector<Camera>& cameras);

/// For each camera, the share, 0 to 1, of its picture's light that comes from the chosen splats; 0
/// where there is no light. chosen: [N], 0 or 1.
std::vector<double> light_shares(Device& device, const SplatModel& model,
                                 const std::vector<std::uint8_t>& chosen,
                                 const std::vector<Camera>& cameras);

}  // namespace darb
