// SPDX-License-Identifier: MIT
// The scenes that `darb bench` measures on.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "engine/data/dataset.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// Splats uniform in the unit sphere, log-scales N(log 0.01, 0.4), opacity logits N(0, 1.5), higher
/// coefficients N(0, 0.05), coloured by position; identical at every call.
SplatModel random_scene(std::size_t splats, int sh_degree = 3);

/// Splats of degree 3 that fill the picture of bench_camera({0, 0, 4}, true, 1000, 1000), at
/// distances between 3 and 5, with six tiles each; most of them faint, as in a trained scene.
SplatModel filled_scene(std::size_t splats);

/// A camera at `centre` that looks along -z, with y up where `upright`, else turned 180 degrees
/// about z, for scenes with y down. Its horizontal field of view is 45 degrees.
Camera bench_camera(const glm::dvec3& centre, bool upright, int width, int height);

/// A view without a photo, with the camera's pinhole as its lens.
View bench_view(const Camera& camera, const std::string& name);

/// The folder of photos and trained scenes: `named`, or else the usual one; nothing where that does
/// not exist. Throws Error where the named one is missing.
std::optional<std::filesystem::path> bench_data_folder(const std::filesystem::path& named,
                                                       const std::filesystem::path& usual);

}  // namespace darb
