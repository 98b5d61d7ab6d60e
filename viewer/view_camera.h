// SPDX-License-Identifier: MIT
// Cameras for a window: a photo's camera fitted into it, and which splat is under the pointer.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "engine/scene/camera.h"
#include "engine/scene/select.h"
#include "engine/scene/splat_model.h"
#include "viewer/photo_compare.h"

namespace darb {

/// How many px of the window each px of the photo takes so that the whole photo is seen.
double fit_scale(const Camera& camera, int width, int height);
/// The photo's camera with its frame centred in what the panels leave of the window. What lies
/// beyond the frame is shown too.
Camera fitted(const Camera& camera, const WindowArea& area);

/// The same view in another size, scaled by this share in width and height.
Camera at_scale(const Camera& camera, double scale);

/// The mean, in the world, of the nearest splat that projects within 8 px of the pointer and is
/// neither deleted nor nearly transparent.
std::optional<glm::dvec3> pick(const SplatModel& model, const std::vector<std::uint8_t>& removed,
                               const Camera& camera, double x, double y);

}  // namespace darb
