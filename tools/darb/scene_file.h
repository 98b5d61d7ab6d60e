// The scene that a command line names: a PLY file, or the output folder of a training run.
#pragma once

#include <filesystem>

#include "engine/scene/splat_model.h"

namespace darb {

/// path itself; of a folder with point_cloud/iteration_N/point_cloud.ply the one of the largest N.
/// Throws Error for a folder without one.
std::filesystem::path find_scene(const std::filesystem::path& path);

/// read_ply of find_scene(path), with a warning on stderr for what a picture will lack: splats that
/// were dropped, a render mode that this version does not have.
SplatModel load_scene(const std::filesystem::path& path);

}  // namespace darb
