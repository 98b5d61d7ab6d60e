// The scenes that `darb bench` measures on.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "engine/data/dataset.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// Splats uniform in the unit sphere, log-scales N(log 0.01, 0.4), opacity logits N(0, 1.5), higher
/// coefficients N(0, 0.05), the colour that of the position; the same at every call.
SplatModel random_scene(std::size_t splats, int sh_degree = 3);

/// Splats all over the picture of bench_camera({0, 0, 4}, true, 1000, 1000), between 3 and 5 from
/// it, six tiles each; most of them faint, as in a trained scene. Of degree 3.
SplatModel filled_scene(std::size_t splats);

/// At centre, looking along -z with y up, where upright; else turned 180 degrees about z, as scenes
/// with y down want it. Horizontal field of view of 45 degrees.
Camera bench_camera(const glm::dvec3& centre, bool upright, int width, int height);

/// A view without a photo, its lens the camera's pinhole.
View bench_view(const Camera& camera, const std::string& name);

/// The folder of photos and trained scenes: named, else the usual one; nothing where that is not
/// there. Throws Error where the named one is missing.
std::optional<std::filesystem::path> bench_data_folder(const std::filesystem::path& named,
                                                       const std::filesystem::path& usual);

}  // namespace darb
